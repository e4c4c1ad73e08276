"""Compares thermometers with the heat: those on the specimen show it, others do not.

What a specimen absorbs is on record: ∫ F ds. At every instant it is at least that less F · s, for a spring
stores no more than force times stroke. From that a least temperature follows that a sensor on the specimen
must come to: twice the stated heat capacity, three times the stated lag (120 s at least), and cooling several
times as quick as a buffer's. A quarter of that rise must be seen, once it is more than a kelvin.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt
from bufferstand.daq.guards.wiring.sample_points import SamplePoints
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.daq.guards.wiring.temperatures.stopped_sensor import (
    HeatAtReading,
    StoppedReading,
    StoppedSensor,
)
from bufferstand.daq.scaling import ScaledBlock

CAPACITY_TIMES, LAG_TIMES, LEAST_LAG_S = 2.0, 3.0, 120.0
UNKNOWN_J_PER_K = 100_000.0
"""Heat capacity of a specimen of which nobody states it: that of 200 kg of steel."""
COOLS_S = 600.0
"""No specimen cools with a shorter time constant: a buffer's is half an hour [s]."""
AIR_K = (2.0, 5.0)
"""The air may be colder by this than where it was measured at first, and than where it was only planned."""
SHOWS_K, SHOWN = 1.2, 0.25
"""From such a least rise on, this share of it must be seen."""
FALL_S, FALL_K, FALL_SHARE = 20.0, 0.8, 0.06
"""In so long a sensor on a specimen falls by no more than this and this share of its excess over the air."""
DROP_S, DROP_K = 5.0, 1.5
"""Nor by this in that: half of what it does in a minute in still air."""
ROOM_S, ROOM_K, ROOM_SHARE = 900.0, 1.5, 0.4
"""In so long the air warms by less than this, and by less than this share of the specimen's rise."""
COLDER_K = 5.0
"""A specimen that is colder than the air by this has come from a colder place: is that so?"""
READINGS = 3
"""The first readings are taken for one; and so many in a row must say a fall."""
_STEP_S = 1.0


@dataclass
class _Sensor:
    """What one thermometer has shown."""

    begun: list[float] = field(default_factory=list)
    kept: deque[tuple[float, float]] = field(default_factory=deque)
    falls: int = 0
    least_K: float = 0.0
    """The rise that it must have come to, with its lag."""
    excess_C: float | None = None
    """By how much it was above the air at first."""
    began_s: float = 0.0
    asked: bool = False
    stopped: StoppedSensor = field(default_factory=StoppedSensor)

    @property
    def first_C(self) -> float | None:  # noqa: N802 - the unit keeps its capital
        return sum(self.begun) / len(self.begun) if len(self.begun) >= READINGS else None

    @property
    def now_C(self) -> float:  # noqa: N802
        return self.kept[-1][1]


class HeatJudge:
    """Holds thermometers against the energy that the specimen has absorbed, and against each other."""

    def __init__(self) -> None:
        self._sensors: dict[str, _Sensor] = {}
        self._last: tuple[float, float] | None = None
        self._work_J = 0.0
        self._absorbed_J = 0.0
        self._taken_J = 0.0
        self._body_K = 0.0
        self._body_s: float | None = None
        self._rises: deque[tuple[float, float]] = deque()

    # --- heat ---------------------------------------------------------------------------------------

    def work(self, points: SamplePoints) -> None:
        """Add the work of the newest points."""
        force = points.column("force")
        wires = [column for name in points.wires if (column := points.column(name)) is not None]
        wires = wires or [column for name in ("position",) if (column := points.column(name)) is not None]
        if force is None or not wires:
            return
        rows = points.table[-points.new :]
        kN, mm = rows[:, force], rows[:, wires].mean(axis=1)
        if self._last is not None:
            kN, mm = np.append(self._last[0], kN), np.append(self._last[1], mm)
        self._work_J += 0.5 * float(np.dot(kN[1:] + kN[:-1], mm[1:] - mm[:-1]))
        self._last = float(kN[-1]), float(mm[-1])
        stored_J = max(0.0, float(kN[-1])) * max(0.0, float(mm[-1]))
        self._absorbed_J = max(self._absorbed_J, self._work_J - stored_J)

    def rebase(self) -> None:
        """Go on from another zero: no work is done by that."""
        self._last = None

    # --- readings -----------------------------------------------------------------------------------

    def take(self, guard: WiringGuard, block: ScaledBlock, true_C: float | None) -> SignalDoubt | None:
        """Take a reading of a thermometer; return what is wrong with it, None if nothing is.

        Parameters
        ----------
        guard : WiringGuard
        block : ScaledBlock
            Of one thermometer.
        true_C : float or None
            Its last reading that was believed; another one is left out.
        """
        values = block.values.get(block.stream)
        if values is None or not len(values) or float(values[-1]) != true_C:
            return None
        at_s, reading_C = float(block.time_us[-1]) * 1e-6, float(values[-1])
        sensor = self._sensors.setdefault(block.stream, _Sensor())
        if sensor.kept and at_s <= sensor.kept[-1][0]:
            return None
        if len(sensor.begun) < READINGS:
            sensor.begun.append(reading_C)
            sensor.began_s = at_s
        before_s = sensor.kept[-1][0] if sensor.kept else at_s
        sensor.kept.append((at_s, reading_C))
        while sensor.kept[0][0] < at_s - ROOM_S:
            sensor.kept.popleft()
        self._warm(guard, at_s)
        if block.stream in guard.specimen:
            lag_s = believed_lag_s(guard.sensor_lag_s)
            share = -math.expm1(-min(at_s - before_s, 60.0) / lag_s)
            sensor.least_K += share * (self._body_K - sensor.least_K)
            still = sensor.stopped.take(at_s, reading_C, self._heat_now(guard, lag_s))
            return (
                self._fallen(guard, block.stream, sensor)
                or self._cold(guard, block.stream, sensor)
                or (None if still is None else _stopped(block.stream, reading_C, still))
                or self._colder(guard, block.stream, sensor)
            )
        if block.stream in guard.ambient:
            return self._room(guard, block.stream, sensor)
        return None

    def _warm(self, guard: WiringGuard, at_s: float) -> None:
        """Let the body take what was absorbed, and cool."""
        if self._body_s is None:
            self._body_s = at_s
        passed_s = max(0.0, at_s - self._body_s)
        if passed_s < _STEP_S and self._rises:
            return
        self._body_s = at_s
        capacity = most_J_per_K(guard.capacity_J_per_K) or UNKNOWN_J_PER_K
        self._body_K *= math.exp(-passed_s / COOLS_S)
        self._body_K += (self._absorbed_J - self._taken_J) / capacity
        self._taken_J = self._absorbed_J
        self._rises.append((at_s, self._taken_J))
        while self._rises[0][0] < at_s - ROOM_S:
            self._rises.popleft()

    def _heat_now(self, guard: WiringGuard, lag_s: float) -> HeatAtReading:
        """Return what a sensor that stands still is compared with."""
        planned = all(name not in self._sensors for name in guard.ambient)
        air_C = self._air_C(guard) - AIR_K[planned]
        rises = [
            twin.now_C - first_C
            for name in guard.ambient
            if (twin := self._sensors.get(name)) and (first_C := twin.first_C) is not None
        ]
        most = most_J_per_K(guard.capacity_J_per_K)
        return HeatAtReading(self._absorbed_J, air_C, max(rises, default=0.0), most, COOLS_S, lag_s)

    def _air_C(self, guard: WiringGuard) -> float:  # noqa: N802
        firsts = [
            first_C
            for name in guard.ambient
            if name in self._sensors and (first_C := self._sensors[name].first_C) is not None
        ]
        return sum(firsts) / len(firsts) if firsts else guard.ambient_C

    def _fallen(self, guard: WiringGuard, name: str, sensor: _Sensor) -> SignalDoubt | None:
        """Return a doubt where a sensor on the specimen cools as no spring does."""
        at_s, now_C = sensor.kept[-1]
        drops = [value - now_C for time, value in _since(sensor, at_s - DROP_S)]
        falls = [(value - now_C, value) for time, value in _since(sensor, at_s - FALL_S)]
        drop_K, (fall_K, high_C) = max(drops), max(falls)
        above_K = max(0.0, high_C - self._air_C(guard))
        limit_K = FALL_K + FALL_SHARE * above_K
        sensor.falls = sensor.falls + 1 if drop_K > DROP_K or fall_K > limit_K else 0
        if sensor.falls < READINGS - 1:
            return None
        within_s = DROP_S if drop_K > DROP_K else FALL_S
        fell_K = drop_K if drop_K > DROP_K else fall_K
        text = (
            f"{name} fell by {fell_K:.1f} K within {within_s:.0f} s, to {now_C:.2f} °C, as no spring cools: "
            "it has fallen off the specimen"
        )
        return _doubt("fallen off", name, text, fell_K, DROP_K if drop_K > DROP_K else limit_K)

    def _cold(self, guard: WiringGuard, name: str, sensor: _Sensor) -> SignalDoubt | None:
        """Return a doubt where a sensor does not show the heat that the specimen has taken up."""
        first_C = sensor.first_C
        if first_C is None or sensor.least_K < SHOWS_K:
            return None
        passed_s = sensor.kept[-1][0] - sensor.began_s
        cooled_K = max(0.0, first_C - self._air_C(guard)) * -math.expm1(-passed_s / COOLS_S)
        rose_K = max(value for _, value in _since(sensor, sensor.kept[-1][0] - 30.0)) - first_C
        if rose_K > SHOWN * sensor.least_K - cooled_K:
            return None
        text = (
            f"{name} shows {rose_K:+.2f} K since the start, though the specimen has absorbed "
            f"{self._absorbed_J / 1e3:.1f} kJ, by which it warms by {sensor.least_K:.1f} K at least"
        )
        for other, twin in self._sensors.items():
            if other in guard.ambient and twin.first_C is not None:
                warmed_K = twin.now_C - twin.first_C
                if warmed_K > SHOWN * sensor.least_K and warmed_K > 0.6:
                    return _swapped(name, other, f"{text}, and {other} beside it {warmed_K:+.2f} K")
        same_s = _same_s(sensor)
        how = f"; it repeats one reading for {same_s:.0f} s" if same_s > 60.0 else ""
        return _doubt(
            "no heat", name, f"{text}{how}: it is not on the specimen", rose_K, SHOWN * sensor.least_K
        )

    def _colder(self, guard: WiringGuard, name: str, sensor: _Sensor) -> SignalDoubt | None:
        """Ask once of a sensor that is far colder than the air at the start; None where it is not."""
        shown = {
            one: first_C
            for one, twin in self._sensors.items()
            if one in guard.ambient and (first_C := twin.first_C) is not None
        }
        if sensor.asked or sensor.first_C is None or not shown or self._taken_J > 0.0:
            return None
        other = min(shown, key=lambda one: shown[one])
        colder_K = shown[other] - sensor.first_C
        if colder_K < COLDER_K:
            return None
        sensor.asked = True
        twins = [
            f"{one} on it shows {first_C:.1f} °C"
            for one, twin in self._sensors.items()
            if one != name and one in guard.specimen and (first_C := twin.first_C) is not None
        ]
        beside = "".join(f", {one}" for one in twins)
        text = (
            f"{name} on the specimen shows {sensor.first_C:.1f} °C at the start, {other} in the air "
            f"{shown[other]:.1f} °C{beside}: right if the specimen came from a colder place; "
            f"else {name} reads too low, and the temperature stop comes {colder_K:.0f} K too late"
        )
        doubt = _doubt("cold", name, text, -colder_K, -COLDER_K)
        return replace(doubt, setting=f"[[temperature.sensor]] name = “{name}”, calibration", asks=True)

    def _room(self, guard: WiringGuard, name: str, sensor: _Sensor) -> SignalDoubt | None:
        """Return a doubt where the air seems to take part in the specimen's heat."""
        rose_K = sensor.now_C - min(value for _, value in sensor.kept)
        if rose_K < ROOM_K:
            return None
        capacity = guard.capacity_J_per_K or UNKNOWN_J_PER_K
        heat_K = (self._rises[-1][1] - self._rises[0][1]) / capacity if self._rises else 0.0
        rises = {
            one: twin.now_C - min(value for _, value in twin.kept)
            for one, twin in self._sensors.items()
            if one in guard.specimen and twin.kept
        }
        if rose_K < ROOM_SHARE * max([heat_K, *rises.values()]) or heat_K < 0.5 * ROOM_K:
            return None
        text = f"{name} beside the specimen rose by {rose_K:.1f} K, as the specimen does and no hall"
        flat = [one for one, risen_K in rises.items() if risen_K < SHOWN * rose_K]
        if flat:
            return _swapped(flat[0], name, f"{text}, while {flat[0]} on it shows {rises[flat[0]]:+.1f} K")
        return _doubt("follows the specimen", name, f"{text}: it lies on the specimen", rose_K, ROOM_K)


def most_J_per_K(stated: float | None) -> float | None:  # noqa: N802 - the unit keeps its capital
    """Return the most that a specimen's heat capacity may be [J/K]; None where nothing is stated of it."""
    return CAPACITY_TIMES * stated if stated else None


def believed_lag_s(stated_s: float | None) -> float:
    """Return the longest lag of a sensor that is believed, where so much is stated of it [s]."""
    return max(LEAST_LAG_S, LAG_TIMES * (stated_s or 0.0))


def _since(sensor: _Sensor, at_s: float) -> list[tuple[float, float]]:
    """Return the newest readings, back to an instant."""
    found: list[tuple[float, float]] = []
    for reading in reversed(sensor.kept):
        if reading[0] < at_s:
            break
        found.append(reading)
    return found


def _same_s(sensor: _Sensor) -> float:
    """Return for how long it has shown its present value to the last digit [s]."""
    at_s, now_C = sensor.kept[-1]
    since_s = at_s
    for time, value in reversed(sensor.kept):
        if value != now_C:
            break
        since_s = time
    return at_s - since_s


def _swapped(one: str, other: str, text: str) -> SignalDoubt:
    setting = f"[[temperature.sensor]] role and rom of “{one}” and “{other}”"
    return SignalDoubt("swapped", f"{one}, {other}", one, setting, f"{text}: they are swapped", unit="K")


def _stopped(name: str, reading_C: float, still: StoppedReading) -> SignalDoubt:
    text = (
        f"{name} has shown {reading_C:.2f} °C for {still.since_s:.0f} s, while the specimen absorbed "
        f"{still.heat_J / 1e3:.1f} kJ, by which it warms by {still.must_K:.1f} K at least; before, it rose "
        f"by {still.rise_K:.1f} K with {still.of_J / 1e3:.1f} kJ: it stands still"
    )
    return _doubt("still", name, text, 0.0, still.must_K)


def _doubt(kind: Kind, name: str, text: str, value: float, limit: float) -> SignalDoubt:
    setting = f"[[temperature.sensor]] name = “{name}”, role and rom"
    return SignalDoubt(kind, name, name, setting, text, value, limit, "K")
