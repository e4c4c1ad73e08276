"""A thermometer on the specimen that has shown its heat and then stands still, while more heat is put in.

A right sensor stands still, too: its lag has to pass, losses may equal the heat, and behind a rest the
specimen must first come back to what the sensor shows. So two things are counted over the stretch in which it
has not moved by more than its own steps and noise: the heat beyond the most that a specimen so warm can
lose, and that heat times the time since when it has been there, by which a late sensor rises (one of first
order by ∫ Q dt / (C · lag)). Each must be several times what this same sensor has ever stood still for in
this campaign, and what a slow one may need.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from bufferstand.drivers.thermometers import CELSIUS_PER_COUNT

STEP_K, COARSEST_K = CELSIUS_PER_COUNT, 8.0 * CELSIUS_PER_COUNT
"""A sensor's step is that of a DS18B20 with twelve bits, or the least that it has ever shown, as far as one
with nine bits. More is a leap, and no step."""
RISEN_STEPS = 8.0
"""It has risen with the heat by so many steps before: what noise of one step does not make."""
MUST_RISE_STEPS = 10.0
"""The heat beyond all losses warms the specimen by so many in the stretch at least …"""
MUST_SHOW_STEPS = 9.0
"""… of which a sensor of the longest lag that is believed shows so many."""
HEAT_TIMES, LATE_TIMES = 3.0, 15.0
"""Heat, and heat times its time, against the longest stretch in which it stood still before. Where it turns
behind a rest it stands twice as long as at the beginning, on both sides of its least reading: 2 and 4, of a
cold end, which follows in stages, 10."""
SEEN_TIMES = 1.2
"""A heat capacity that is made of readings may be too small by this: noise, and air that warms, too."""
LEAST_SHARE = 0.25
"""… and it is this share of the most that it may be, where it is stated: half of that."""
STATED_SHARE = 0.5
"""What a step takes is that of the stated capacity at least, half of the most."""
LIGHTEST_J_PER_K = 4000.0
"""No specimen is lighter in heat: 9 kg of steel. What rises by more than it makes has other reasons."""
STILL_STEPS = 3.01
"""One that shows no more than four neighbouring values stands still: noise of half a step, and rounding."""
KEPT_S, KEPT_MORE_S = 900.0, 60.0
"""A longer stretch than this counts by its end only [s]; it is shortened every minute."""


@dataclass(frozen=True)
class StoppedReading:
    """A sensor that stands still.

    Parameters
    ----------
    since_s : float
        For so long [s].
    heat_J : float
        Absorbed in that time.
    must_K : float
        By which the specimen warms at least, beyond all losses.
    rise_K, of_J : float
        What it has shown before, and of how much heat.
    """

    since_s: float
    heat_J: float
    must_K: float
    rise_K: float
    of_J: float


@dataclass(frozen=True)
class HeatAtReading:
    """What is known of the specimen's heat at a reading.

    Parameters
    ----------
    absorbed_J : float
        Since the start; it does not fall.
    air_C : float
        The coldest that the air beside it may be.
    air_rose_K : float
        By so much the air has warmed since the start, as far as it is measured.
    capacity_J_per_K : float or None
        The most that the specimen may take; None: not known.
    cools_s : float
        The shortest time constant with which it cools.
    lag_s : float
        The longest lag of a sensor on it that is believed.
    """

    absorbed_J: float
    air_C: float
    air_rose_K: float
    capacity_J_per_K: float | None
    cools_s: float
    lag_s: float


@dataclass
class _Sum:
    """Heat in a stretch, all of it and beyond the losses, and that times the time it has been in there."""

    all_J: float = 0.0
    all_Js: float = 0.0
    net_J: float = 0.0
    net_Js: float = 0.0

    def add(self, heat_J: float, lost_J: float, passed_s: float) -> None:
        all_J, net_J = self.all_J, self.net_J
        self.all_J += heat_J
        self.net_J = max(0.0, net_J + heat_J - lost_J)
        self.all_Js += 0.5 * (all_J + self.all_J) * passed_s
        self.net_Js += 0.5 * (net_J + self.net_J) * passed_s


@dataclass(frozen=True)
class _Reading:
    """A reading, what was absorbed until then, and the heat capacity that both made of it [J/K]."""

    at_s: float
    value_C: float
    absorbed_J: float
    capacity: float | None


class _Balance:
    """The heat capacity that a sensor's rise shows: heat = C · (rise + what has been lost of it since).

    Losses are counted with the shortest time constant. Where a specimen loses less, the capacity comes out
    too large as well, so that no equilibrium looks like heat left over. Lag makes it too large, too.
    """

    def __init__(self) -> None:
        self._base: tuple[float, float] | None = None
        self._last_s = self._heated_s = 0.0
        self._last_J = self._lost_Ks = 0.0
        self.rise_K = self.heat_J = 0.0

    def take(self, at_s: float, reading_C: float, heat: HeatAtReading, step_K: float) -> float | None:
        """Return the heat capacity, None as long as the sensor has not risen with the heat [J/K]."""
        if self._base is None:
            self._base, self._last_s = (reading_C, heat.absorbed_J), at_s
            self._last_J = heat.absorbed_J
        if heat.absorbed_J > self._last_J:
            self._heated_s, self._last_J = at_s, heat.absorbed_J
        base_C, base_J = self._base
        self.rise_K, self.heat_J = reading_C - base_C, heat.absorbed_J - base_J
        passed_s, self._last_s = at_s - self._last_s, at_s
        self._lost_Ks += passed_s * (reading_C - max(base_C, heat.air_C))
        if self.rise_K < 0.0:  # a new least; heat of long ago is lost by then
            rested = at_s - self._heated_s > KEPT_S
            self._begin(reading_C, heat.absorbed_J if rested else base_J)
        elif self.rise_K > 2.0 * step_K and self.heat_J < LIGHTEST_J_PER_K * self.rise_K:
            self._begin(reading_C, heat.absorbed_J)  # the air did it, or heat of before the start
        shown_K = self.rise_K + max(0.0, self._lost_Ks) / heat.cools_s
        risen = self.rise_K - max(0.0, heat.air_rose_K) >= RISEN_STEPS * step_K
        return self.heat_J / shown_K if risen else None

    def _begin(self, reading_C: float, absorbed_J: float) -> None:
        self._base, self._lost_Ks, self.rise_K = (reading_C, absorbed_J), 0.0, 0.0


class StoppedSensor:
    """Remembers how one thermometer went with the heat, and how long it stood still in it."""

    def __init__(self) -> None:
        self._kept: deque[_Reading] = deque()
        self._sum, self._longest = _Sum(), _Sum()
        self._step_K = COARSEST_K
        self._low_C, self._high_C = float("inf"), -float("inf")
        self._balance = _Balance()

    def take(self, at_s: float, reading_C: float, heat: HeatAtReading) -> StoppedReading | None:
        """Take a reading; return what is known of it if the sensor has stopped, None if it has not.

        Parameters
        ----------
        at_s : float
            Rising.
        reading_C : float
        heat : Heat
        """
        if self._kept and reading_C != self._kept[-1].value_C:
            moved_K = abs(reading_C - self._kept[-1].value_C)
            self._step_K = max(STEP_K, min(self._step_K, moved_K))
        capacity = self._balance.take(at_s, reading_C, heat, self._step_K)
        self._kept.append(_Reading(at_s, reading_C, heat.absorbed_J, capacity))
        if len(self._kept) > 1:
            self._add(self._sum, len(self._kept) - 1, heat)
        self._break(heat)
        return self._stopped(heat)

    def _capacity(self, heat: HeatAtReading) -> float | None:
        """Return the most that the specimen takes per kelvin, as known when the stretch began [J/K]."""
        seen = self._kept[0].capacity
        if seen is None:
            return heat.capacity_J_per_K
        own, most = SEEN_TIMES * seen, heat.capacity_J_per_K
        return own if most is None else min(max(own, LEAST_SHARE * most), most)

    def _add(self, total: _Sum, row: int, heat: HeatAtReading) -> None:
        before, now = self._kept[row - 1], self._kept[row]
        passed_s = now.at_s - before.at_s
        loses_W = (self._capacity(heat) or 0.0) * max(0.0, now.value_C - heat.air_C) / heat.cools_s
        total.add(now.absorbed_J - before.absorbed_J, loses_W * passed_s, passed_s)

    def _break(self, heat: HeatAtReading) -> None:
        """Let the stretch begin where the sensor moved for the last time."""
        most_K = STILL_STEPS * self._step_K
        newest, oldest = self._kept[-1], self._kept[0]
        self._low_C, self._high_C = min(self._low_C, newest.value_C), max(self._high_C, newest.value_C)
        moved = self._high_C - self._low_C > most_K
        if not moved and newest.at_s - oldest.at_s <= KEPT_S + KEPT_MORE_S:
            return
        if moved:
            # All of the heat: how much a lag takes is not to be belittled by losses that may be less.
            self._longest.all_J = max(self._longest.all_J, self._sum.all_J)
            self._longest.all_Js = max(self._longest.all_Js, self._sum.all_Js)
        self._low_C = self._high_C = newest.value_C
        stretch: deque[_Reading] = deque()
        for one in reversed(self._kept):
            low_C, high_C = min(self._low_C, one.value_C), max(self._high_C, one.value_C)
            if high_C - low_C > most_K or one.at_s < newest.at_s - KEPT_S:
                break
            self._low_C, self._high_C = low_C, high_C
            stretch.appendleft(one)
        self._kept, self._sum = stretch, _Sum()
        for row in range(1, len(stretch)):
            self._add(self._sum, row, heat)

    def _stopped(self, heat: HeatAtReading) -> StoppedReading | None:
        begun, now, capacity = self._kept[0], self._kept[-1], self._capacity(heat)
        if begun.capacity is None or capacity is None:
            return None
        # By losses of long ago that were less, the capacity may come out too small for what is put in now.
        step_J = self._step_K * max(capacity, STATED_SHARE * (heat.capacity_J_per_K or 0.0))
        if self._sum.net_J < max(MUST_RISE_STEPS * step_J, HEAT_TIMES * self._longest.all_J):
            return None
        least_Js = MUST_SHOW_STEPS * step_J * heat.lag_s
        if self._sum.net_Js < max(least_Js, LATE_TIMES * self._longest.all_Js):
            return None
        return StoppedReading(
            now.at_s - begun.at_s,
            now.absorbed_J - begun.absorbed_J,
            self._sum.net_J / capacity,
            self._balance.rise_K,
            self._balance.heat_J - (now.absorbed_J - begun.absorbed_J),
        )
