"""Checks of the wiring by a touch: the first motion of a campaign, and its first force.

The controller creeps to a small force of its own reading and turns. The samples must show the piston go where
it was told, the force rise with it, no more steeply than the machine's frame allows, and fall as it goes
back: a sign, a scale, a delay and an exchange are seen at less than 2 kN, or before the narrow guards of the
touch end it. A touch that was ended by a guard is looked at, too: it may have been for that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.exchanged_inputs import exchanged, goes_as
from bufferstand.daq.guards.wiring.piston_scale import misled
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch, noise_of
from bufferstand.daq.guards.wiring.settings import STIFFEST_FRAME_KN_PER_MM, WiringGuard
from bufferstand.foundation.numbers import likeness

FALLS, RISES = 0.35, 0.35
"""A force that falls by this share of the touch's has the wrong sign; one that rises by less is another."""
STEEPER = 4.0
"""It rises over the piston's way by no more than so many times the machine's stiffness."""
STEP_MM = 0.01
"""A rise over less of the way cannot be told: an encoder has such steps."""
LATE_S, LATEST_S = 0.25, 3.0
"""It is late from this on; more than that is not looked for [s]."""
STILL_RISES_S = 0.1
"""It has risen no more so long after the piston has gone back: a force may be 20 ms late unsaid [s]."""
BEHIND_S = 0.15
"""… or as late as this behind the second one, whose clock is known to some hundredths of a second [s]."""
TURNED_S = 0.1
"""Where the piston has turned is looked for in means over so long [s]: its hum is no turn."""
CAME_MM = 0.03
"""The piston came by this at least, and has gone back by it."""
SIGMAS = 5.0
REST_S = 0.9
"""The force's level and noise are those of so long at the beginning [s]."""
TOLD_KN, APART = 1.5, 2.5
"""The second force is compared with the first where it rose by this, and is so many times the other."""
MOVES_MM, STOOD_MM, PRESSED_MM = 0.1, 0.3, 0.5
"""A wire that moves has gone so far; one that stood did so over this of the piston's way; and a specimen
whose wires have gone this far is pressed by several times the force of a touch, or is none [mm]."""
NOISY_TIMES = 2.0
"""A force that scatters by so many times as much as the second one may be too large by that."""


@dataclass(frozen=True)
class TouchOutcome:
    """A touch as it was asked for, and as it ended.

    Parameters
    ----------
    stretch : Stretch
        From rest on, moved by the delays that are stated.
    asked_kN : float
        Force over that at rest at which the controller was to turn.
    turned : bool
        Whether it turned there, by its own reading.
    own_kN : float or None
        Its own reading at last, for the message.
    halted : bool
        Whether it was ended by something else.
    """

    stretch: SampleStretch
    asked_kN: float
    turned: bool
    own_kN: float | None = None
    halted: bool = False


@dataclass(frozen=True)
class _Rise:
    """The force over its level at rest, and the piston's place."""

    time: Floats
    force: Floats
    place: Floats
    noise: float
    least: float
    """A change of less is none [kN]."""

    @property
    def high(self) -> float:
        return float(self.force.max())

    @property
    def low(self) -> float:
        return float(self.force.min())


def doubt_of_touch(  # noqa: PLR0911 - one return for each thing that can be wrong
    touch: TouchOutcome, guard: WiringGuard
) -> SignalDoubt | None:
    """Return what a touch says against the wiring, None if nothing.

    Parameters
    ----------
    touch : Touch
    guard : WiringGuard
        What is known of the machine.
    """
    rise = _rise(touch)
    if rise is None:
        return None
    odd = touch.halted or (touch.turned and rise.high < rise.least)
    piston = misled(touch.stretch, follows=True)
    if piston is not None and piston.kind == "swapped":
        return piston
    if odd and (swap := exchanged(touch.stretch, FALLS * touch.asked_kN)) is not None:
        return swap
    if piston is not None:
        return piston
    if (sign := _sign(touch, rise)) is not None:
        return sign
    late = _behind_second(touch, rise) or _still_rises(rise)
    if late is not None:
        return late
    if touch.turned and rise.high < max(RISES * touch.asked_kN, SIGMAS * rise.noise):
        return _too_little(touch, rise)
    if rise.high <= rise.least or (touch.halted and not touch.turned):
        unseen = _second_alone(touch, rise) or _pressed_unseen(touch, rise)
        if unseen is not None or rise.high <= rise.least:
            return unseen
    return _goes_as_the_piston(touch, rise) or _late(rise) or _steep(rise, guard)


def has_risen(touch: TouchOutcome) -> bool:
    """Return whether the force of a touch has risen: a late one may be yet to come."""
    rise = _rise(touch)
    return rise is None or rise.high >= rise.least


def scatter_doubt(force: Floats, second: Floats, asked_kN: float) -> SignalDoubt:
    """Return the doubt of a force that scatters so much at rest that no touch can be told from it.

    Parameters
    ----------
    force, second : NDArray
        Force and second force at rest, shape (n,) and (m,) [kN].
    asked_kN : float
        Force at which a touch would turn.
    """
    own_kN = float(np.std(force))
    beside = f"force at rest scatters by {own_kN:.2f} kN (standard deviation)"
    other_kN = float(np.std(second)) if len(second) > 10 else 0.0
    if other_kN > 0.0 and own_kN > NOISY_TIMES * other_kN:
        look = likeness(own_kN / other_kN)
        beside += f", {own_kN / other_kN:.1f} times as much as force_2" + (f" ({look})" if look else "")
    text = (
        f"{beside}: a touch at {asked_kN:g} kN would not be told from it; its scale is too large, or its "
        "cable or filter lets noise in"
    )
    return _doubt("scale", "calibration", text, own_kN, None, "kN")


def _rise(touch: TouchOutcome) -> _Rise | None:
    smooth = touch.stretch.smoothed()
    force, place = smooth.values.get("force"), smooth.values.get("position")
    if force is None or place is None or len(touch.stretch) < 50:
        return None
    rest = smooth.time_s < smooth.time_s[0] + REST_S
    level = float(np.median(force[rest]))
    width = max(1, len(touch.stretch) - len(smooth) + 1)
    noise = noise_of(touch.stretch.values["force"]) / float(np.sqrt(width))
    # What it does at rest, by drift and slow noise, it may do at any time.
    idle = 1.5 * float(np.max(np.abs(force[rest] - level))) if not touch.halted or rest.sum() > 10 else 0.0
    least = max(FALLS * touch.asked_kN, SIGMAS * noise, idle)
    return _Rise(smooth.time_s, force - level, place, noise, least)


def _sign(touch: TouchOutcome, rise: _Rise) -> SignalDoubt | None:
    if not (rise.low < -rise.least and -rise.low > 2.0 * rise.high):
        return None
    text = f"force fell by {-rise.low:.2f} kN as the piston touched the specimen{_own(touch)}"
    return _doubt("sign", "calibration", f"{text}: its sign is turned", rise.low, 0.0, "kN")


def _too_little(touch: TouchOutcome, rise: _Rise) -> SignalDoubt:
    high = rise.high
    look = likeness(high / touch.asked_kN) if high > rise.least / 2.0 else ""
    text = (
        f"force rose by {max(high, 0.0):.2f} kN only where the controller turned at {touch.asked_kN:.2f} kN "
        f"of its own{_own(touch)}: another scale, another signal, or late" + (f" ({look})" if look else "")
    )
    return _doubt("scale", "calibration", text, high, touch.asked_kN, "kN")


def _own(touch: TouchOutcome) -> str:
    return "" if touch.own_kN is None else f" (its own reading is {touch.own_kN:+.2f} kN now)"


def _still_rises(rise: _Rise) -> SignalDoubt | None:
    """Return a doubt where the force still rises after the piston has gone back."""
    period_s = float(np.median(np.diff(rise.time)))
    width = max(1, min(len(rise.time), round(TURNED_S / period_s)))
    place = np.convolve(
        np.pad(rise.place, (width // 2, width - 1 - width // 2), "edge"), np.full(width, 1.0 / width), "valid"
    )
    top = int(np.argmax(place))
    back = np.flatnonzero(
        (place[top:] < place[top] - CAME_MM) & (rise.time[top:] > rise.time[top] + STILL_RISES_S)
    )
    if not len(back):
        return None
    then = float(np.max(rise.force[: top + 1][-3:]))
    later = top + int(back[0])
    highest = later + int(np.argmax(rise.force[later:]))
    if float(rise.force[highest]) < max(then, 0.0) + rise.least:
        return None
    late_s = float(rise.time[highest] - rise.time[top])
    text = (
        f"force was still rising {late_s:.2f} s after the piston had turned and gone back: it is late by as "
        "much at least"
    )
    return _doubt("delay", "delay_s", text, late_s, STILL_RISES_S, "s")


def _behind_second(touch: TouchOutcome, rise: _Rise) -> SignalDoubt | None:
    """Return a doubt where the force comes to half of its height later than the second force to its own."""
    second_kN = _second_rise_kN(touch)
    if second_kN is None or second_kN < TOLD_KN or rise.high < rise.least:
        return None
    smooth = touch.stretch.smoothed()
    level = float(np.median(smooth.second_kN[smooth.second_s < smooth.time_s[0] + REST_S]))
    own_s = _half_way_s(rise.time, rise.force, 0.5 * rise.high)
    late_s = own_s - _half_way_s(smooth.second_s, smooth.second_kN, level + 0.5 * second_kN)
    if late_s < BEHIND_S:
        return None
    text = f"force rose {late_s:.2f} s later than force_2 in the touch"
    return _doubt("delay", "delay_s", text, late_s, BEHIND_S, "s")


def _half_way_s(time: Floats, force: Floats, half: float) -> float:
    """Return when a force was last below half of its height before its greatest [s]."""
    below = np.flatnonzero(force[: int(np.argmax(force)) + 1] < half)
    return float(time[int(below[-1])] if len(below) else time[0])


def _late(rise: _Rise) -> SignalDoubt | None:
    """Return a doubt where the force rises and falls later than the piston comes and goes."""
    above = np.flatnonzero(rise.force > 0.5 * rise.high)
    up, down = int(above[0]), int(above[-1])
    came_mm = float(rise.place[up:].max() - rise.place[: max(up, 1)].min())
    if down >= len(rise.force) - 1 or came_mm < CAME_MM:
        return None  # it was never seen to fall, or the piston tells nothing
    lags = np.arange(0.0, LATEST_S, 0.01)
    went, came = (np.interp(rise.time[row] - lags, rise.time, rise.place) for row in (down, up))
    even = np.flatnonzero(came - went <= 0.0)
    late_s = float(lags[int(even[0])]) if len(even) else LATEST_S
    if late_s < LATE_S:
        return None
    text = (
        f"force rose and fell {late_s:.2f} s after the piston came to first contact and left it: it is late"
    )
    return _doubt("delay", "delay_s", text, late_s, LATE_S, "s")


def _steep(rise: _Rise, guard: WiringGuard) -> SignalDoubt | None:
    """Return a doubt where the force rises more steeply than any frame lets it."""
    top = int(np.argmax(rise.force))
    below = np.flatnonzero(rise.force[: top + 1] < 0.2 * rise.high)
    begin = int(below[-1]) if len(below) else 0
    rise_mm = float(rise.place[top] - rise.place[begin])
    frame = guard.frame_kN_per_mm or STIFFEST_FRAME_KN_PER_MM
    slope = (float(rise.force[top]) - float(rise.force[begin])) / max(rise_mm, STEP_MM)
    if top - begin < 3 or slope <= STEEPER * frame:
        return None
    stated = "as stated" if guard.frame_kN_per_mm else "as the stiffest has"
    text = (
        f"force rose by {slope:.0f} kN per mm of the piston at first contact, though the machine "
        f"itself gives way by 1 mm under {frame:.0f} kN, {stated}: its scale is too large"
    )
    return _doubt("scale", "calibration", text, slope, STEEPER * frame, "kN/mm")


def _goes_as_the_piston(touch: TouchOutcome, rise: _Rise) -> SignalDoubt | None:
    """Return a doubt where the force is the piston's way, from rest on.

    A specimen so soft lets the draw wires go with the piston, and the second force rise with the first.
    """
    second_kN, top = _second_rise_kN(touch), int(np.argmax(rise.place))
    began = int(np.argmax(rise.place > rise.place[0] + 0.02))
    went_mm = float(rise.place[top] - rise.place[began])
    wires = [float(np.ptp(values[began : top + 1])) for values in _wires(touch)]
    if not goes_as(rise.force[began : top + 1], rise.place[began : top + 1]):
        return None
    if second_kN is None or second_kN < TOLD_KN:  # of less than that a slow or noisy one says little
        unmoved = bool(wires) and max(wires) < 0.5 * went_mm
    else:
        unmoved = False
    if not unmoved and (second_kN is None or second_kN > 0.5 * rise.high):
        return None
    text = f"force rose by {rise.high:.2f} kN as the piston went {went_mm:.2f} mm"
    text += "" if second_kN is None else f", and force_2 by {second_kN:.2f} kN"
    text += "".join(
        f", and {name} went {way:.2f} mm" for name, way in zip(touch.stretch.wires, wires, strict=True)
    )
    text += ": its input has the piston's way, or its command"
    return _doubt("disagrees", "registers", text, rise.high, second_kN, "kN")


def _wires(touch: TouchOutcome) -> list[Floats]:
    smooth = touch.stretch.smoothed()
    return [smooth.values[name] for name in smooth.wires]


def _pressed_unseen(touch: TouchOutcome, rise: _Rise) -> SignalDoubt | None:
    """Return a doubt where the piston has taken the draw wires along, and no force is seen.

    Wires that follow the plate go with it from the start; those that stood first hang on a specimen.
    """
    wires, top = _wires(touch), int(np.argmax(rise.place))
    if touch.turned or not wires or rise.high > touch.asked_kN:
        return None
    way = np.mean(wires, axis=0)
    way = way - way[0]
    went_mm, place = float(way[top]), rise.place - rise.place[0]
    stood_mm = float(place[int(np.argmax(np.abs(way) > MOVES_MM))])
    if went_mm < PRESSED_MM or stood_mm < STOOD_MM:
        return None
    text = (
        f"force rose by {max(rise.high, 0.0):.2f} kN only as the piston took the draw wires along by "
        f"{went_mm:.1f} mm, which had stood before: its scale is too small, or it stands still"
    )
    return _doubt("scale", "calibration", text, rise.high, touch.asked_kN, "kN")


def _second_alone(touch: TouchOutcome, rise: _Rise) -> SignalDoubt | None:
    """Return a doubt where the second force rose by several times as much: one of both has another scale."""
    second_kN = _second_rise_kN(touch)
    if second_kN is None or second_kN < TOLD_KN or second_kN < APART * max(rise.high, 0.0):
        return None
    ratio = max(rise.high, 0.0) / second_kN
    look = likeness(ratio) if rise.high > rise.least / 2.0 else ""
    setting = f"{channel_setting('force', 'calibration')}, or {channel_setting('force_2', 'calibration')}"
    text = (
        f"force rose by {max(rise.high, 0.0):.2f} kN in the touch and force_2 by {second_kN:.2f} kN, "
        f"{ratio:.3f} times as much"
        + (f" ({look})" if look else "")
        + ": one of both has another scale, or another signal"
    )
    return SignalDoubt("scale", "force, force_2", "controller", setting, text, ratio, 1.0 / APART, "")


def _second_rise_kN(touch: TouchOutcome) -> float | None:  # noqa: N802 - the unit keeps its capital
    smooth = touch.stretch.smoothed()
    if len(smooth.second_s) < 20:
        return None
    rest = smooth.second_s < smooth.time_s[0] + REST_S
    if rest.sum() < 5:
        return None
    noise_kN = 3.0 * noise_of(smooth.second_kN)
    return max(0.0, float(smooth.second_kN.max()) - float(np.median(smooth.second_kN[rest])) - noise_kN)


def _doubt(kind: Kind, key: str, text: str, value: float, limit: float | None, unit: str) -> SignalDoubt:
    return SignalDoubt(kind, "force", "controller", channel_setting("force", key), text, value, limit, unit)
