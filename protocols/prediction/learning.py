"""Learning the specimen's heating from the steps already run: two factors on the model's heat law.

``heating`` scales the heat that stays in the spring (absorbed energy, or inversely C), ``cooling`` the loss
to the air (λ). Both are found from the temperatures measured at the beginning and end of steps and pauses,
and held near 1 as long as little has been measured: one step of half a kelvin must not throw a plan about.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bufferstand.foundation import BadInput
from bufferstand.protocols.prediction.forwarding import ForwardingPredictor
from bufferstand.protocols.prediction.predictor import Predictor, Temperatures

SENSOR_DOUBT_K = 0.3
"""Standard uncertainty of a measured rise [K]: resolution and place of the sensor."""
CAPACITY_DOUBT, HEAT_DOUBT, LOSS_DOUBT = math.log(1.4), math.log(1.25), math.log(1.4)
"""Standard uncertainties, as logarithms, before anything is measured: of the spring's capacity, of the heat
that a cycle brings, and of the loss to the air. A smaller capacity lets it heat *and* cool faster, so that a
step that heats more than expected says something of the cooling, too."""
BOUNDS = (0.2, 5.0)
"""No factor is believed beyond these: the model or a sensor would be wrong in another way."""


@dataclass(frozen=True)
class Observation:
    """What was expected of a step or pause, and what the sensor showed.

    Parameters
    ----------
    name : str
        Of the step.
    start_C, end_C : float
        Measured by the warmest specimen sensor at its beginning and end [°C].
    ambient_C : float
        Measured air temperature [°C].
    heat_J : float
        Absorbed by the model: :attr:`bufferstand.protocols.steps.PlannedStep.expected_heat_J`, or that of the
        cycles run.
    duration_s : float
        From beginning to end [s].
    start_mass_C : float or None
        Of the spring's mass at the beginning, where it is known better than by the sensor.
    follows : bool
        It begins where the one before it ended: the mass is what that left behind, by the factors in
        question, shifted by what the sensor shows.
    """

    name: str
    start_C: float
    end_C: float
    ambient_C: float
    heat_J: float
    duration_s: float
    start_mass_C: float | None = None
    follows: bool = False

    def __post_init__(self) -> None:
        if not self.duration_s > 0.0 or self.heat_J < 0.0:
            raise ValueError(f"{self.name}: a step lasts longer than 0 s and absorbs no less than 0 J")


@dataclass(frozen=True)
class HeatScale:
    """Factors on the model's heating and cooling; 1 and 1 is the model as it is.

    Parameters
    ----------
    heating, cooling : float
        Of the absorbed heat, and of the loss to the air.
    steps : int
        From how many observations.
    """

    heating: float = 1.0
    cooling: float = 1.0
    steps: int = 0

    def __post_init__(self) -> None:
        if not (self.heating > 0.0 and self.cooling > 0.0):
            raise ValueError(f"the factors must be positive, got {self.heating} and {self.cooling}")

    def as_dict(self) -> dict[str, float | int]:
        """Return it as JSON-ready data, for ``campaign.json``."""
        return asdict(self)


@dataclass(frozen=True)
class LearnedPredictor(ForwardingPredictor):
    """A predictor whose heat law is scaled; forces and energies stay.

    ``C dT/dt = h P − c λ (T − T_0)`` is the law of a spring with C/h as capacity and λ c/h as loss. The
    sensor's lag stays: it is the sensor's.
    """

    model: Predictor
    scale: HeatScale

    @property
    def asked(self) -> Predictor:
        """The model as it is."""
        return self.model

    def temperatures_after(
        self,
        start: Temperatures,
        ambient_C: float,
        power_W: float,
        duration_s: float,
        *,
        heating: float = 1.0,
        cooling: float = 1.0,
    ) -> Temperatures:
        """Return the temperatures with the learned heating and cooling."""
        return self.model.temperatures_after(
            start,
            ambient_C,
            power_W,
            duration_s,
            heating=self.scale.heating * heating,
            cooling=self.scale.cooling * cooling,
        )


def expected_end(seen: Observation, predictor: Predictor, scale: HeatScale | None = None) -> Temperatures:
    """Return mass and sensor at the end of a step by the scaled model."""
    mass_C = seen.start_C if seen.start_mass_C is None else seen.start_mass_C
    learned = LearnedPredictor(predictor, scale or HeatScale())
    start = Temperatures(mass_C, seen.start_C)
    return learned.temperatures_after(start, seen.ambient_C, seen.heat_J / seen.duration_s, seen.duration_s)


def expected_end_C(  # noqa: N802 - the unit keeps its capital
    seen: Observation, predictor: Predictor, scale: HeatScale | None = None
) -> float:
    """Return what the sensor should show at the end of a step by the scaled model [°C]."""
    return expected_end(seen, predictor, scale).sensor_C


def expected_ends(
    observations: Sequence[Observation], predictor: Predictor, scale: HeatScale
) -> list[Temperatures]:
    """Return mass and sensor at the end of each of several steps in a row, by the scaled model."""
    ends: list[Temperatures] = []
    for seen in observations:
        if seen.follows and ends:
            mass_C = ends[-1].mass_C + seen.start_C - ends[-1].sensor_C
            seen = replace(seen, start_mass_C=mass_C)  # noqa: PLW2901 - the same, better known
        ends.append(expected_end(seen, predictor, scale))
    return ends


def end_as_measured(
    observations: Sequence[Observation], predictor: Predictor, scale: HeatScale
) -> Temperatures:
    """Return the specimen's state after the last of several steps.

    The sensor as measured; the mass, which has none, as the model has it, shifted by what it missed the
    sensor by.

    Raises
    ------
    IndexError
        If there is none.
    """
    expected, measured_C = expected_ends(observations, predictor, scale)[-1], observations[-1].end_C
    return Temperatures(expected.mass_C + measured_C - expected.sensor_C, measured_C)


def learn_heating(observations: Sequence[Observation], predictor: Predictor) -> HeatScale:
    """Return the factors that explain the measured temperatures best.

    Least squares over the observations' end temperatures (:data:`SENSOR_DOUBT_K` each) and over the factors'
    logarithms (:data:`CAPACITY_DOUBT` …), so that what the data do not tell stays near 1.

    Parameters
    ----------
    observations : sequence of Observation
        Of steps and pauses; none gives factors of 1.
    predictor : Predictor
        The model, not yet scaled.

    Raises
    ------
    BadInput
        If a measured temperature is no number.
    """
    if not observations:
        return HeatScale()
    for seen in observations:
        if not all(math.isfinite(value) for value in (seen.start_C, seen.end_C, seen.ambient_C)):
            raise BadInput(f"step “{seen.name}”: a temperature is missing", remedy="leave this step out")

    doubt = np.linalg.inv(np.linalg.cholesky(_prior()))

    def misfit(logs: NDArray[np.float64]) -> NDArray[np.float64]:
        scale = HeatScale(math.exp(logs[0]), math.exp(logs[1]))
        ends = expected_ends(observations, predictor, scale)
        apart = [
            (end.sensor_C - seen.end_C) / SENSOR_DOUBT_K for end, seen in zip(ends, observations, strict=True)
        ]
        return np.array([*apart, *(doubt @ logs)])

    low, high = (math.log(bound) for bound in BOUNDS)
    found = least_squares(misfit, np.zeros(2), bounds=([low, low], [high, high]))
    heating, cooling = np.exp(found.x)
    return HeatScale(float(heating), float(cooling), len(observations))


def _prior() -> NDArray[np.float64]:
    """Return the covariance of the logarithms of heating and cooling before anything is measured."""
    shared = CAPACITY_DOUBT**2
    return np.array([[shared + HEAT_DOUBT**2, shared], [shared, shared + LOSS_DOUBT**2]])
