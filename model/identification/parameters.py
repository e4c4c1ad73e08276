"""The parameters of a spring model as one vector of numbers, and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.curves import Curves
from bufferstand.model.identification.laws import LAWS, NAMES
from bufferstand.model.identified_range import IdentifiedRange
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw, ViscousBranch

Floats = NDArray[np.float64]

LEAST_RISE_kN = 1e-3
"""Between two knots the loading curve rises by so much at least; the unloading curve may stay."""


STAGE_OF = {"transition_length_mm": "band", "tau_s": "lag", "spectrum_per_decade": "lag"}


@dataclass(frozen=True)
class FixedParts:
    """What is given, not identified.

    Parameters
    ----------
    knots_mm : tuple of float
        Strokes at which the curves are identified, rising from 0; monotone cubics join them.
    reference_C : float
        T_ref.
    contact_ramp_mm, stop_stiffness_kN_per_mm, floor, sensor_gain
        As in the model file.
    name, sense, origin : str
        As in the model file.
    """

    knots_mm: tuple[float, ...]
    reference_C: float = 25.0
    contact_ramp_mm: float = 0.2
    stop_stiffness_kN_per_mm: float = 500.0
    floor: float = 0.05
    sensor_gain: float = 1.0
    name: str = "identified spring"
    sense: Literal["compression", "extension"] = "compression"
    origin: str = ""

    @property
    def points(self) -> int:
        """Number of knots."""
        return len(self.knots_mm)

    @property
    def size(self) -> int:
        """Number of entries of the vector that describe the spring."""
        return 2 * self.points + len(LAWS)

    def place(self, name: str) -> int:
        """Return where a law's parameter stands in the vector."""
        return 2 * self.points + NAMES.index(name)

    def value(self, vector: Floats, name: str) -> float:
        """Return the value of a law's parameter."""
        return LAWS[NAMES.index(name)].to_value(float(vector[self.place(name)]))


def pack(frame: FixedParts, loading_kN: Floats, unloading_kN: Floats, values: dict[str, float]) -> Floats:
    """Return the vector of curves at the knots and of the laws' values, kept inside the bounds."""
    rises = np.maximum(np.diff(loading_kN, prepend=0.0), LEAST_RISE_kN)
    returns = np.maximum(np.diff(np.minimum(unloading_kN, np.cumsum(rises)), prepend=0.0), 0.0)
    laws = [law.to_vector(min(max(values.get(law.name, law.start), law.low), law.high)) for law in LAWS]
    vector = np.concatenate([rises, returns, laws])
    low, high = bounds(frame)
    return np.asarray(np.clip(vector, low, high), dtype=np.float64)


def bounds(frame: FixedParts) -> tuple[Floats, Floats]:
    """Return the bounds of the vector: neither curve falls."""
    n = frame.points
    low = [LEAST_RISE_kN] * n + [0.0] * n + [law.to_vector(law.low) if law.low else 0.0 for law in LAWS]
    high = [np.inf] * (2 * n) + [law.to_vector(law.high) for law in LAWS]
    return np.array(low), np.array(high)


def scales(frame: FixedParts, vector: Floats) -> Floats:
    """Return by how much each entry may differ before any run says so; the unit of steps and of the SVD."""
    n = frame.points
    even = float(np.sum(vector[:n])) / n
    rises = np.maximum(vector[: 2 * n], 0.3 * even)
    return np.concatenate([rises, [law.range for law in LAWS]])


def curves_at_knots(frame: FixedParts, vector: Floats) -> tuple[Floats, Floats]:
    """Return F_l and F_u [kN] at the knots, shape (n,) each, F_u no higher than F_l."""
    n = frame.points
    loading = np.cumsum(vector[:n])
    return loading, np.minimum(np.cumsum(vector[n : 2 * n]), loading)


def curves_of(frame: FixedParts, vector: Floats) -> Curves:
    """Return the curves of a vector.

    Raises
    ------
    BadInput
        If between two knots the unloading curve would pass above the loading curve.
    """
    loading, unloading = curves_at_knots(frame, vector)
    return Curves(
        stroke_mm=frame.knots_mm,
        loading_kN=tuple(loading.tolist()),
        unloading_kN=tuple(unloading.tolist()),
        transition_length_mm=frame.value(vector, "transition_length_mm"),
        stop_stiffness_kN_per_mm=frame.stop_stiffness_kN_per_mm,
        contact_ramp_mm=frame.contact_ramp_mm,
    )


def model_of(
    frame: FixedParts,
    vector: Floats,
    curves: Curves | None = None,
    valid_C: tuple[float, float] | None = None,
    identified: IdentifiedRange | None = None,
) -> SpringModel:
    """Return the spring model of a vector.

    ``curves``, if they are known to be those of the vector, or go on beyond them; ``valid_C`` and
    ``identified`` say where it was identified, if that is to be in the model.
    """
    value = {law.name: law.to_value(float(vector[frame.place(law.name)])) for law in LAWS}
    return SpringModel(
        name=frame.name,
        origin=frame.origin,
        sense=frame.sense,
        curves=curves or curves_of(frame, vector),
        temperature=TemperatureLaw(
            reference_C=frame.reference_C,
            sensitivity_per_K=value["sensitivity_per_K"],
            depth_mm=value["depth_mm"],
            loss_sensitivity_per_K=value["loss_sensitivity_per_K"],
            floor=frame.floor,
            valid_C=valid_C,
        ),
        heat=HeatBalance(
            capacity_J_per_K=value["capacity_J_per_K"],
            loss_W_per_K=value["loss_W_per_K"],
            sensor_lag_s=value["sensor_lag_s"],
            sensor_gain=frame.sensor_gain,
        ),
        viscous=ViscousBranch(value["beta"], value["tau_s"], value["spectrum_per_decade"]),
        identified=identified,
    )
