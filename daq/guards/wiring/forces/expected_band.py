"""Compares the force with the one expected of the specimen at a stroke, and with zero before contact.

Upper side, all the time: no specimen gives more than its loading curve, times the factor, and what speed
adds. Lower side, on a first compression only: on the way back a specimen may give anything down to nothing.
Right specimens are up to 40 % softer or stiffer than their models, and begin some tenths of a millimetre
elsewhere; a small stroke shows little, so that nothing is judged before some millimetres.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.forces.force_jump import leapt
from bufferstand.daq.guards.wiring.recent_state import SLOW_MM_PER_S, RecentState, RepeatedFinding
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch, noise_of
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.foundation.numbers import likeness

FROM_MM, UNCOUNTED_MM = 2.5, 2.5
"""Judged from this stroke on; so much later where no contact was touched off."""
FIRST_MM, FIRST_SHARE, FIRST_TIMES, FIRST_KN = 8.0, 0.15, 1.6, 3.0
"""Up to this stroke, or share of the curve, it is judged with so much more of the factor, and this: what a
preload is, and how it is met, nobody knows well."""
PRESSED_MM = 1.0
"""Where strokes do not count from a contact, a draw wire that reads as much as it did at rest presses
nothing: before a touch it may be 10 mm off. So much more must be seen."""
PLACE_MM, UNCOUNTED_PLACE_MM = 0.6, 1.2
"""The curve may lie so far beside the stroke."""
BESIDE_KN = 1.0
"""What friction of the guides and zeros add."""
TURNED_MM, RISES_KN, RISES_SHARE = 0.8, 2.5, 0.02
"""A specimen that goes back by this pushes no more than at the turn: more force than that is a late one."""
LEAP_S, AT_ONCE = 0.025, 0.7
"""… unless so much of its rise comes within two points: that is a jump."""
TURN_WINDOW_S = 3.0
LEAPT_S = 0.6
"""A leap is looked for in so long a time: what comes before it shows how fast the piston went [s]."""
FAST_MM, FAST_S = 1.0, 0.02
"""While it moves fast stroke and force need not be of one instant: so much of the way, and this time of the
speed."""
PULLS_KN = 3.0
"""A buffer that is pressed does not pull: more of that in the first compression is a wrong sign."""
PULLED_SAMPLES = 3
SIGMAS = 6.0
REST_S = 0.2
"""Its level and its noise are those of so long from where it begins to be judged [s]."""
FREE_MM, FREE_KN = 0.4, 3.5
"""So far before first contact the force is none, to within this: its zero was set a moment ago."""
FREE_TOLD_S = 0.3
"""So long the piston must have been told to stay there, too [s]."""
TURNED_EARLY_MM = 1.0
"""A stroke of a little more than this that turns back by its force is judged once, as it does so."""
LOOKS, FREE_LOOKS = 3, 5


class ForceJudge:
    """Holds the force against the plan."""

    def __init__(self) -> None:
        self._lasting, self._freely = RepeatedFinding(LOOKS), RepeatedFinding(FREE_LOOKS)
        self._farthest_mm, self._least_mm = 0.0, np.inf
        self._pressed = False
        self._rest_until_s: float | None = None
        self._first: list[Floats] = []
        self._rest = 0.0, 0.0
        self._early: SignalDoubt | None = None

    @property
    def begun(self) -> bool:
        """Whether something has begun to look wrong, and more looks will tell."""
        return self._lasting.begun or self._freely.begun

    def pulls(self, block: ScaledBlock) -> SignalDoubt | None:
        """Return a doubt of the sign, at once: the guard of tension says that it pulls, which it does not."""
        force = block.values.get("force")
        if self._pressed or force is None or len(force) < PULLED_SAMPLES:
            return None
        level_kN, noise_kN = self._at_rest(block, force)
        most_kN = level_kN - PULLS_KN - SIGMAS * noise_kN  # a scale that is too large makes noise of none
        if float(force.min()) >= most_kN:
            return None
        least_kN = float(np.sort(force)[PULLED_SAMPLES - 1])
        if least_kN >= most_kN:
            return None
        text = f"force reads {least_kN:+.1f} kN as the piston first presses the specimen: its sign is turned"
        return _doubt("sign", text, least_kN, most_kN)

    def _at_rest(self, block: ScaledBlock, force: Floats) -> tuple[float, float]:
        """Return level, where that is below nothing, and noise of the force as judging begins [kN]."""
        if self._rest_until_s is None:
            self._rest_until_s = float(block.time_us[0]) * 1e-6 + REST_S
        if float(block.time_us[0]) * 1e-6 < self._rest_until_s or not self._first:
            self._first.append(force)
            seen = np.concatenate(self._first)
            self._rest = min(0.0, float(np.median(self._first[0]))), noise_of(seen)
        return self._rest

    def look(self, scene: RecentState) -> SignalDoubt | None:
        """Return what is wrong with the force, None if nothing is."""
        force_kN, way = scene.now("force"), scene.way
        if force_kN is None or way is None:
            return None
        low_mm, high_mm = _strokes(scene)
        self._pressed = self._pressed or force_kN > 2.0 * PULLS_KN
        if scene.counted and (doubt := self._free(scene, force_kN)) is not None:
            return doubt
        return (
            self._leaps(scene)
            or self._late(scene)
            or self._beside_curve(scene, force_kN, low_mm, high_mm)
            or self._turned_early(scene, force_kN, low_mm, high_mm)
        )

    def _turned_early(
        self, scene: RecentState, force_kN: float, low_mm: float, high_mm: float
    ) -> SignalDoubt | None:
        """Return a doubt where a stroke turns back before it is judged, by a force that is far too great.

        A force limit that a wrong scale reaches within millimetres ends the stroke as if it were complete.
        """
        curve, guard, speed = scene.guard.curve, scene.guard, scene.speed_mm_per_s(scene.way or "")
        if curve is None or curve.from_mm > 0.0 or low_mm < 0.5 * TURNED_EARLY_MM:
            self._early = None
            return None
        if speed < -0.2:
            early, self._early = self._early, None
            return early
        place_mm = PLACE_MM if scene.counted else UNCOUNTED_PLACE_MM + UNCOUNTED_MM
        usual_kN = curve.at(high_mm + place_mm, scene.specimen_C)
        most_kN = FIRST_TIMES * guard.factor * curve.fast * usual_kN + FIRST_KN
        slow = abs(speed) < SLOW_MM_PER_S and low_mm > TURNED_EARLY_MM
        if slow and force_kN > most_kN:
            text = (
                f"force reads {force_kN:.1f} kN at a stroke of {high_mm:.1f} mm, and the stroke turns back "
                f"there, where at most {usual_kN:.1f} kN are expected ({curve.source}); within a factor of "
                f"{FIRST_TIMES * guard.factor:.3g} (of [guards] force_against_model_factor) is right"
            )
            self._early = _doubt("scale", text, force_kN, most_kN)
        return None

    def _leaps(self, scene: RecentState) -> SignalDoubt | None:
        """Return a doubt where the force has leapt a moment ago by more than the machine lets it."""
        rows = scene.points.last(LEAPT_S)
        if len(rows) < 3:
            return None
        values = {name: rows[:, column] for column, name in enumerate(scene.points.names, start=1)}
        doubt = leapt(scene.guard, SampleStretch(rows[:, 0], values))
        return doubt if self._lasting.sure("leapt", doubt is not None) else None

    def _late(self, scene: RecentState) -> SignalDoubt | None:
        """Return a doubt where the force still rises after the specimen has turned back."""
        rows, force = scene.points.last(TURN_WINDOW_S), scene.points.column("force")
        wires = [column for name in scene.points.wires if (column := scene.points.column(name)) is not None]
        way = scene.points.column(scene.way or "")
        if force is None or way is None or len(rows) < 20:
            return None
        stroke = rows[:, wires].mean(axis=1) if wires else rows[:, way]
        turn = int(np.argmax(stroke))
        new = scene.points.new
        gone = float(np.mean(stroke[-new:])) < float(stroke[turn]) - TURNED_MM and turn > 10
        turned = gone and float(np.mean(rows[-new:, way])) < float(rows[turn, way]) - 0.5 * TURNED_MM
        at_kN = float(np.max(rows[max(0, turn - 3) : turn + 4, force]))
        now_kN = float(np.mean(rows[-new:, force]))
        most_kN = at_kN + RISES_KN + RISES_SHARE * abs(at_kN)
        if not self._lasting.sure("late", turned and now_kN > most_kN):
            return None
        if (jumped := _jumped_at_once(rows[turn:, 0], rows[turn:, force])) is not None:
            return jumped
        late_s = float(rows[-1, 0] - rows[turn, 0])
        text = (
            f"force still rises {late_s:.2f} s after the specimen has turned back ({at_kN:.1f} "
            "kN at the turn, "
            f"{now_kN:.1f} kN now): it is late"
        )
        return replace(
            _doubt("delay", text, late_s, 0.0), setting=channel_setting("force", "delay_s"), unit="s"
        )

    def _free(self, scene: RecentState, force_kN: float) -> SignalDoubt | None:
        """Return a doubt where a force is read before first contact, and nothing is there to make it."""
        position_mm = scene.now("position")
        speed = 0.0 if scene.way is None else scene.speed_mm_per_s(scene.way)
        still = abs(speed) < 20.0
        told = scene.points.last(FREE_TOLD_S), scene.points.column("command")
        if told[1] is not None and len(told[0]):  # a position that is late is still there
            still = still and float(np.max(told[0][:, told[1]])) < -0.5 * FREE_MM
        free = position_mm is not None and position_mm < -FREE_MM and still and self._farthest_mm < 1.0
        if not self._freely.sure("free", free and abs(force_kN) > FREE_KN):
            return None
        text = (
            f"force reads {force_kN:+.1f} kN while the piston stands {-(position_mm or 0.0):.1f} "
            "mm before first "
            "contact: its zero is off, or has changed since it was found"
        )
        return _doubt("zero", text, force_kN, FREE_KN)

    def _beside_curve(
        self, scene: RecentState, force_kN: float, low_mm: float, high_mm: float
    ) -> SignalDoubt | None:
        curve, guard = scene.guard.curve, scene.guard
        speed = scene.speed_mm_per_s(scene.way or "")
        first = low_mm > self._farthest_mm - 0.3 and 0.2 < speed < SLOW_MM_PER_S
        self._farthest_mm = max(self._farthest_mm, low_mm)
        self._least_mm = min(self._least_mm, low_mm)
        first = first and (scene.counted or low_mm > self._least_mm + PRESSED_MM)
        if curve is None:
            return None
        from_mm = max(curve.from_mm, FROM_MM + (0.0 if scene.counted else UNCOUNTED_MM))
        if low_mm < from_mm or high_mm > curve.end_mm:
            self._lasting.sure("above", False)
            self._lasting.sure("below", False)
            return None
        place_mm = PLACE_MM if scene.counted else UNCOUNTED_PLACE_MM
        warm_C = scene.specimen_C
        beyond_mm = place_mm if abs(speed) < SLOW_MM_PER_S else place_mm + FAST_MM + FAST_S * abs(speed)
        fast = 1.0 if abs(speed) < SLOW_MM_PER_S else curve.fast
        begins = high_mm < min(FIRST_MM, FIRST_SHARE * curve.end_mm) + (
            0.0 if scene.counted else UNCOUNTED_MM
        )
        factor, beside_kN = guard.factor, BESIDE_KN
        if begins:
            factor, beside_kN = FIRST_TIMES * factor, FIRST_KN
        most_kN = factor * fast * curve.at(high_mm + beyond_mm, warm_C) + beside_kN
        least_kN = curve.at(low_mm - place_mm, warm_C) / factor - beside_kN
        usual_kN = curve.at(0.5 * (low_mm + high_mm), warm_C)
        above = self._lasting.sure("above", force_kN > most_kN)
        below = self._lasting.sure("below", first and force_kN < least_kN)
        if not (above or below):
            return None
        ratio = force_kN / usual_kN if usual_kN > 0.0 else 0.0
        look = likeness(ratio)
        text = (
            f"force reads {force_kN:.1f} kN at a stroke of {0.5 * (low_mm + high_mm):.1f} mm, where "
            f"{usual_kN:.1f} kN are expected ({curve.source}), {ratio:.2f} times as much"
            + (f" ({look})" if look else "")
            + f"; within a factor of {factor:.3g} ([guards] force_against_model_factor) is right. "
            + "Is it the specimen that the campaign names?"
        )
        kind: Kind = "sign" if ratio < -0.3 else "still" if abs(ratio) < 0.03 else "scale"
        return _doubt(kind, text, force_kN, most_kN if above else least_kN)


def _jumped_at_once(time: Floats, force: Floats) -> SignalDoubt | None:
    """Return a doubt of a force that has jumped up since a turn: one that is late rises little by little."""
    before = np.searchsorted(time, time - LEAP_S)
    steps = force - force[before]
    end = int(np.argmax(steps))
    from_kN, to_kN = float(force[before[end]]), float(force[end])
    if float(steps[end]) < AT_ONCE * (to_kN - float(force.min())):
        return None
    look = likeness(to_kN / from_kN) if from_kN > BESIDE_KN else ""
    text = (
        f"force jumps from {from_kN:+.1f} to {to_kN:+.1f} kN within {time[end] - time[before[end]]:.2f} s as "
        "the specimen goes back: its scale, zero or wire has changed" + (f" ({look})" if look else "")
    )
    return _doubt("scale" if look else "disagrees", text, to_kN - from_kN, RISES_KN)


def _strokes(scene: RecentState) -> tuple[float, float]:
    """Return the least and the greatest stroke that wires and piston allow now [mm]: one of them may be
    wrong.

    Where strokes do not count from a contact, the piston's zero is nobody's: the wires alone say it.
    """
    wires = [value for name in scene.points.wires if (value := scene.now(name)) is not None]
    strokes = [sum(wires) / len(wires)] if wires else []
    way_mm = None if scene.way is None else scene.now(scene.way)
    if way_mm is not None and (scene.counted or not strokes):
        force_kN = scene.guard.believable_kN(scene.now("force") or 0.0, way_mm, scene.specimen_C)
        _, most_mm = scene.guard.given_way_mm(force_kN)
        strokes += [way_mm - most_mm, way_mm]
    return (min(strokes), max(strokes)) if strokes else (0.0, 0.0)


def _doubt(kind: Kind, text: str, value: float, limit: float) -> SignalDoubt:
    setting = channel_setting("force", "calibration")
    return SignalDoubt(kind, "force", "controller", setting, text, value, limit, "kN")
