"""Warming a specimen up: cycles, a rest, and cycles again, until spring and sensors are as warm as asked for.

The sensors lag behind the spring (:mod:`bufferstand.daq.warm_up.sensor_trend`). So a go of cycles ends when
the spring, not the sensor, is expected to be there: by the slope of the readings times the lag, or, where a
band is so narrow that this is seen too late, after a number of cycles by what one of them heats. After every
go it is waited until readings and spring have become even; what was missed then says what lag and heating
really are, and the next go makes up for it."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.daq.acquisition import Acquisition
from bufferstand.daq.guards.kinds import TemperatureGuard
from bufferstand.daq.motions import MotionRunner
from bufferstand.daq.warm_up.outcome import WarmUpOutcome
from bufferstand.daq.warm_up.sensor_trend import (
    SLOPE_NOISE_K_PER_S,
    WINDOW_S,
    SensorLag,
    SensorTrend,
    SensorTrends,
)
from bufferstand.foundation import Harmonic, StaticCycles, counted
from bufferstand.protocols.prediction import EVEN_LAGS, UNKNOWN_LAG_S, even_within_K, seen_too_late
from bufferstand.protocols.steps import ForceCycles, Motion, PlannedStep, Warmth

LEAST_LAG_S = 5.0
"""No model's lag is believed to be less [s]."""
PROBE_CYCLES = 3
"""So many cycles has the first go where it is not known what a cycle heats."""
MODEL_SHARE = 0.7
"""The share of the way for which a model's heating is believed: capacities are known to some 40 %."""
DOUBT_K = 0.15
"""Three times the standard uncertainty of a rise that was measured between two rests [K]."""
ENDS_LIKE_CYCLES = 1.0
"""The cycle in, the way there and the release heat like one cycle together."""


def warm_up(
    step: PlannedStep,
    warmth: Warmth,
    motions: Sequence[Motion],
    driver: MotionRunner,
    acquisition: Acquisition,
) -> WarmUpOutcome:
    """Repeat a step's motions until spring and sensors are as warm as they are to be.

    A specimen that is so warm already is not moved; one that is too warm is waited for. The temperature stop
    stays in force.

    Parameters
    ----------
    step : PlannedStep
        With what is expected of each motion.
    warmth : Warmth
        When it is over.
    motions : sequence of Motion
        That are left of it.
    driver : Driver
        Performs them.
    acquisition : Acquisition
        Its panel knows the readings.

    Raises
    ------
    Halt
        As :meth:`bufferstand.daq.motions.motion_runner.MotionRunner.perform`, and if it takes too many cycles
        or too long.
    """
    warming = _Warming(step, warmth, motions, driver, acquisition)
    acquisition.observers.append(warming.drift.take)
    try:
        return warming.run()
    finally:
        acquisition.observers.remove(warming.drift.take)


class _Warming:
    """One warm-up, with what it has learned of lag and heating."""

    def __init__(
        self,
        step: PlannedStep,
        warmth: Warmth,
        motions: Sequence[Motion],
        driver: MotionRunner,
        acquisition: Acquisition,
    ) -> None:
        self._step, self._warmth, self._motions = step, warmth, motions
        self._driver, self._acquisition = driver, acquisition
        panel = acquisition.panel
        touching = frozenset(
            guard.stream for guard in panel.guards.of(TemperatureGuard) if guard.resume_C is not None
        )
        self.drift = SensorTrends(panel.latest_temperatures, touching)
        heating = step.heating
        lag_s = None if heating is None else heating.lag_s
        lag_s = UNKNOWN_LAG_S if lag_s is None else max(lag_s, LEAST_LAG_S)
        self._lag = SensorLag(lag_s, lag_s)
        self._rise_K = None if heating is None else heating.rise_K
        self._share = MODEL_SHARE
        self._period_s = max(1.0, _period_s(step))
        self._goes = 0
        self._rested_s = 0.0

    def run(self) -> WarmUpOutcome:
        """Go and rest, in turns."""
        self._driver.begin_waiting()
        drifts = self._rest()
        while self._cold(drifts):
            began_C, done = self._spring_C(drifts), self._driver.cycles_done
            self._demand_cycles()
            self._go(drifts)
            drifts = self._rest()
            self._learn(self._spring_C(drifts) - began_C, self._driver.cycles_done - done)
        warmed = WarmUpOutcome(
            self._goes,
            self._lag.lag_s if self._goes else None,
            self._rise_K,
            self._spring_C(drifts),
            max(0.0, self.drift.highest_C - self._warmth.high_C),
            self._rested_s,
        )
        self._acquisition.log.say(
            "temperature",
            f"warmed up: {self._said()}: {warmed.sentence()}",
            cycles=self._driver.cycles_done,
            readings_C=self._readings_C(),
            spring_C=warmed.spring_C,
        )
        return warmed

    # --- a rest --------------------------------------------------------------------------------------

    def _rest(self) -> tuple[SensorTrend, ...]:
        """Wait until spring and sensors are even, and not too warm; return how the sensors move then."""
        driver, drift = self._driver, self.drift
        began_s, before = self._acquisition.clock.now_s(), self._lag
        while drift.seen == 0:
            driver.pump()
            driver.demand_in_time(self._warmth.timeout_s, "warm-up", "a sensor has given no reading yet")
        drift.begin_rest()
        since_s, seen = drift.now_s, -1
        while True:
            driver.pump()
            driver.demand_in_time(self._warmth.timeout_s, "warm-up", self._said())
            if drift.seen == seen:
                continue
            seen = drift.seen
            self._lag = drift.learn(before)
            drifts = drift.drifts(since_s)
            if drifts is None or not self._even(drifts, drift.now_s - since_s):
                continue
            if self._there(drifts) or self._cold(drifts):
                break
        drift.end_rest()
        self._rested_s += self._acquisition.clock.now_s() - began_s
        return drifts

    def _even(self, drifts: Sequence[SensorTrend], rested_s: float) -> bool:
        if rested_s >= EVEN_LAGS * self._lag.most_s + WINDOW_S:
            return True
        most_K_per_s = max(even_within_K(self._warmth) / self._lag.most_s, SLOPE_NOISE_K_PER_S)
        return all(abs(drift.slope_K_per_s) <= most_K_per_s for drift in drifts)

    def _there(self, drifts: Sequence[SensorTrend]) -> bool:
        """Return whether readings and spring are within the band."""
        springs = [drift.spring_C(self._lag.lag_s) for drift in drifts]
        return self._warmth.within(self._readings_C()) and self._warmth.within(springs)

    def _cold(self, drifts: Sequence[SensorTrend]) -> bool:
        """Return whether only cycles help: neither reading nor spring is on its way into the band."""
        springs = [drift.spring_C(self._lag.lag_s) for drift in drifts]
        warmest = [max(pair) for pair in zip(springs, (drift.level_C for drift in drifts), strict=True)]
        return not self._there(drifts) and (self._warmth.too_cold(warmest) or self._warmth.too_cold(springs))

    # --- a go ----------------------------------------------------------------------------------------

    def _go(self, drifts: Sequence[SensorTrend]) -> None:
        """Cycle until the spring is expected to be there, or as far as what is known of it is believed."""
        self._goes += 1
        done, most = self._driver.cycles_done, self._cycles_to_go(drifts)

        def enough() -> bool:
            driver = self._driver
            driver.demand_in_time(self._warmth.timeout_s, "warm-up", self._said())
            if driver.cycles_done >= (self._step.cycles or 0):
                self._demand_cycles()
            if most is not None and driver.cycles_done - done >= most - 1:  # with the cycle under way
                return True
            now = self.drift.drifts()
            if now is None:
                return False
            driver.commanding.specimen_is(self._spring_C(now))
            return self._spring_C(now) + (self._rise_K or 0.0) >= self._aim_C

        self._driver.commanding.specimen_is(self._spring_C(drifts))
        for motion, estimate in zip(self._motions, self._step.estimates, strict=True):
            self._driver.perform(motion, max(estimate.duration_s, self._warmth.timeout_s), enough=enough)

    def _cycles_to_go(self, drifts: Sequence[SensorTrend]) -> int | None:
        """Return how many cycles the go has at most; None where the slope alone is quick enough."""
        if self._rise_K is None:
            return PROBE_CYCLES
        rate_K_per_s = self._rise_K / self._period_s
        if self._rise_K <= 0.0 or not seen_too_late(rate_K_per_s, self._lag.most_s, self._warmth):
            return None
        needed_K = self._share * (self._aim_C - self._spring_C(drifts))
        return max(1, round(needed_K / self._rise_K - ENDS_LIKE_CYCLES))

    def _learn(self, rose_K: float, cycles: int) -> None:
        """Learn what a cycle heats from what a go has made of the spring."""
        if rose_K <= DOUBT_K or cycles < 1:
            return
        self._rise_K = rose_K / (cycles + ENDS_LIKE_CYCLES)
        self._share = max(MODEL_SHARE, 1.0 - DOUBT_K / rose_K)

    # --- what it looks at ----------------------------------------------------------------------------

    @property
    def _aim_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Where the spring is to be when the cycles end: it cools until the sensors have come there."""
        return self._warmth.temperature_C + self._lag.cooling_K_per_s * self._lag.lag_s

    def _spring_C(self, drifts: Sequence[SensorTrend]) -> float:  # noqa: N802
        """Return the spring's temperature behind the sensors: the middle of them, or the warmest."""
        springs = [drift.spring_C(self._lag.lag_s) for drift in drifts]
        return 0.5 * (min(springs) + max(springs)) if self._warmth.every else max(springs)

    def _readings_C(self) -> list[float]:  # noqa: N802
        readings = self._acquisition.panel.specimen_temperatures()
        return [value for value in readings.values() if value is not None]

    def _demand_cycles(self) -> None:
        done = self._driver.cycles_done
        if done >= (self._step.cycles or 0):
            self._driver.give_up(
                "warm-up", f"not warm after {counted(done, 'cycle')} (max_cycles): {self._said()}"
            )

    def _said(self) -> str:
        readings = self._readings_C()
        shown = ", ".join(f"{value:.2f} °C" for value in readings)
        text = f"the specimen is at {shown}, wanted {self._warmth.low_C:g} … {self._warmth.high_C:g} °C"
        apart_K = max(readings, default=0.0) - min(readings, default=0.0)
        if self._warmth.every and apart_K > 2.0 * self._warmth.band_K:
            text += f"; its sensors are {apart_K:.2f} K apart, more than the band is wide (sensors = “any”)"
        return text


def _period_s(step: PlannedStep) -> float:
    """Return how long a cycle takes [s], by the plan."""
    for motion, estimate in zip(step.motions, step.estimates, strict=True):
        if isinstance(motion, Harmonic):
            return 1.0 / motion.frequency_Hz
        planned = step.cycles if step.expected_cycles is None else step.expected_cycles
        if isinstance(motion, StaticCycles | ForceCycles) and planned:
            return estimate.duration_s / planned
    return 1.0
