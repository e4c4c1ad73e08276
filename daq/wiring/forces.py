"""Both ways to the force against each other: sign, scale, zero and delay.

The two come on clocks of their own: the controller's is brought to the host's by the least delay of its
newest blocks, which leaves some 10 ms. What is allowed: the sum of both classes, a zero of each, and 35 ms.
Where they differ, the specimen's expected curve says which of them is wrong; without one both are named.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from daq.scaling import ScaledBlock
from daq.wiring.doubt import Doubt, Kind, channel_setting, stream_of
from daq.wiring.scene import Lasting, Scene
from foundation.holes import hole_from_s
from foundation.likeness import likeness

Floats = NDArray[np.float64]

GRID_S = 0.02
"""Both are compared on points of so long a time [s]."""
WINDOW_S, EVERY_S = 3.0, 0.1
"""Over so long, so often [s]."""
TAKEN_KN = 4.0
"""A force that changes by less in the window shows neither scale nor delay."""
APART_KN, UNCOUNTED_KN, APART_SHARE = 2.0, 3.5, 0.08
"""At rest both agree within this (their zeros; more where none was found), and this share."""
GAIN_OFF = 0.12
"""One over the other: 1 to within this."""
GAIN_KN = 8.0
"""… where the force changes by this in the window."""
FAST = 2.0
"""Delays are judged of stands that run no more than so many times as fast as the wall, by which an
amplifier's samples are stamped."""
FLAT = 0.03
"""One that changes by less than this share of the other stands still."""
JUMPED = 1.15
"""An offset while the force changes is that of a zero from so many times this on."""
UNLIKE_KN, UNLIKE_SHARE = 0.6, 0.03
"""A multiple leaves less than this of the other, and this share of the change."""
LATE_S = 0.035
"""The one may come so much later: wire and operating system of a serial amplifier take up to 20 ms."""
_LATE_S = np.concatenate([np.arange(0.01, 0.1, 0.01), np.arange(0.1, 1.21, 0.05)])
LAGS_S = np.concatenate([-_LATE_S[::-1], _LATE_S])
"""Delays that are tried, of force_2 behind force."""
LITTLE_KN, LITTLE_SHARE = 0.4, 0.01
"""What is left without a delay is none worth a search below this and this share of the change."""
BETTER = 0.4
"""The best of them leaves less than this of what no delay leaves."""
OFFSET_WINDOW = 50
"""The clocks are compared by the least delay of so many newest blocks."""
LOOKS, LONG_LOOKS = 3, 6
"""So many looks in a row must say it; more where the one is no multiple of the other."""
BEYOND = 1.05
"""A second force of more than so many times the stand's own limit is an amplifier at its end: no guard lets
the specimen see as much."""
TELLS_MM = 1.5
"""Before this stroke the expected curve does not tell which of both is right: a preload is met."""


class TwoForcesJudge:
    """Holds force and force_2 against each other."""

    def __init__(self) -> None:
        self._lasting, self._unlike = Lasting(LOOKS), Lasting(LONG_LOOKS)
        self._delays: deque[float] = deque(maxlen=OFFSET_WINDOW)
        self._first: deque[Floats] = deque()
        self._second: deque[Floats] = deque()
        self._due_s = -np.inf
        self.latest_kN: float | None = None
        """Newest value of force_2."""

    def take_first(self, block: ScaledBlock, delay_s: float, *, device_clock: bool) -> None:
        """Take a block of the controller."""
        if "force" not in block.values or not len(block):
            return
        offset_s = 0.0
        if device_clock:
            self._delays.append(block.received_s - float(block.time_us[-1]) * 1e-6)
            offset_s = min(self._delays)
        _keep(self._first, block, "force", offset_s - delay_s)

    def take_second(self, block: ScaledBlock, delay_s: float) -> None:
        """Take a block of the amplifier."""
        if "force_2" not in block.values or not len(block):
            return
        self.latest_kN = float(block.values["force_2"][-1])
        _keep(self._second, block, "force_2", -delay_s)

    def second(self, span_s: float) -> tuple[Floats, Floats]:
        """Return times on the controller's clock [s] and the second force [kN] of the last ``span_s``."""
        if not self._second:
            return np.empty(0), np.empty(0)
        time, value = _series(self._second)
        since = time >= time[-1] - span_s
        return time[since] - min(self._delays, default=0.0), value[since]

    def look(self, scene: Scene) -> Doubt | None:
        """Return what is wrong with one of the forces, None if nothing is."""
        if not self._first or not self._second:
            return None
        until_s = min(float(self._first[-1][0, -1]), float(self._second[-1][0, -1]))
        if until_s < self._due_s + EVERY_S * scene.guard.speed and until_s > self._due_s - 10.0:
            return None
        self._due_s = until_s
        one, two = _series(self._first), _series(self._second)
        time = np.arange(until_s - WINDOW_S, until_s, GRID_S)
        if max(one[0, 0], two[0, 0]) > time[-1] - 1.0:
            return None
        time = time[time >= max(one[0, 0], two[0, 0])]
        first = np.interp(time, *one)
        second = np.interp(time, *two)
        if _has_hole(one, time) or _has_hole(two, time):
            self._lasting.forget()
            self._unlike.forget()
            return None
        if float(np.max(np.abs(second))) > BEYOND * scene.guard.force_max_kN:
            return None  # saturated: its own watch says so, and the agreement with the first one has a guard
        return self._judge(scene, first, second, one, time)

    def _judge(  # noqa: PLR0911 - one return for each thing that can be wrong
        self, scene: Scene, first: Floats, second: Floats, one: Floats, time: Floats
    ) -> Doubt | None:
        zero_kN = APART_KN if scene.counted else UNCOUNTED_KN
        taken_kN = max(float(np.ptp(first)), float(np.ptp(second)))
        if taken_kN < TAKEN_KN:
            apart_kN = float(np.mean(second - first))
            most_kN = zero_kN + APART_SHARE * max(abs(float(np.mean(first))), abs(float(np.mean(second))))
            self._lasting.sure("moving", False)
            if not self._lasting.sure("still", abs(apart_kN) > most_kN):
                return None
            return self._zero(scene, float(np.mean(first)), float(np.mean(second)), most_kN)
        self._lasting.sure("still", False)
        lag_s, gain, left, left_now, apart_kN = _best(one, time, second, zero_kN)
        off = taken_kN > GAIN_KN and not (1.0 / (1.0 + GAIN_OFF) <= gain <= 1.0 + GAIN_OFF)
        late = abs(lag_s) > LATE_S and left < BETTER * left_now
        still = not FLAT < abs(gain) < 1.0 / FLAT
        blurred = left > UNLIKE_KN + UNLIKE_SHARE * taken_kN
        if scene.guard.speed > FAST:
            off, late = off and (still or not blurred), False
        jumped = not (off or late or blurred) and abs(apart_kN) > JUMPED * zero_kN
        unlike = off and (blurred or still)
        if _just_met(scene):
            return None
        sure = self._lasting.sure("moving", (off and not unlike) or late or jumped)
        if self._unlike.sure("moving", unlike):
            return self._scale(scene, gain, first, second, unlike=True)
        if not sure:
            return None
        if off:
            return self._scale(scene, gain, first, second, unlike=False)
        if late:
            return _late(lag_s, scene.guard.delays_s)
        return self._zero(scene, float(first[-1]), float(first[-1]) + apart_kN, zero_kN)

    def _zero(self, scene: Scene, first_kN: float, second_kN: float, most_kN: float) -> Doubt:
        stroke_mm = scene.stroke_mm()
        expected = _expected_kN(scene)
        free = stroke_mm is not None and scene.counted and stroke_mm < 0.5
        right_kN = 0.0 if free else expected
        name = _farther(first_kN, second_kN, right_kN)
        text = (
            f"force reads {first_kN:+.1f} kN and force_2 {second_kN:+.1f} kN of one transducer: "
            f"a zero is off by {abs(first_kN - second_kN):.1f} kN"
        )
        return _doubt("zero", name, "calibration", text, second_kN - first_kN, most_kN, "kN")

    def _scale(self, scene: Scene, gain: float, first: Floats, second: Floats, *, unlike: bool) -> Doubt:
        expected = _expected_kN(scene)
        name = _farther(float(first[-1]), float(second[-1]), expected, by_ratio=True)
        ratio = gain if name == "force_2" else 1.0 / gain if gain else float("inf")
        if not FLAT < abs(gain) < 1.0 / FLAT:
            still = "force_2" if abs(gain) <= FLAT else "force"
            other = "force" if still == "force_2" else "force_2"
            text = (
                f"{still} stands still while {other} changes by "
                f"{float(max(np.ptp(first), np.ptp(second))):.1f} kN"
            )
            return _doubt("still", still, "calibration", text, gain, None, "")
        if unlike:
            text = (
                f"{name} is no multiple of the other way to the same force: a delay or a low "
                "pass that is not "
                "stated, or another signal"
            )
            return _doubt("disagrees", name, "delay_s and calibration", text, ratio, 1.0 + GAIN_OFF, "")
        if gain < 0.0:
            wrong = "force_2" if float(np.mean(first)) > 0.0 else "force"
            text = f"{wrong} falls where the other way to the force rises: its sign is turned"
            return _doubt("sign", wrong, "calibration", text, gain, None, "")
        look = likeness(ratio)
        who = name if "," not in name else "force_2"
        text = f"{who} reads {ratio:.3f} times the other way to the same force" + (
            f", {look}" if look else ""
        )
        return _doubt("scale", name, "calibration", text, ratio, 1.0 + GAIN_OFF, "")


def _keep(track: deque[Floats], block: ScaledBlock, name: str, moved_s: float) -> None:
    time_s, value = block.time_us * 1e-6 + moved_s, block.values[name]
    parts = int(np.ceil(float(time_s[-1] - time_s[0]) / GRID_S))
    if 0 < parts < len(time_s):
        starts = np.linspace(0, len(time_s), parts, endpoint=False).astype(int)
        counts = np.diff(np.append(starts, len(time_s)))
        time_s, value = np.add.reduceat(time_s, starts) / counts, np.add.reduceat(value, starts) / counts
    if track and float(time_s[0]) <= float(track[-1][0, -1]) - 1.0:
        track.clear()  # its clock was set
    track.append(np.stack([time_s, value]))
    while float(track[0][0, -1]) < float(time_s[-1]) - WINDOW_S - 2.5:
        track.popleft()


def _series(track: deque[Floats]) -> Floats:
    """Return time and value of a track, shape (2, n); time does not fall."""
    whole = np.concatenate(track, axis=1)
    whole[0] = np.maximum.accumulate(whole[0])  # the clocks' offset may have become less
    return whole


def _has_hole(series: Floats, time: Floats) -> bool:
    """Return whether a track lacks samples within the times that are looked at [s]."""
    inside = series[0][(series[0] >= time[0]) & (series[0] <= time[-1])]
    if len(inside) < 3:
        return True
    steps = np.diff(np.concatenate(([time[0]], inside, [time[-1]])))
    return float(np.max(steps)) > hole_from_s(inside)


def _best(
    one: Floats, time: Floats, second: Floats, zero_kN: float
) -> tuple[float, float, float, float, float]:
    """Return delay and gain of force_2 behind force, the rms that they leave, and no delay does, and the
    offset.

    All in s and kN.

    The offset of both is held near 0 as a zero of a known size is: on an even ramp it would pass for a delay.
    Delays are tried only where none leaves more than noise.
    """
    weight = float(np.sqrt(len(time))) * 0.2 / zero_kN
    aim = np.append(second, 0.0)
    now = _fit(np.interp(time, *one), aim, weight)
    if now[0] < LITTLE_KN + LITTLE_SHARE * float(np.ptp(second)):
        return 0.0, now[1], now[0], now[0], now[2]
    tried = [(*_fit(np.interp(time - lag_s, *one), aim, weight), float(lag_s)) for lag_s in LAGS_S]
    left_kN, gain, offset_kN, lag_s = min(tried)
    if left_kN > BETTER * now[0]:  # no delay explains it: the gain is that without one
        return 0.0, now[1], now[0], now[0], now[2]
    return lag_s, gain, left_kN, now[0], offset_kN


def _fit(moved: Floats, aim: Floats, weight: float) -> tuple[float, float, float]:
    """Return the rms that a gain and an offset leave, the gain and the offset."""
    system = np.stack([np.append(moved, 0.0), np.append(np.ones(len(moved)), weight)], axis=1)
    solution = np.linalg.lstsq(system, aim, rcond=None)[0]
    return float(np.sqrt(np.mean((system @ solution - aim) ** 2))), float(solution[0]), float(solution[1])


def _expected_kN(scene: Scene) -> float | None:  # noqa: N802 - the unit keeps its capital
    stroke_mm, curve = scene.stroke_mm(), scene.guard.curve
    if curve is None or stroke_mm is None:
        return None
    return curve.at(stroke_mm, scene.specimen_C)


def _just_met(scene: Scene) -> bool:
    """Return whether the specimen is being met: how its preload comes about nobody says."""
    stroke_mm = scene.stroke_mm()
    way_mm = scene.now(scene.way) if scene.way is not None and scene.counted else None
    strokes = [one for one in (stroke_mm, way_mm) if one is not None]
    return scene.guard.curve is not None and bool(strokes) and max(strokes) < TELLS_MM


def _farther(first_kN: float, second_kN: float, right_kN: float | None, *, by_ratio: bool = False) -> str:
    """Return which force is farther from what is right; both where nothing says it."""
    if right_kN is None or (by_ratio and right_kN < 1.0):
        return "force, force_2"
    apart = [abs(first_kN - right_kN), abs(second_kN - right_kN)]
    if by_ratio:
        apart = [abs(np.log(max(abs(one), 1e-3) / right_kN)) for one in (first_kN, second_kN)]
    return "force" if apart[0] > apart[1] else "force_2"


def _late(lag_s: float, stated_s: Mapping[str, float]) -> Doubt:
    """Return the doubt of a delay: the later one is late, unless of the other too long a delay is stated."""
    name = "force_2" if lag_s > 0.0 else "force"
    other = "force" if name == "force_2" else "force_2"
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
) -> Doubt:
    first = sensor.split(", ", maxsplit=1)[0]
    setting = " or ".join(channel_setting(one, key) for one in sensor.split(", "))
    return Doubt(kind, sensor, stream_of(first), setting, text, value, limit, unit)
