"""Compares the two force channels: sign, scale, zero and delay.

The two come on clocks of their own: the controller's is brought to the host's by its quickest
blocks, which leaves some 10 ms. What is allowed: the sum of both classes, a zero of each, and 35 ms.
Where they differ, :mod:`bufferstand.daq.guards.wiring.forces.jumped_channel` says which of them is wrong;
where it cannot both are named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards.wiring.clock_offset import ClockOffset
from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting, stream_of
from bufferstand.daq.guards.wiring.forces.jumped_channel import (
    ChannelJump,
    ChannelStandstill,
    farther,
    fresh_jump,
    jump,
    made_by_delay,
    standstill,
)
from bufferstand.daq.guards.wiring.forces.rests import Rests
from bufferstand.daq.guards.wiring.forces.track import ForceMeans, ForceTrack, common_instants, has_hole
from bufferstand.daq.guards.wiring.forces.zero_difference import (
    APART_KN,
    APART_SHARE,
    UNCOUNTED_KN,
    may_differ_kN,
)
from bufferstand.daq.guards.wiring.recent_state import RecentState, RepeatedFinding
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.foundation import DELAYS_TO_SPEED
from bufferstand.foundation.numbers import likeness

Floats = NDArray[np.float64]

WINDOW_S, EVERY_S = 3.0, 0.1
"""Over so long, so often [s]."""
LEAST_WINDOW_S, LEAST_POINTS = 1.0, 10
"""… and over no less than this, with so many instants."""
TAKEN_KN = 4.0
"""A force that changes by less in the window shows neither scale nor delay."""
GAIN_OFF = 0.12
"""One over the other: 1 to within this."""
GAIN_KN = 8.0
"""… where the force changes by this in the window."""
FLAT = 0.03
"""One that changes by less than this share of the other stands still."""
JUMPED = 1.15
"""An offset while the force changes is that of a zero from so many times this on, if no delay up to
:data:`LATE_S` makes it less: on an even ramp one that comes later reads less, by its delay times the rise."""
UNLIKE_KN, UNLIKE_SHARE = 0.6, 0.03
"""A multiple leaves less than this of the other, and this share of the change."""
LATE_S = 0.035
"""The one may come so much later: wire and operating system of a serial amplifier take up to 20 ms."""
ALLOWED_S = np.arange(-LATE_S, LATE_S + 1e-9, 0.005)
"""Delays that are no doubt, of force_2 behind force: they explain an offset."""
_LATE_S = np.concatenate([np.arange(0.01, 0.1, 0.01), np.arange(0.1, 1.21, 0.05)])
LAGS_S = np.concatenate([-_LATE_S[::-1], _LATE_S])
"""Delays that are tried, of force_2 behind force."""
LITTLE_KN, LITTLE_SHARE = 0.4, 0.01
"""What is left without a delay is none worth a search below this and this share of the change."""
BETTER = 0.4
"""The best of them leaves less than this of what no delay leaves."""
SOMEWHAT = 0.85
"""… or this, where it explains little: then it says which of both is later."""
FIRST_MM = 0.5
"""The curve tells of the first compression, to within this."""
FREE_MM = 0.5
"""The piston being so far before first contact, no force is expected."""
AMPLIFIER = "[amplifier] port and protocol"
"""Where to look if it hangs."""
LOOKS, LONG_LOOKS = 3, 6
"""So many looks in a row must say it; more where the one is no multiple of the other."""
BEYOND = 1.05
"""A second force of more than so many times the stand's own limit is an amplifier at its end: no guard lets
the specimen see as much."""
TELLS_MM = 1.5
"""Before this stroke the expected curve does not tell which of both is right: a preload is met."""


class TwoForcesJudge:
    """Holds force and force_2 against each other.

    Parameters
    ----------
    clock : ClockOffset
        What is known of the controller's clock: it goes on where the judge begins anew.
    """

    def __init__(self, clock: ClockOffset) -> None:
        self._lasting, self._unlike = RepeatedFinding(LOOKS), RepeatedFinding(LONG_LOOKS)
        self._clock = clock
        self._first, self._second = ForceTrack("force"), ForceTrack("force_2")
        self._rests = Rests()
        self._due_s = -np.inf
        self._farthest_mm = 0.0
        self._counted = False
        self.latest_kN: float | None = None
        """Newest value of force_2."""

    @property
    def begun(self) -> bool:
        """Whether something has begun to look wrong, and more looks will tell: both differ now."""
        if not self._first or not self._second:
            return False
        now_kN = self._first.newest_kN, self._second.newest_kN
        apart = abs(now_kN[0] - now_kN[1]) > may_differ_kN(*now_kN, counted=self._counted)
        return apart or self._lasting.begun or self._unlike.begun

    def take_first(self, block: ScaledBlock, delay_s: float, *, device_clock: bool) -> None:
        """Take a block of the controller."""
        if "force" not in block.values or not len(block):
            return
        offset_s = 0.0
        if device_clock:
            offset_s = self._clock.take(block.received_s, float(block.time_us[-1]) * 1e-6)
        self._first.take(block, offset_s - delay_s)

    def take_second(self, block: ScaledBlock, delay_s: float) -> None:
        """Take a block of the amplifier."""
        if "force_2" not in block.values or not len(block):
            return
        self.latest_kN = float(block.values["force_2"][-1])
        self._second.take(block, -delay_s)

    def second(self, span_s: float) -> tuple[Floats, Floats]:
        """Return times on the controller's clock [s] and the second force [kN] of the last ``span_s``."""
        if not self._second:
            return np.empty(0), np.empty(0)
        time, value = self._second.samples()
        since = time >= time[-1] - span_s
        return time[since] - self._clock.value_s, value[since]

    def look(  # noqa: PLR0911 - one return for each thing that can be wrong, or that keeps from a look
        self, scene: RecentState
    ) -> SignalDoubt | None:
        """Return what is wrong with one of the forces, None if nothing is."""
        self._counted = scene.counted
        if not self._first or not self._second:
            return None
        until_s = min(self._first.newest_s, self._second.newest_s)
        if scene.guard.speed > DELAYS_TO_SPEED and (doubt := self._at_rest(scene, until_s)):
            return doubt
        if until_s < self._due_s + EVERY_S * scene.guard.speed and until_s > self._due_s - 10.0:
            return None
        self._due_s = until_s
        most_kN = BEYOND * scene.guard.force_max_kN
        if self.latest_kN is not None and abs(self.latest_kN) > most_kN:
            return None  # saturated: its own watch says so, and the agreement with the first one has a guard
        if stood := standstill(self._second, self._first, ("force_2", "force")):
            return _stands(stood)
        pair = self._pair(until_s)
        if pair is None or float(np.max(np.abs(pair.second))) > most_kN:
            return None  # as it was just now
        return self._just_jumped(scene, pair) or self._judge(scene, pair)

    def _at_rest(self, scene: RecentState, until_s: float) -> SignalDoubt | None:
        """Return what both show while the force stands: that needs no instants that are the same to 10 ms."""
        if (rest := self._rests.look(self._first, self._second, until_s)) is None:
            return None
        most_kN = BEYOND * scene.guard.force_max_kN
        if max(abs(rest.first_kN), abs(rest.second_kN)) > most_kN:
            return None  # saturated, as in look
        least_kN = may_differ_kN(rest.first_kN, rest.second_kN, counted=scene.counted)
        parted = self._rests.parted(rest, JUMPED * APART_KN, APART_SHARE)
        apart = abs(rest.second_kN - rest.first_kN) > least_kN
        if parted is None and not apart:
            return None
        if stood := self._stood():
            return _stands(stood)
        if parted is not None:
            return _jumped(parted, at_once=False)
        return _zero(scene, rest.first_kN, rest.second_kN, least_kN, self._expected_kN(scene))

    def _stood(self) -> ChannelStandstill | None:
        """Return which of both stands still, where something else says that they part."""
        stood = standstill(self._second, self._first, ("force_2", "force"), sure=False)
        return stood or standstill(self._first, self._second, ("force", "force_2"), sure=False)

    def _pair(self, until_s: float) -> _Pair | None:
        """Return both forces at common instants of the window; None where a hole hides what they do."""
        one, two = self._first.samples(), self._second.samples()
        begin_s = max(until_s - WINDOW_S, float(one[0, 0]), float(two[0, 0]))
        if until_s - begin_s < LEAST_WINDOW_S:
            return None
        if has_hole(one, begin_s, until_s) or has_hole(two, begin_s, until_s):
            self._lasting.forget()
            self._unlike.forget()
            return None
        time, width_s = common_instants(one, two, begin_s, until_s)
        if len(time) < LEAST_POINTS:
            return None
        means = ForceMeans(one, width_s)
        return _Pair(time, means.at(time), ForceMeans(two, width_s).at(time), means)

    def _just_jumped(self, scene: RecentState, pair: _Pair) -> SignalDoubt | None:
        """Return a doubt of the force that has left the other one at once a moment ago."""
        if scene.guard.speed > DELAYS_TO_SPEED:
            return None
        least_kN = JUMPED * (APART_KN if scene.counted else UNCOUNTED_KN)
        broke = fresh_jump(self._first, self._second, pair.time_s, pair.first, pair.second, least_kN=least_kN)
        if broke is not None and made_by_delay(broke, pair.means, pair.time_s, pair.second, ALLOWED_S):
            broke = None
        sure = self._lasting.sure("broke", broke is not None)
        return _jumped(broke) if sure and broke is not None else None

    def _judge(  # noqa: PLR0911 - one return for each thing that can be wrong
        self, scene: RecentState, pair: _Pair
    ) -> SignalDoubt | None:
        """Return what both forces say of each other over a window; None if nothing."""
        first, second = pair.first, pair.second
        expected_kN = self._expected_kN(scene)
        zero_kN = APART_KN if scene.counted else UNCOUNTED_KN
        taken_kN = max(float(np.ptp(first)), float(np.ptp(second)))
        if taken_kN < TAKEN_KN:
            means = float(np.mean(first)), float(np.mean(second))
            most_kN = may_differ_kN(*means, counted=scene.counted)
            self._lasting.sure("moving", False)
            if not self._lasting.sure("still", abs(means[1] - means[0]) > most_kN):
                return None
            return self._left(scene, pair, flat=False) or _zero(scene, *means, most_kN, expected_kN)
        self._lasting.sure("still", False)
        fit = _best(pair, zero_kN)
        off = taken_kN > GAIN_KN and not (1.0 / (1.0 + GAIN_OFF) <= fit.gain <= 1.0 + GAIN_OFF)
        late = abs(fit.lag_s) > LATE_S and fit.left_kN < BETTER * fit.now_kN
        still = not FLAT < abs(fit.gain) < 1.0 / FLAT
        blurred = fit.left_kN > UNLIKE_KN + UNLIKE_SHARE * taken_kN
        fast = scene.guard.speed > DELAYS_TO_SPEED
        if fast:
            off, late = off and (still or not blurred), False
        # A fast stand's stamps are off by more than an offset would tell in motion: it is told at rest.
        jumped = not (off or late or blurred or fast) and _offset(pair, fit, zero_kN) > JUMPED * zero_kN
        unlike = off and (blurred or still)
        if self._just_met(scene):
            return None
        sure = self._lasting.sure("moving", (off and not unlike) or late or jumped)
        unlike = self._unlike.sure("moving", unlike)
        if not (sure or unlike):
            return None
        if left := self._left(scene, pair, flat=still):
            return left
        if off:
            return _scale(fit, first, second, expected_kN, unlike=unlike)
        if late:
            return _late(fit.lag_s, scene.guard.delays_s)
        return _zero(scene, float(first[-1]), float(first[-1]) + fit.offset_kN, zero_kN, expected_kN)

    def _left(self, scene: RecentState, pair: _Pair, *, flat: bool) -> SignalDoubt | None:
        """Return a doubt of the force that left the other one before the eyes; None if none was seen to.

        Beside one that is ``flat`` the other one jumps where the specimen's preload is met.
        """
        if stood := self._stood():
            return _stands(stood)
        if flat or scene.guard.speed > DELAYS_TO_SPEED:
            return None  # an amplifier's samples are stamped by the wall: a step of both is none of one
        broke = jump(self._first, self._second, pair.time_s, pair.first, pair.second)
        return None if broke is None else _jumped(broke)

    def _expected_kN(self, scene: RecentState) -> float | None:  # noqa: N802 - the unit keeps its capital
        """Return the force that the specimen's curve tells: while it is first pressed, and not before 1.5 mm.

        On the way back a specimen may give anything down to nothing.
        """
        stroke_mm, curve = scene.stroke_mm(), scene.guard.curve
        if stroke_mm is None:
            return None
        first = stroke_mm > self._farthest_mm - FIRST_MM and scene.speed_mm_per_s(scene.way or "") > 0.2
        self._farthest_mm = max(self._farthest_mm, stroke_mm)
        return None if curve is None or not first else curve.at(stroke_mm, scene.specimen_C)

    def _just_met(self, scene: RecentState) -> bool:
        """Return whether the specimen is being met: how its preload comes about nobody says."""
        stroke_mm = scene.stroke_mm()
        way_mm = scene.now(scene.way) if scene.way is not None and scene.counted else None
        strokes = [one for one in (stroke_mm, way_mm) if one is not None]
        met = scene.guard.curve is not None and bool(strokes) and max(strokes) < TELLS_MM
        return met and self._farthest_mm < TELLS_MM


def _zero(
    scene: RecentState, first_kN: float, second_kN: float, most_kN: float, expected_kN: float | None
) -> SignalDoubt:
    position_mm = scene.now("position")
    if position_mm is not None and scene.counted and position_mm < -FREE_MM:
        name = "force" if abs(first_kN) > abs(second_kN) else "force_2"
    else:
        name = farther(first_kN, second_kN, expected_kN)
    text = (
        f"force reads {first_kN:+.1f} kN and force_2 {second_kN:+.1f} kN of one transducer: "
        f"a zero is off by {abs(first_kN - second_kN):.1f} kN"
    )
    return _doubt("zero", name, "calibration", text, second_kN - first_kN, most_kN, "kN")


def _scale(
    fit: _Fit, first: Floats, second: Floats, expected_kN: float | None, *, unlike: bool
) -> SignalDoubt:
    gain = fit.gain
    name = farther(float(first[-1]), float(second[-1]), expected_kN)
    if not FLAT < abs(gain) < 1.0 / FLAT:
        still = "force_2" if abs(gain) <= FLAT else "force"
        other = _other(still)
        text = (
            f"{still} stands still while {other} changes by "
            f"{float(max(np.ptp(first), np.ptp(second))):.1f} kN"
        )
        return _doubt("still", still, "calibration", text, gain, None, "")
    if unlike:
        if fit.later_s:  # nothing measures before it happens
            name = "force_2" if fit.later_s > 0.0 else "force"
        who = "one of both ways to the same force" if "," in name else name
        text = (
            f"{who} is no multiple of the other way to the same force: a delay or a low pass that is not "
            "stated, or another signal"
        )
        return _doubt("disagrees", name, "delay_s and calibration", text, gain, 1.0 + GAIN_OFF, "")
    if gain < 0.0:
        wrong = "force_2" if float(np.mean(first)) > 0.0 else "force"
        text = f"{wrong} falls where the other way to the force rises: its sign is turned"
        return _doubt("sign", wrong, "calibration", text, gain, None, "")
    ratio = 1.0 / gain if name == "force" else gain
    look = likeness(ratio)
    reader = name if "," not in name else "force_2"
    text = f"{reader} reads {ratio:.3f} times the other way to the same force" + (f", {look}" if look else "")
    return _doubt("scale", name, "calibration", text, ratio, 1.0 + GAIN_OFF, "")


def _other(name: str) -> str:
    """Return the other way to the same force."""
    return "force" if name == "force_2" else "force_2"


def _stands(stood: ChannelStandstill) -> SignalDoubt:
    other = _other(stood.name)
    text = (
        f"{stood.name} has shown one value to the last digit for {stood.for_s:.1f} s while {other} changed "
        f"by {stood.other_kN:.1f} kN: it is frozen; look at its amplifier's cable and supply"
    )
    doubt = _doubt("still", stood.name, "calibration", text, stood.other_kN, None, "kN")
    return doubt if stood.name == "force" else replace(doubt, setting=AMPLIFIER)


def _jumped(broke: ChannelJump, *, at_once: bool = True) -> SignalDoubt:
    other = _other(broke.name)
    to_kN = broke.from_kN + broke.size_kN
    ratio = to_kN / broke.from_kN if abs(broke.from_kN) > abs(broke.size_kN) else 0.0
    look = likeness(ratio) if ratio else ""
    text = (
        f"{broke.name} jumped by {broke.size_kN:+.1f} kN{' at once' if at_once else ''}, from "
        f"{broke.from_kN:.1f} kN, and {other} did not: its zero or its scale has changed"
        + (f" ({look})" if look else "")
    )
    kind: Kind = "scale" if look else "zero"
    return _doubt(kind, broke.name, "calibration", text, broke.size_kN, APART_KN, "kN")


@dataclass(frozen=True)
class _Pair:
    """Both forces at common instants, and the first one at any."""

    time_s: Floats
    first: Floats
    second: Floats
    means: ForceMeans


@dataclass(frozen=True)
class _Fit:
    """How force_2 follows force: delay [s], gain, what these leave, and what no delay leaves, offset [kN].

    ``later_s`` is the delay that fits best, whether it explains anything or not; 0 where none is better.
    """

    lag_s: float
    gain: float
    left_kN: float
    now_kN: float
    offset_kN: float
    later_s: float = 0.0


def _best(pair: _Pair, zero_kN: float) -> _Fit:
    """Return how force_2 follows force.

    The offset of both is held near 0 as a zero of a known size is: on an even ramp it would pass for a delay.
    Delays are tried only where none leaves more than noise.
    """
    weight = _weight(pair, zero_kN)
    aim = np.append(pair.second, 0.0)
    now_kN, gain, offset_kN = _fit(pair.first, aim, weight)
    now = _Fit(0.0, gain, now_kN, now_kN, offset_kN)
    if now_kN < LITTLE_KN + LITTLE_SHARE * float(np.ptp(pair.second)):
        return now
    tried = [(*_fit(pair.means.at(pair.time_s - lag_s), aim, weight), float(lag_s)) for lag_s in LAGS_S]
    left_kN, gain, offset_kN, lag_s = min(tried)
    if left_kN > BETTER * now_kN:  # no delay explains it: the gain is that without one
        return replace(now, later_s=lag_s if left_kN < SOMEWHAT * now_kN else 0.0)
    return _Fit(lag_s, gain, left_kN, now_kN, offset_kN, lag_s)


def _offset(pair: _Pair, fit: _Fit, zero_kN: float) -> float:
    """Return the least size of the offset [kN] that a delay within :data:`LATE_S` leaves of that of a fit.

    Only a delay counts that fits no worse: behind a turn, or at rest, none takes the place of a zero.
    """
    least_kN = abs(fit.offset_kN)
    time = pair.time_s
    inside = (time > time[0] + LATE_S) & (time < time[-1] - LATE_S)  # there both have samples
    if least_kN <= JUMPED * zero_kN or np.count_nonzero(inside) < LEAST_POINTS:
        return least_kN
    time, aim, weight = time[inside], np.append(pair.second[inside], 0.0), _weight(pair, zero_kN)
    now_kN = _fit(pair.first[inside], aim, weight)[0]
    for lag_s in ALLOWED_S:
        left_kN, _, offset_kN = _fit(pair.means.at(time - lag_s), aim, weight)
        if left_kN <= now_kN:
            least_kN = min(least_kN, abs(offset_kN))
    return least_kN


def _weight(pair: _Pair, zero_kN: float) -> float:
    return float(np.sqrt(len(pair.time_s))) * 0.2 / zero_kN


def _fit(moved: Floats, aim: Floats, weight: float) -> tuple[float, float, float]:
    """Return the rms that a gain and an offset leave, the gain and the offset."""
    system = np.stack([np.append(moved, 0.0), np.append(np.ones(len(moved)), weight)], axis=1)
    solution = np.linalg.lstsq(system, aim, rcond=None)[0]
    return float(np.sqrt(np.mean((system @ solution - aim) ** 2))), float(solution[0]), float(solution[1])


def _late(lag_s: float, stated_s: Mapping[str, float]) -> SignalDoubt:
    """Return the doubt of a delay: the later one is late, unless of the other too long a delay is stated."""
    name = "force_2" if lag_s > 0.0 else "force"
    other = _other(name)
    if stated_s.get(other, 0.0) > 0.5 * abs(lag_s):
        text = (
            f"{other} comes {abs(lag_s) * 1e3:.0f} ms before {name}, less the delay of "
            f"{stated_s[other] * 1e3:.0f} ms that is stated of it: that is too long"
        )
        return _doubt("delay", other, "delay_s", text, abs(lag_s), LATE_S, "s")
    text = (
        f"{name} comes {abs(lag_s) * 1e3:.0f} ms later than {other} (a delay or a low pass that is "
        "not stated)"
    )
    return _doubt("delay", name, "delay_s", text, abs(lag_s), LATE_S, "s")


def _doubt(
    kind: Kind, sensor: str, key: str, text: str, value: float | None, limit: float | None, unit: str
) -> SignalDoubt:
    first = sensor.split(", ", maxsplit=1)[0]
    setting = " or ".join(channel_setting(one, key) for one in sensor.split(", "))
    return SignalDoubt(kind, sensor, stream_of(first), setting, text, value, limit, unit)
