"""The draw wires against the piston and each other, and the piston against its command.

Where the specimen is in contact, the stroke is the piston's position less what the machine gives way:
``stroke = position - F / k``. A machine of 80 kN/mm gives way by 8 mm at 600 kN, one of 150 by 4 mm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.as_finding import SETTING, doubt
from bufferstand.evaluation.plausibility.signal_comparison.signal_fit import (
    SignalFit,
    fitted,
    lateness,
    shown,
    still_from,
)
from bufferstand.evaluation.record import Signals
from bufferstand.foundation.numbers import median as median_of

STIFFNESS = 150.0
"""Of a machine that states none [kN/mm]."""
SOFTEST = 60.0
"""No machine is softer [kN/mm]: so much may the stated stiffness be off."""
FACTOR, FACTOR_WIRES = 0.1, 0.04
"""A wire may differ from the piston, and the wires from each other, by this share (and what the machine may
give way more than stated)."""
LEAST_MM = 5.0
"""A piston that moves less tells nothing of factors."""
CONTACT_SHARE, CONTACT_FORCE = 0.15, 0.03
"""In contact is what is beyond this share of the piston's way and of the greatest force."""
ZERO_MM = 3.0
"""Where stroke 0 was set, on piston and wires alike, they may differ by this and what the frame gives."""
FREE_KN, FREE_SHARE = 1.0, 0.01
"""No force is on the specimen below this, and below this share of the run's range."""
FREE_MM, FREE_OF_LENGTH = 10.0, 0.1
"""An unloaded specimen does not stay behind by more than this, and this share of the stroke that it has …"""
APART_MM = 3.0
"""… and its two wires read the same within this."""
SLIP_MM, SLIP_SHARE = 1.0, 0.02
"""A wire that slips leaves the piston by this, and this share of its way, …"""
SLIP_ALONE = 2.0
"""… and so many times as far as the other wire does."""
FOLLOWS, AT_ALL, BETTER = 0.05, 0.3, 0.5
LEAST_LATE_S = 0.02
STILL = 0.02
_FEWEST, _FEWEST_FREE = 100, 10
_STRETCHES = 20


def strokes_and_piston(look: RunView, signals: Signals, stiffness: float | None) -> list[Finding]:
    """Return how wires, piston and command belie each other.

    Parameters
    ----------
    look : Look
    signals : Signals
    stiffness : float, optional
        Of the machine, as the stand file states it [kN/mm].
    """
    position = signals.get("position")
    if position is None or float(np.ptp(position)) < LEAST_MM:
        return _command_moves(look, signals) + (_wires_alone(look, signals) or _zeros(look, signals))
    found = _piston(look, signals, position)
    if any(finding.channel == "position" for finding in found):
        return found + (_wires_alone(look, signals) or _zeros(look, signals))
    rows = _in_contact(signals, position)
    if np.count_nonzero(rows) < _FEWEST:
        return found
    expected, slack_mm = _expected(look, signals, position, stiffness)
    judged = {
        name: _wire(look, name, signals, rows, expected, slack_mm)
        for name in signals.strokes
        if name not in look.out
    }
    return found + (
        _together(look, judged) or _zeros(look, signals) or _slipped(look, signals, rows, expected)
    )


def _piston(look: RunView, signals: Signals, position: FloatArray) -> list[Finding]:
    """Return whether the piston's signal follows its command."""
    command = signals.get("command")
    if command is None or float(np.ptp(command)) < LEAST_MM:
        return []
    fit = fitted(command, position)
    if fit is None or (abs(fit.factor - 1.0) <= FACTOR and fit.left <= AT_ALL):
        return []
    late = lateness(signals.time_s, command, position)
    fit = late[1] if late is not None else fit
    if abs(fit.factor - 1.0) <= FACTOR and fit.left <= AT_ALL:
        return []
    what = f"is {shown(fit.factor)} of its command" if fit.left <= AT_ALL else "does not follow its command"
    kind: Literal["sign", "scale", "not-following"] = "scale"
    if fit.left > AT_ALL:
        kind = "not-following"
    elif fit.factor < 0.0:
        kind = "sign"
    text = (
        f"position {what}: the piston's encoder or its channel is wrong; look at the channel “position” in "
        f"{SETTING}; no figure is read from it"
    )
    return [doubt(look, kind, "position", fit.factor, "", text, effect="noted")]


def _command_moves(look: RunView, signals: Signals) -> list[Finding]:
    """Return whether the piston's signal stands still under a command that moves."""
    command, position = signals.get("command"), signals.get("position")
    if command is None or position is None:
        return []
    commanded, moved = float(np.ptp(command)), float(np.ptp(position))
    if commanded < LEAST_MM or moved > STILL * commanded:
        return []
    text = (
        f"position stands still ({moved:.3g} mm) while the command moves by {commanded:.4g} mm: the piston's "
        f"encoder is cut off or frozen; look at its cable; no figure is read from it"
    )
    return [doubt(look, "frozen", "position", commanded, "mm", text, effect="noted")]


def _in_contact(signals: Signals, position: FloatArray) -> NDArray[np.bool_]:
    """Say in which samples the specimen is in contact, shape (N,); a force that says nothing is not asked."""
    low = float(np.min(position))
    rows = position > low + CONTACT_SHARE * float(np.ptp(position))
    force = np.abs(signals.by_name["force"])
    pressed = force > CONTACT_FORCE * float(np.max(force))
    both = rows & pressed
    return both if np.count_nonzero(both) > 0.5 * np.count_nonzero(rows) else rows


def _expected(
    look: RunView, signals: Signals, position: FloatArray, stiffness: float | None
) -> tuple[FloatArray, float]:
    """Return the stroke by the piston [mm], shape (N,), and how much more the machine may give way [mm]."""
    stated = stiffness or STIFFNESS
    most_kN = look.facts.force_limit_kN or 600.0
    force = np.clip(signals.by_name["force"], 0.0, most_kN)
    return position - force / stated, float(np.max(force)) * (1.0 / SOFTEST - 1.0 / stated)


def _wire(
    look: RunView,
    name: str,
    signals: Signals,
    rows: NDArray[np.bool_],
    expected: FloatArray,
    slack_mm: float,
) -> list[Finding]:
    """Return what is wrong with one wire, by the piston."""
    own, reference = signals.by_name[name], expected
    span_mm = float(np.ptp(reference[rows]))
    if span_mm < LEAST_MM:
        return []
    if float(np.ptp(own)) < STILL * span_mm:
        text = f"{name} stands still while the piston moves by {span_mm:.4g} mm: unhooked, cut off or frozen"
        return [
            doubt(look, "frozen", name, span_mm, "mm", f"{text}; look at the wire, its hook and its plug")
        ]
    since_s = still_from(signals.time_s, own, reference)
    if since_s is not None:
        text = (
            f"{name} stands still from {since_s:.4g} s on while the piston moves: unhooked, cut off or frozen"
        )
        return [doubt(look, "frozen", name, since_s, "s", f"{text}; look at the wire, its hook and its plug")]
    fit = fitted(reference[rows], own[rows])
    if fit is None:
        return []
    found: list[Finding] = []
    if fit.left > FOLLOWS:
        late = lateness(signals.time_s, reference, own)
        if late is not None and abs(late[0]) > LEAST_LATE_S and late[1].left < BETTER * fit.left:
            what = "later" if late[0] > 0.0 else "earlier"
            text = (
                f"{name} comes {abs(late[0]):.3g} s {what} than the piston: look at its delay_s ({SETTING}) "
                "and at the filter of its converter"
            )
            found.append(doubt(look, "delay", name, late[0], "s", text))
            moved = np.interp(signals.time_s - late[0], signals.time_s, reference)
            fit = fitted(moved[rows], own[rows]) or fit
    if fit.left > AT_ALL:
        text = (
            f"{name} does not follow the piston ({fit.left:.0%} of it is something else): look at which "
            f"input it is on and at the channel in {SETTING}"
        )
        return [*found, doubt(look, "not-following", name, fit.left, "", text)]
    return found + _factor_or_zero(look, name, fit, span_mm, slack_mm)


def _factor_or_zero(
    look: RunView, name: str, fit: SignalFit, span_mm: float, slack_mm: float
) -> list[Finding]:
    where = f"look at the channel “{name}” in {SETTING} (calibration) and at how the wire hangs"
    if not 1.0 - FACTOR - slack_mm / span_mm <= fit.factor <= 1.0 + FACTOR:
        if fit.factor < 0.0:
            text = f"{name} falls as the piston goes in: its sign is wrong; {where}"
            return [doubt(look, "sign", name, fit.factor, "", text)]
        text = f"{name} is {shown(fit.factor)} of the piston's way: wrong factor; {where}"
        return [doubt(look, "scale", name, fit.factor, "", text)]
    if not look.facts.zero or abs(fit.zero) <= ZERO_MM + slack_mm:
        return []
    text = (
        f"{name} is {fit.zero:+.3g} mm off the piston though both were set to 0 at first contact: its zero "
        f"is off, or it has slipped since; {where}, and set the zero anew"
    )
    return [doubt(look, "zero", name, fit.zero, "mm", text)]


def _together(look: RunView, judged: Mapping[str, list[Finding]]) -> list[Finding]:
    """Return the findings of the wires; of what all of them have in common one about the stroke."""
    all_found = [finding for one in judged.values() for finding in one]
    first = [one[0] for one in judged.values() if one]
    early_s = [-one.size for one in first if one.kind == "delay" and one.size is not None and one.size < 0.0]
    if first and len(early_s) == len(judged):  # nothing measures before it happens
        text = (
            f"position comes {max(early_s):.3g} s later than {' and '.join(judged)}: look at delay_s of the "
            f"channel “position” in {SETTING}; no figure is read from it"
        )
        return [doubt(look, "delay", "position", max(early_s), "s", text, effect="noted")]
    if len(judged) < 2 or len(first) < len(judged):
        return all_found
    if len({finding.kind for finding in first}) > 1 or first[0].size is None:
        return all_found
    sizes = [finding.size for finding in first if finding.size is not None]
    if max(sizes) - min(sizes) > 0.1 * max(abs(size) for size in sizes):
        return all_found
    which = "both" if len(judged) == 2 else "all"
    text = f"{which} draw wires alike: {first[0].text}; or the piston's channel is wrong, and they are right"
    return [doubt(look, first[0].kind, "stroke", first[0].size, first[0].unit, text)]


def _wires_alone(look: RunView, signals: Signals) -> list[Finding]:
    """Return whether wires differ from the first by a factor, where no piston says which is right."""
    if len(signals.strokes) < 2 or look.out:
        return []
    first, *others = signals.strokes
    return next((found for other in others if (found := _two_wires(look, signals, first, other))), [])


def _two_wires(look: RunView, signals: Signals, first: str, second: str) -> list[Finding]:
    one, two = signals.by_name[first], signals.by_name[second]
    fit = fitted(one, two)
    if fit is None or max(float(np.ptp(one)), float(np.ptp(two))) < LEAST_MM:
        return []
    late = lateness(signals.time_s, one, two) if fit.left > FOLLOWS else None
    if late is not None and abs(late[0]) > LEAST_LATE_S and late[1].left < BETTER * fit.left:
        name, other = (second, first) if late[0] > 0.0 else (first, second)
        text = f"{name} comes {abs(late[0]):.3g} s later than {other}: look at delay_s of both ({SETTING})"
        return [doubt(look, "delay", name, abs(late[0]), "s", text)]
    # What a factor leaves is less than what it explains: a wire that slips, or jumps, has none.
    if abs(fit.factor - 1.0) <= max(FACTOR_WIRES, fit.left) or fit.left > AT_ALL:
        return []
    kind: Literal["scale", "sign"] = "scale" if fit.factor > 0.0 else "sign"
    text = (
        f"{second} is {shown(fit.factor)} of {first}: one of them has a wrong factor or sign; look at the "
        f"calibrations of both in {SETTING}"
    )
    return [doubt(look, kind, "stroke", fit.factor, "", text)]


def _zeros(look: RunView, signals: Signals) -> list[Finding]:
    """Return which wires read a stroke where no force is on the specimen yet."""
    force = signals.by_name["force"]
    pressed = np.abs(force) >= max(FREE_KN, FREE_SHARE * look.force.span)  # which spikes do not widen
    first = int(np.argmax(pressed)) if np.any(pressed) else 0
    if first < _FEWEST_FREE:
        return []
    length_mm = look.facts.specimen.get("max_stroke_mm")
    limit_mm = FREE_MM
    if isinstance(length_mm, int | float):
        limit_mm = max(FREE_MM, FREE_OF_LENGTH * float(length_mm))
    read = {
        name: median_of(signals.by_name[name][:first]) for name in signals.strokes if name not in look.out
    }
    off = {name: mm for name, mm in read.items() if mm > limit_mm}
    if len(read) == 2 and len(off) < 2:
        (one, mm), (two, other_mm) = read.items()
        name = one if abs(mm) > abs(other_mm) else two
        off = {name: read[name]} if abs(mm - other_mm) > APART_MM else {}
    if not off:
        return []
    channel = next(iter(off)) if len(off) < len(read) else "stroke"
    size = max(off.values(), key=abs)
    text = (
        f"{channel} reads {size:+.3g} mm before any force is on the specimen: its zero is off; look at the "
        f"calibration in {SETTING} and at the wire's hook, set the zero and repeat the test"
    )
    return [doubt(look, "zero", channel, size, "mm", text)]


def _slipped(look: RunView, signals: Signals, rows: NDArray[np.bool_], expected: FloatArray) -> list[Finding]:
    """Return the wire that leaves the piston for good while another one does not."""
    if any(name in look.out for name in signals.strokes) or len(signals.strokes) < 2:
        return []
    time_s = signals.time_s[rows]
    left = {name: (signals.by_name[name] - expected)[rows] for name in signals.strokes}
    most_mm = SLIP_MM + SLIP_SHARE * float(np.ptp(expected[rows]))
    # A step is no larger than the range of the samples on both sides of it.
    if all(float(np.ptp(left_mm)) <= most_mm for left_mm in left.values()):
        return []
    moved = {name: _step(time_s, left_mm)[0] for name, left_mm in left.items()}
    one, other = sorted(moved, key=lambda name: -abs(moved[name]))[:2]
    most_mm = max(most_mm, SLIP_ALONE * abs(moved[other]))
    if abs(moved[one]) <= most_mm:
        return []
    # What the frame gives is the same for both wires: their difference shows the step alone.
    size, at_s = _step(time_s, left[one] - left[other])
    if abs(size) <= most_mm:
        return []
    text = (
        f"{one} slips by {size:+.3g} mm about {at_s:.4g} s, and the other wire does not: look at its hook "
        "and drum, set the zero anew and repeat the test"
    )
    return [doubt(look, "slip", one, size, "mm", text)]


def _step(time_s: FloatArray, left_mm: FloatArray) -> tuple[float, float]:
    """Return the largest lasting step of what a wire is off the piston [mm], and when [s]."""
    parts = np.array_split(np.arange(time_s.size), _STRETCHES)
    levels = [median_of(left_mm[part[0] : part[-1] + 1]) for part in parts]
    cuts = range(2, _STRETCHES - 1)
    left = [_off_median(levels[:cut]) + _off_median(levels[cut:]) for cut in cuts]
    cut = cuts[left.index(min(left))]  # two levels fit best there; their medians alone hardly move with it
    return median(levels[cut:]) - median(levels[:cut]), float(time_s[parts[cut][0]])


def _off_median(levels: Sequence[float]) -> float:
    """Return the sum of what levels are off their median [mm]."""
    middle = median(levels)
    return sum(abs(level - middle) for level in levels)
