"""The wiring as the reason of a trip: the last seconds of draw wires and forces.

The live judges look at what lasts, and at motions that are slow; a limit is passed once. So here the one draw
wire is compared with the other, which goes with the piston, and the force against the second one.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import permutations
from typing import Literal

import numpy as np

from bufferstand.daq.guards.trips import Trip
from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.exchanged_inputs import exchanged
from bufferstand.daq.guards.wiring.forces import farther, leap_of, leapt
from bufferstand.daq.guards.wiring.piston_scale import misled
from bufferstand.daq.guards.wiring.positions import BACK_S, explained_late_s, late_piston, late_wires
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.foundation.channels import tilt_of_strokes
from bufferstand.foundation.numbers import likeness

Limited = Literal["force", "stroke"]
"""What a device has a limit of its own of."""
LOOKED_BACK_S = 2.0
"""Why a limit was passed is looked for in so long a time before it [s]."""
RIGHT_MM, RIGHT_SHARE = 0.8, 0.2
"""A draw wire that goes with the piston is off it by this and this share of how far the wires are apart: of
a plate that tilts about its middle each wire has one half."""
STILL, TURNED, MUCH = 0.15, -0.3, 1.5
"""A wire that goes so little of the other's way stands still, its sign is turned, or its scale is wrong."""
MOVED_MM = 2.0
"""Seen over so much of the other's way."""
PRESSED_MM = 0.5
"""The specimen is pressed once a wire has gone so far."""
BEGINS_MM, BEFORE_S = 0.3, 0.5
"""A delay is looked for from so long before the other wire has gone so far."""
DELAY_LEAVES = 0.5
"""A delay leaves no more than this share of what both wires are apart."""
APART_KN, APART_TIMES = 6.0, 1.6
"""Both forces are of one transducer where the one is within this, and these times, of the other."""
SECOND_S, SECOND_OLD_S = 0.3, 0.6
"""The second force is that of so long [s]; one that is older tells nothing."""
CLOCKS_S, PLACE_MM = 0.05, 0.5
"""Its clock is known to this [s], and the specimen's stroke to this [mm]."""


def tripped_by(
    guard: WiringGuard,
    trip: Trip,
    stretch: SampleStretch,
    zeros_mm: Mapping[str, float],
    specimen_C: float | None,
) -> SignalDoubt | None:
    """Return what is wrong with the wiring that a trip comes of, None where nothing says so.

    Parameters
    ----------
    guard : WiringGuard
    trip : Trip
        Of a guard that believes its signal.
    stretch : Stretch
        The last seconds before it.
    zeros_mm : mapping of str to float
        What each draw wire reads at rest [mm].
    specimen_C : float or None
        Of the warmest thermometer on the specimen [°C].
    """
    last = stretch.last(LOOKED_BACK_S)
    doubt = exchanged(last) or misled(last, follows=False)
    if doubt is not None:
        return doubt
    if trip.guard in ("tilt", "stroke"):
        return _leapt_unseen(last) or _wire(guard, stretch, zeros_mm)
    if trip.guard == "following error":
        return _piston(stretch)
    if trip.guard == "force":
        return _force(guard, trip, last, specimen_C) or leapt(guard, last)
    return None


def until_limit(stretch: SampleStretch, limited: Limited) -> SampleStretch:
    """Return a stretch up to where a channel was greatest: there the device's own limit has ended a motion.

    What comes behind is its release.

    Parameters
    ----------
    stretch : Stretch
        The last seconds.
    limited : str
        Whose limit it was.
    """
    last = stretch.last(LOOKED_BACK_S)
    value = last.values.get("force" if limited == "force" else "position")
    if value is None:
        return stretch
    return stretch.until(float(last.time_s[int(np.argmax(np.abs(value)))]))


def _leapt_unseen(stretch: SampleStretch) -> SignalDoubt | None:
    """Return a doubt of exchanged inputs where the second force has not come to the leap yet."""
    if not len(stretch.second_s) or stretch.second_s[-1] > stretch.time_s[-1]:
        return None
    return exchanged(SampleStretch(stretch.time_s, stretch.values))


# --- draw wires -----------------------------------------------------------------------------------------


def _wire(guard: WiringGuard, stretch: SampleStretch, zeros_mm: Mapping[str, float]) -> SignalDoubt | None:
    """Return a doubt of the wire that does not go with the piston, where another one does."""
    smooth = stretch.smoothed()
    way = smooth.values.get("position", smooth.told)
    if way is None or len(smooth.wires) < 2:
        return None
    gone = {name: smooth.values[name] - zeros_mm.get(name, 0.0) for name in smooth.wires}
    apart_mm = float(np.max(np.abs(tilt_of_strokes(list(gone.values())))))
    force_kN = np.maximum(smooth.values.get("force", np.zeros(len(way))), 0.0)
    given_mm = 0.5 * sum(guard.given_way_mm(1.0)) * force_kN
    pressed = np.maximum.reduce(list(gone.values())) > PRESSED_MM
    off = {name: (way - given_mm - value)[pressed] for name, value in gone.items()}
    for own, other in permutations(smooth.wires, 2):
        moved = float(np.ptp(gone[other])) > MOVED_MM and np.count_nonzero(pressed) > 5
        if not moved or _spread(off[other]) > RIGHT_MM + RIGHT_SHARE * apart_mm:
            continue
        doubt = _beside(guard, smooth.time_s, own, gone[own], gone[other])
        if doubt is not None:
            return doubt
    return None


def _spread(values: Floats) -> float:
    return float(np.ptp(np.quantile(values, (0.02, 0.98))))


def _beside(guard: WiringGuard, time: Floats, name: str, own: Floats, other: Floats) -> SignalDoubt | None:
    """Return what is wrong with a wire beside one that is right."""
    begins_s = float(time[int(np.argmax(other > BEGINS_MM))]) - BEFORE_S
    rows = time >= max(begins_s, float(time[-1]) - BACK_S)
    when = time[rows]
    late_s = explained_late_s(when, other[rows], own[rows])
    if late_s is not None and guard.delays_s.get(name, 0.0) < 0.5 * late_s:
        left = own[rows] - np.interp(when - late_s, when, other[rows])
        left = left[when > when[0] + late_s]
        if float(np.ptp(left)) < DELAY_LEAVES * float(np.ptp((own - other)[rows])):
            return late_wires(name, late_s)
    way_mm = float(other[-1] - other[0])
    if abs(way_mm) < MOVED_MM:
        return None
    ratio = float(own[-1] - own[0]) / way_mm
    seen = (
        f"{name} goes {own[-1] - own[0]:.2f} mm where the other draw wire goes {way_mm:.2f} mm as the piston"
    )
    if abs(ratio) < STILL:
        how = "it stands still, it may have come off or its drum sticks, or it comes much too late"
        return _wire_doubt("still", name, "calibration and delay_s", f"{seen}: {how}", ratio)
    if ratio < TURNED:
        return _wire_doubt("sign", name, "calibration", f"{seen}: its sign is turned", ratio)
    straight = float(np.corrcoef(own, other)[0, 1]) > 0.99
    if straight and not 1.0 / MUCH < ratio < MUCH:
        look = likeness(ratio)
        text = f"{seen}, {ratio:.2f} times as far" + (f", {look}" if look else "")
        return _wire_doubt("scale", name, "calibration", text, ratio)
    return None


def _wire_doubt(kind: Kind, name: str, key: str, text: str, value: float) -> SignalDoubt:
    return SignalDoubt(kind, name, "controller", channel_setting(name, key), text, value, None, "")


def _piston(stretch: SampleStretch) -> SignalDoubt | None:
    """Return a doubt of the position that is late, where the wires go with its command."""
    smooth = stretch.smoothed()
    told, at = smooth.told, smooth.values.get("position")
    if told is None or at is None or not smooth.wires:
        return None
    wires = np.mean([smooth.values[name] for name in smooth.wires], axis=0)
    moving = wires - wires[0] > 0.5
    if np.count_nonzero(moving) < 10 or float(np.ptp(wires)) < MOVED_MM:
        return None
    apart = float(np.ptp((told - at)[moving]))
    if float(np.ptp((told - wires)[moving])) > 0.4 * apart:
        return None
    late_s = explained_late_s(smooth.time_s, told, at)
    if late_s is None:
        return None
    seen = (
        f"the piston's position reads {at[-1]:.2f} mm where it was told {told[-1]:.2f} mm, and the draw "
        "wires go with the command"
    )
    return late_piston(seen, late_s)


# --- force ----------------------------------------------------------------------------------------------


def _force(
    guard: WiringGuard, trip: Trip, stretch: SampleStretch, specimen_C: float | None
) -> SignalDoubt | None:
    """Return a doubt of the force that passed its limit, where the second one of the same load did not."""
    value_kN = trip.value
    second = stretch.second_kN[stretch.second_s >= stretch.time_s[-1] - SECOND_OLD_S]
    if value_kN is None or len(second) < 3:
        return None
    second_s = float(stretch.second_s[-1])
    second = stretch.second_kN[stretch.second_s >= second_s - SECOND_S]
    beside_kN = float(np.mean(second[-3:]))
    risen_kN = _may_rise_kN(guard, stretch, second_s, specimen_C)
    most_kN = APART_TIMES * max(float(second.max()) + risen_kN, 0.0) + APART_KN
    least_kN = min(float(second.min()), 0.0) - APART_KN
    if least_kN <= value_kN <= most_kN:
        return None
    expected_kN = _expected_kN(guard, stretch, specimen_C)
    turned = value_kN < least_kN and beside_kN > APART_KN
    if not turned and farther(value_kN, beside_kN, expected_kN) == "force_2":
        return None  # the second one is wrong, and the force may be what it reads
    ratio = value_kN / beside_kN if abs(beside_kN) > APART_KN / 2.0 else None
    leap = leap_of(guard, stretch)  # of one instant, where the second one may be some hundredths older
    look = likeness(ratio if leap is None or leap.ratio <= 0.0 else leap.ratio) if ratio else ""
    text = f"force reads {value_kN:+.1f} kN where force_2 reads {beside_kN:+.1f} kN of one transducer"
    if turned:
        text += ": its sign is turned"
    elif ratio is not None:
        text += f", {ratio:.2f} times as much" + (f" ({look})" if look else "")
    setting = channel_setting("force", "calibration")
    kind: Kind = "sign" if turned else "scale"
    return SignalDoubt(kind, "force", "controller", setting, text, value_kN, trip.limit, "kN")


def _may_rise_kN(  # noqa: N802 - the unit keeps its capital
    guard: WiringGuard, stretch: SampleStretch, since_s: float, specimen_C: float | None
) -> float:
    """Return how much the force may have risen since the second one was read.

    By the specimen's curve where that is known, else by the machine's stiffness: as of a rigid specimen.
    """
    way = stretch.values.get("position", stretch.told)
    lately = np.empty(0) if way is None else way[stretch.time_s >= since_s - CLOCKS_S]
    if not len(lately):
        return float("inf")
    gone_mm = float(np.ptp(lately))
    stroke_mm, curve = _stroke_mm(stretch), guard.curve
    if curve is not None and stroke_mm is not None and stroke_mm < curve.end_mm:
        before_kN, now_kN = (
            curve.at(max(at, 0.0), specimen_C)
            for at in (stroke_mm - gone_mm - PLACE_MM, stroke_mm + PLACE_MM)
        )
        return guard.factor * curve.fast * (now_kN - before_kN)
    return gone_mm * guard.stiffest_kN_per_mm


def _stroke_mm(stretch: SampleStretch) -> float | None:
    wires = [float(stretch.values[name][-1]) for name in stretch.wires]
    return sum(wires) / len(wires) if wires else None


def _expected_kN(  # noqa: N802 - the unit keeps its capital
    guard: WiringGuard, stretch: SampleStretch, specimen_C: float | None
) -> float | None:
    stroke_mm = _stroke_mm(stretch)
    return None if guard.curve is None or stroke_mm is None else guard.curve.at(stroke_mm, specimen_C)
