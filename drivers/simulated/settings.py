"""The table ``[simulation]`` of STAND.toml: what the simulated stand is made of."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, ValidationError

from drivers.stand_file import StandFile
from foundation.errors import BadInput
from foundation.settings import Settings


class SimulationSettings(Settings):
    """Physics and imperfections of the simulated stand."""

    model: str = Field(default="", description="spring model of the specimen, relative to the stand file")
    ambient_C: float = Field(default=21.0, ge=-60.0, le=80.0)
    initial_C: float | None = Field(default=None, ge=-60.0, le=150.0)
    """Temperature of the specimen at the start [°C]; that of the air if left out."""
    seed: int = Field(default=1, ge=0)
    force_noise_kN: float = Field(default=0.15, ge=0.0)
    """Standard deviation."""
    stroke_noise_mm: float = Field(default=0.01, ge=0.0)
    """Standard deviation, of draw wires and piston alike."""
    temperature_noise_C: float = Field(default=0.03, ge=0.0)
    """Standard deviation."""
    force_delay_s: float = Field(default=0.0008, ge=0.0, le=0.1)
    """Delay of the force's path to the controller [s]."""
    force_low_pass_Hz: float | None = Field(default=None, gt=0.0)
    """First-order low pass in the force's path; none if left out."""
    wire_linearity_mm: float = Field(default=0.03, ge=0.0)
    """Amplitude of the draw wires' smooth deviation from the straight line [mm]."""
    wire_tilt: float = Field(default=0.001, ge=0.0, le=0.1)
    """Half the relative difference between the two draw wires."""
    frame_stiffness_kN_per_mm: float = Field(default=150.0, ge=100.0)
    actuator_bandwidth_Hz: float = Field(default=15.0, ge=3.0, le=100.0)
    actuator_damping: float = Field(default=0.8, ge=0.4, lt=1.0)
    clock_drift_ppm: float = Field(default=20.0, ge=-1000.0, le=1000.0)
    """How much faster than the stand's time the controller's clock runs."""
    tick_start_us: int = Field(default=0, ge=0, lt=1 << 32)
    """Reading of the controller's clock when it is switched on [µs]; near 2**32 it soon wraps."""


def simulation_settings(stand_file: StandFile) -> SimulationSettings:
    """Return the checked table ``[simulation]`` of a stand file.

    Raises
    ------
    BadInput
        If there is none or it breaks the schema.
    """
    if stand_file.simulation is None:
        raise BadInput(
            "the stand file has no table [simulation]",
            file=stand_file.path,
            place="simulation",
            remedy="add it, or use the stand file of the simulated stand",
        )
    try:
        return SimulationSettings.model_validate(stand_file.simulation)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        known = ", ".join(SimulationSettings.model_fields)
        raise BadInput(
            f"{first['msg']} (got {first['input']!r})",
            file=stand_file.path,
            place=f"simulation.{key}",
            remedy=f"keys of this table: {known}",
        ) from None


def model_path(stand_file: StandFile, override: Path | None = None) -> Path:
    """Return the path of the spring model: the override, or what the stand file says.

    Raises
    ------
    BadInput
        If neither names one.
    """
    if override is not None:
        return override
    named = simulation_settings(stand_file).model
    if not named:
        raise BadInput(
            "no spring model is named",
            file=stand_file.path,
            place="simulation.model",
            remedy="name one there, or let the specimen name one",
        )
    return stand_file.folder / named
