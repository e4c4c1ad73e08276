"""The table ``[simulation]`` of STAND.toml: what the simulated stand is made of."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, model_validator

from bufferstand.drivers.simulated.miswiring import Miswired
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import BadInput, curve_problem
from bufferstand.foundation.settings import Settings, WrongKeyError, demand_named, read_text, refusal


def _demand_curve(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if problem := curve_problem(points):
        raise ValueError(problem)
    return points


def _as_tuples(value: object) -> object:
    """Let pairs be written as lists, as TOML has them."""
    return tuple(_as_tuples(part) for part in value) if isinstance(value, list) else value


_Number = Annotated[float, Field(ge=-500.0, le=500.0)]
_Pair = Annotated[tuple[_Number, _Number], BeforeValidator(_as_tuples)]
_CurveNumber = Annotated[float, Field(ge=0.0, le=10_000.0)]
_Curve = Annotated[
    tuple[tuple[_CurveNumber, _CurveNumber], ...],
    BeforeValidator(_as_tuples),
    AfterValidator(_demand_curve),
]


class Moves(Settings):
    """What a stand without ``[controller]`` does by itself when it is simulated: sines, until it is ended."""

    mean_mm: float = Field(default=40.0, ge=0.1, le=250.0)
    amplitude_mm: float = Field(default=20.0, ge=0.01, le=125.0)
    """Half the range of a sine."""
    frequency_Hz: float = Field(default=1.0, ge=0.01, le=10.0)

    @model_validator(mode="after")
    def _stays_in_contact(self) -> Moves:
        if self.amplitude_mm > self.mean_mm or self.mean_mm + self.amplitude_mm > 250.0:
            raise WrongKeyError(
                f"{self.mean_mm:g} ± {self.amplitude_mm:g} mm is not within 0 … 250 mm; write a smaller "
                "amplitude_mm",
                "amplitude_mm",
            )
        return self


class SimulationSettings(Settings):
    """Physics and imperfections of the simulated stand."""

    model: str = Field(default="", description="spring model of the specimen, relative to the stand file")
    specimen_force_factor: float = Field(default=1.0, ge=0.3, le=3.0)
    """True force of the specimen at every stroke, as a multiple of its model's: softer below 1."""
    ambient_C: float = Field(default=21.0, ge=-60.0, le=80.0)
    initial_C: float | None = Field(default=None, ge=-60.0, le=150.0)
    """Temperature of the specimen at the start [°C]; that of the air if left out."""
    seed: int = Field(default=1, ge=0, lt=1 << 63)
    force_noise_kN: float = Field(default=0.15, ge=0.0, le=50.0)
    """Standard deviation."""
    stroke_noise_mm: float = Field(default=0.01, ge=0.0, le=5.0)
    """Standard deviation, of draw wires and piston alike."""
    temperature_noise_C: float = Field(default=0.03, ge=0.0, le=5.0)
    """Standard deviation."""
    force_delay_s: float = Field(default=0.0008, ge=0.0, le=0.1)
    """Delay of the force's path to the controller [s]."""
    force_low_pass_Hz: float | None = Field(default=None, ge=0.1, le=1e5)
    """First-order low pass in the force's path; none if left out."""
    wire_linearity_mm: float = Field(default=0.03, ge=0.0, le=10.0)
    """Amplitude of the draw wires' smooth deviation from the straight line [mm]."""
    wire_tilt: float = Field(default=0.001, ge=0.0, le=0.1)
    """Half the relative difference between the two draw wires."""
    wire_zero_mm: _Pair = (0.0, 0.0)
    """What the two draw wires read with the specimen unloaded [mm]: nobody has set their zero."""
    force_zero_kN: float = Field(default=0.0, ge=-50.0, le=50.0)
    """What the samples of the force and the amplifier read with nothing on the transducer [kN]; what the
    controller itself acts on has a tare of its own."""
    gap_mm: float = Field(default=0.0, ge=-20.0, le=50.0)
    """How far the specimen stands clear of the plate with the piston at its zero; the draw wires hang on the
    specimen and do not move in the gap. Below 0 the piston presses the specimen at its zero already."""
    piston_start_mm: float = Field(default=0.0, ge=-50.0, le=0.0)
    """Where the piston stands when the stand is switched on: retracted, for a specimen to be mounted."""
    piston_area_mm2: float = Field(default=30_000.0, ge=100.0, le=1e6)
    """Area on which a ``pressure`` channel of the controller makes the force; 210 bar are 630 kN."""
    frame_stiffness_kN_per_mm: float = Field(default=150.0, ge=100.0, le=1e5)
    actuator_bandwidth_Hz: float = Field(default=15.0, ge=3.0, le=100.0)
    actuator_damping: float = Field(default=0.8, ge=0.4, lt=1.0)
    force_speed: _Curve | None = None
    """True force–speed curve: pairs of force [kN] and greatest speed against it [mm/s]; that
    of the table limits if left out, and no such limit where there is none."""
    servo_lag_s: float = Field(default=0.0, ge=0.0, le=0.1)
    """How much later the position loop follows a command that moves evenly, beside its second order [s]."""
    reversal_s: float = Field(default=0.0, ge=0.0, le=0.2)
    """For so long the piston stands when it turns, while the valve's spool crosses its overlap [s]."""
    force_flicker_kN: float = Field(default=0.0, ge=0.0, le=50.0)
    """Standard deviation of a noise of the force that is not white: 1/f from 0.05 to 5 Hz."""
    stroke_flicker_mm: float = Field(default=0.0, ge=0.0, le=5.0)
    """The same of each draw wire."""
    force_hum_kN: float = Field(default=0.0, ge=0.0, le=50.0)
    """Amplitude of the mains hum (50 Hz) on the force."""
    stroke_hum_mm: float = Field(default=0.0, ge=0.0, le=5.0)
    """The same on both draw wires."""
    force_drift_kN_per_h: float = Field(default=0.0, ge=-10.0, le=10.0)
    """How the zero of the force transducer, on both its amplifiers, drifts."""
    force_zero_kN_per_K: float = Field(default=0.0, ge=-1.0, le=1.0)
    """How that zero follows the transducer's temperature."""
    force_gain_per_K: float = Field(default=0.0, ge=-1e-3, le=1e-3)
    """Relative change of the force transducer's gain with its temperature."""
    wire_zero_mm_per_K: _Pair = (0.0, 0.0)
    """How the zeros of the two draw wires follow their temperature."""
    wire_gain_per_K: float = Field(default=0.0, ge=-1e-3, le=1e-3)
    """Relative change of both draw wires' gain with their temperature."""
    wire_drift_mm_per_h: _Pair = (0.0, 0.0)
    """How the zeros of the two draw wires drift."""
    warm_up_K: float = Field(default=0.0, ge=-40.0, le=40.0)
    """By how much the transducers become warmer than they were when the stand was switched on …"""
    warm_up_s: float = Field(default=3600.0, ge=1.0, le=1e6)
    """… with this time constant [s]."""
    reply_latency_s: float = Field(default=0.0, ge=0.0, le=0.1)
    """Least time from a request to the controller to its reply [s of the stand]."""
    reply_jitter_s: float = Field(default=0.0, ge=0.0, le=0.1)
    """Mean of what comes on top of it, exponentially distributed on each way [s of the stand]."""
    missed_cycles_per_h: float = Field(default=0.0, ge=0.0, le=36000.0)
    """How many cycles of its loop the controller misses in an hour, at any time."""
    clock_drift_ppm: float = Field(default=20.0, ge=-1000.0, le=1000.0)
    """How much faster than the stand's time the controller's clock runs."""
    tick_start_us: int = Field(default=0, ge=0, lt=1 << 32)
    """Reading of the controller's clock when it is switched on [µs]; near 2**32 it soon wraps."""
    acquisition_drift_ppm: float = Field(default=-35.0, ge=-1000.0, le=1000.0)
    """How much faster than the stand's time the clock of an acquisition device runs."""
    acquisition_start_s: float = Field(default=812.0037, ge=0.0, le=4000.0)
    """What that clock shows when the stand is switched on [s]."""
    acquisition_jitter_s: float = Field(default=0.0005, ge=0.0, le=0.1)
    """Mean of what a reading of that clock needs on each way beside the least [s]."""
    moves: Moves | None = None
    """Of a stand without ``[controller]`` (record-only mode); left out, as :class:`Moves` has it."""
    miswired: Miswired = Miswired()
    """What a person got wrong between the specimen and the computer; nothing if left out."""


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
        path = stand_file.path
        text = read_text(path) if path.is_file() else ""  # a stand that was made in memory has no lines
        raise refusal(error, SimulationSettings, path, text, ("simulation",)) from None


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
    return demand_named(stand_file.folder / named, stand_file.path, ("simulation", "model"))
