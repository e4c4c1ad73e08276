"""The model file (TOML): schema, reading, writing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import write_text
from bufferstand.foundation.settings import (
    COEFFICIENT,
    CYCLES_OR_NONE,
    DURATION_S,
    FACTOR,
    FORCE_KN,
    FREQUENCY_HZ,
    HEAT_CAPACITY_J_PER_K,
    HEAT_LOSS_W_PER_K,
    LENGTH_MM,
    LENGTH_SCALE_MM,
    NOT_NEGATIVE,
    PER_K,
    SHARE,
    SLOPE_KN_PER_MM,
    SPEED_MM_PER_S,
    STIFFNESS_KN_PER_MM,
    TEMPERATURE_C,
    TIME_CONSTANT_S,
    Numbers,
    Settings,
    load_settings,
    parse_settings,
)
from bufferstand.model.curves import Curves
from bufferstand.model.fit_uncertainty import FitUncertainty
from bufferstand.model.identified_range import Continuation, IdentifiedRange, StopSource
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw, ViscousBranch

FORMAT = "bufferstand/spring-model"
FORMAT_VERSION = 1


class ModelHead(Settings):
    """``[model]``: what this is."""

    format: Literal["bufferstand/spring-model"]
    """Kind of file."""
    format_version: Literal[1]
    """Version of this schema."""
    name: str = Field(min_length=1)
    """The spring, for people."""
    sense: Literal["compression", "extension"] = "compression"
    """What positive stroke and force are: compression (buffer) or extension (draw gear)."""
    origin: str = ""
    """How the figures were obtained."""


class CurvesTable(Settings):
    """``[curves]``: envelope at ``temperature.reference_C``; stroke 0 is first contact."""

    stroke_mm: Annotated[Numbers, LENGTH_MM]
    """Strokes of the tables, rising from 0 [mm]."""
    loading_kN: Annotated[Numbers, FORCE_KN]
    """F_l at those strokes [kN]."""
    unloading_kN: Annotated[Numbers, FORCE_KN]
    """F_u at those strokes [kN]."""
    transition_length_mm: Annotated[float, LENGTH_SCALE_MM] | None = None
    """L of k_t = max(k_l, k_u) + (F_l - F_u) / L [mm]; this or the next."""
    transition_stiffness_kN_per_mm: Annotated[Numbers, SLOPE_KN_PER_MM] | None = None
    """k_t at those strokes [kN/mm], nowhere below the slope of either curve."""
    stop_stiffness_kN_per_mm: Annotated[float, STIFFNESS_KN_PER_MM] = 500.0
    """Stiffness added beyond the last stroke [kN/mm]."""
    contact_ramp_mm: Annotated[float, LENGTH_MM] = 0.0
    """Stroke over which the preload's force builds up at contact [mm]; 0 lets it jump."""


class TemperatureTable(Settings):
    """``[temperature]``: eq. (5) and the loss sensitivity."""

    reference_C: Annotated[float, TEMPERATURE_C] = 25.0
    """T_ref, at which the curves hold [°C]."""
    sensitivity_per_K: Annotated[float, PER_K] = 0.0
    """c_ts [1/K]."""
    depth_mm: Annotated[float, LENGTH_SCALE_MM] = 20.0
    """alpha [mm]."""
    loss_sensitivity_per_K: Annotated[float, PER_K] = 0.0
    """c_eta: relative decrease of the width F_l - F_u beyond that of the force [1/K]."""
    floor: Annotated[float, SHARE] = 0.05
    """The softening c_ts (T - T_ref) goes no further than 1 - floor."""
    valid_C: Annotated[Numbers, TEMPERATURE_C] | None = Field(default=None, min_length=2, max_length=2)
    """Lowest and highest temperature at which the law was identified [°C]; beyond it a warning is given."""


class HeatTable(Settings):
    """``[heat]``: eqs. (6), (7) and the sensor."""

    capacity_J_per_K: Annotated[float, HEAT_CAPACITY_J_PER_K]
    """C [J/K]."""
    loss_W_per_K: Annotated[float, HEAT_LOSS_W_PER_K] = 0.0
    """lambda [W/K]."""
    rule: Literal["loop-exact", "paper"] = "loop-exact"
    """Heat from the hysteresis' free energy, or by the paper's eq. (8)."""
    sensor_lag_s: Annotated[float, DURATION_S] = 0.0
    """Time constant of the sensor on the spring [s]."""
    sensor_gain: Annotated[float, FACTOR] = 1.0
    """Share of the spring's excess over the ambient that the sensor's place reaches."""


class ViscousTable(Settings):
    """``[viscous]``: overstress beta (F_m(x) - F_m(xi)), F_m = (F_l + F_u) / 2, xi' = (x - xi) / tau."""

    beta: Annotated[float, FACTOR] = 0.0
    """Share of the force that an infinitely fast stroke adds."""
    tau_s: Annotated[float, TIME_CONSTANT_S] = 1.0
    """Relaxation time [s]."""
    spectrum_per_decade: Annotated[float, FACTOR] = 0.0
    """b: share that each decade of relaxation times from 1.6 ms to 1.6 s adds; 0 is no spectrum."""


class IdentifiedTable(Settings):
    """``[identified]``: in which range, and what the curves beyond it rest on. Temperatures: ``valid_C``."""

    stroke_mm: Annotated[Numbers, LENGTH_MM] = Field(min_length=2, max_length=2)
    """Least and largest stroke at which force was measured [mm]."""
    speed_mm_per_s: Annotated[Numbers, SPEED_MM_PER_S] = Field(min_length=2, max_length=2)
    """Mean speed of the slowest half stroke, and largest speed [mm/s]."""
    frequency_Hz: Annotated[Numbers, FREQUENCY_HZ] = Field(min_length=2, max_length=2)
    """One over twice the time of the slowest and of the fastest half stroke [Hz]."""
    continuation: Continuation | None = None
    """What the curves beyond the largest measured stroke rest on; none if they end there."""
    loading_at_end_kN: Annotated[Numbers, FORCE_KN] | None = Field(default=None, min_length=2, max_length=2)
    """Between which forces F_l at the end of continued curves lies [kN]."""
    stop: StopSource = "assumed"
    """Where the stiffness of the stop comes from."""


class FitTable(Settings):
    """``[fit]``: how well the fit knows its parameters, and how far it missed cycles that it did not see."""

    parameter: Annotated[tuple[str, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]
    """Names: keys of this file, ``ln`` before those whose logarithm was fitted, ``loading_kN at 5 mm`` …."""
    standard_uncertainty: Annotated[Numbers, NOT_NEGATIVE]
    """Of each, in its own unit; of a logarithm without one."""
    correlation: Annotated[Numbers, COEFFICIENT]
    """Coefficients below the diagonal, row by row."""
    degrees_of_freedom: Annotated[float, NOT_NEGATIVE]
    """Effective number of residuals less that of the parameters."""
    held_out_cycles: Annotated[int, CYCLES_OR_NONE] = 0
    """Number of cycles foretold by a fit without them; 0 if none was held out."""
    held_out_rms_kN: Annotated[float, FORCE_KN] = 0.0
    """Root mean square of the force's residuals on these cycles [kN]."""
    held_out_rms_share: Annotated[float, SHARE] = 0.0
    """The same, with each cycle's residuals over its largest force."""


class ModelFile(Settings):
    """A whole model file."""

    model: ModelHead
    curves: CurvesTable
    temperature: TemperatureTable = TemperatureTable()
    heat: HeatTable
    viscous: ViscousTable = ViscousTable()
    identified: IdentifiedTable | None = None
    fit: FitTable | None = None


def load_model(path: str | Path) -> SpringModel:
    """Read a model file.

    Raises
    ------
    BadInput
        If the file cannot be read, breaks the schema, or holds curves or parameters that contradict
        themselves; the message names the file, the key and, for curves, the stroke.
    """
    path = Path(path)
    content = load_settings(path, ModelFile)
    law = content.temperature
    try:
        return SpringModel(
            name=content.model.name,
            origin=content.model.origin,
            sense=content.model.sense,
            curves=Curves(**content.curves.model_dump()),
            temperature=TemperatureLaw(
                **law.model_dump(exclude={"valid_C"}),
                valid_C=None if law.valid_C is None else (law.valid_C[0], law.valid_C[1]),
            ),
            heat=HeatBalance(**content.heat.model_dump()),
            viscous=ViscousBranch(**content.viscous.model_dump()),
            identified=None if content.identified is None else _range_of(content.identified),
            fit=None if content.fit is None else FitUncertainty(**content.fit.model_dump()),
        )
    except BadInput as error:
        raise error.of_file(path) from None


def _range_of(table: IdentifiedTable) -> IdentifiedRange:
    def ends(values: Numbers) -> tuple[float, float]:
        return values[0], values[1]

    return IdentifiedRange(
        stroke_mm=ends(table.stroke_mm),
        speed_mm_per_s=ends(table.speed_mm_per_s),
        frequency_Hz=ends(table.frequency_Hz),
        continuation=table.continuation,
        loading_at_end_kN=None if table.loading_at_end_kN is None else ends(table.loading_at_end_kN),
        stop=table.stop,
    )


def save_model(model: SpringModel, path: str | Path) -> None:
    """Write a model file; reading it again gives an equal model.

    Raises
    ------
    BadInput
        If the file cannot be written, or a number lies outside the bounds that it has in files.
    """
    head = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": model.name,
        "sense": model.sense,
        "origin": model.origin,
    }
    lines: list[str] = []
    for name, table in (
        ("model", head),
        ("curves", CurvesTable.model_fields.keys()),
        ("temperature", TemperatureTable.model_fields.keys()),
        ("heat", HeatTable.model_fields.keys()),
        ("viscous", ViscousTable.model_fields.keys()),
        ("identified", IdentifiedTable.model_fields.keys()),
        ("fit", FitTable.model_fields.keys()),
    ):
        part = getattr(model, name, None)
        if name in ("identified", "fit") and part is None:
            continue  # nobody says: a file that older versions read, too
        values = table if isinstance(table, dict) else {key: getattr(part, key) for key in table}
        if values.get("spectrum_per_decade") == 0.0:
            del values["spectrum_per_decade"]  # no spectrum: a file that older versions read, too
        lines += [f"[{name}]", *(f"{key} = {_toml(v)}" for key, v in values.items() if v is not None), ""]
    text = "\n".join(lines[:-1]) + "\n"
    parse_settings(text, ModelFile, Path(path))  # what is written is read again
    write_text(Path(path), text)


def _toml(value: object) -> str:
    """Return a value as TOML: numbers by their shortest exact text, ten to a line in long arrays."""
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        if "\n" in value:
            return '"""\n' + escaped + '"""'
        return f'"{escaped}"'
    if isinstance(value, tuple):
        rows = [", ".join(_toml(v) for v in value[i : i + 10]) for i in range(0, len(value), 10)]
        return f"[{rows[0]}]" if len(rows) == 1 else "[\n  " + ",\n  ".join(rows) + ",\n]"
    return repr(float(value)) if isinstance(value, float) else repr(value)
