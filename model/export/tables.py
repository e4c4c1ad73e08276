"""Tables for tools without FMI: curves and transition at chosen temperatures, and Fancher's form."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import as_cell
from bufferstand.foundation.files import write_text
from bufferstand.model.export.losses import FANCHER, TABLES
from bufferstand.model.spring import SpringModel

Floats = NDArray[np.float64]

STEP_MM = 1.0
"""Distance of the strokes in the tables."""
COLUMNS = (
    "stroke_mm",
    "loading_kN",
    "unloading_kN",
    "transition_loading_kN_per_mm",
    "transition_unloading_kN_per_mm",
    "transition_length_loading_mm",
    "transition_length_unloading_mm",
)

FANCHER_COLUMNS = (
    *COLUMNS[:3],
    "envelope_load_kN",
    "envelope_unload_kN",
    "beta_load_mm",
    "beta_unload_mm",
)


@dataclass(frozen=True)
class SlowTable:
    """The spring at one temperature, slow; every array has shape (n,).

    Parameters
    ----------
    temperature_C : float
        Where it holds.
    columns : dict of str to NDArray
        By :data:`COLUMNS`. The transition stiffnesses are those with which the force leaves the unloading
        curve on loading, and the loading curve on unloading (k_t scaled to the temperature); the lengths
        are 1/a and 1/b, infinite where the force never leaves its curve.
    """

    temperature_C: float
    columns: dict[str, Floats]


def default_temperatures(model: SpringModel) -> tuple[float, ...]:
    """Return T_ref and the bounds within which the model was identified [°C], rising."""
    law = model.temperature
    return tuple(sorted({law.reference_C, *(law.valid_C or ())}))


def slow_table(model: SpringModel, temperature_C: float, step_mm: float = STEP_MM) -> SlowTable:
    """Return curves and transition at one temperature: every ``step_mm``, at the ramp's end and the last.

    The forces rise from 0 over the contact ramp; the stiffnesses are those of the curves without it.
    """
    tables, curves = model.tables, model.curves
    x = np.arange(0.0, tables.end_mm - 1e-9, step_mm)
    x = np.unique([*x.tolist(), curves.contact_ramp_mm, tables.end_mm])
    cells = tables.cells_of(x)
    soft = float(model.temperature.softening(temperature_C))
    scale = float(model.width_scale(temperature_C))
    s = 1.0 - soft * tables.at(tables.depth, cells)
    ds = -soft * _slope(tables.depth, tables.step_mm, x)
    a, b = (_slope(table, tables.step_mm, x) for table in (tables.A, tables.B))
    loading, width = tables.at(tables.loading, cells), scale * tables.at(tables.width, cells)
    k_l = curves.loading_stiffness(x)
    k_u = k_l - scale * (k_l - curves.unloading_stiffness(x))
    with np.errstate(divide="ignore"):
        lengths = 1.0 / a, 1.0 / b
    values = (
        x,
        s * loading,
        s * (loading - width),
        ds * (loading - width) + s * (k_u + width * a),
        ds * loading + s * (k_l + width * b),
        *lengths,
    )
    return SlowTable(temperature_C, dict(zip(COLUMNS, values, strict=True)))


def export_tables(
    model: SpringModel, folder: Path, stem: str, temperatures_C: Sequence[float] | None = None
) -> tuple[Path, ...]:
    """Write ``STEM-tables.csv``, ``STEM-tables.json`` and ``STEM-fancher.csv``; return their paths.

    Parameters
    ----------
    model : SpringModel
        The spring.
    folder : Path
        Made if it is not there.
    stem : str
        Beginning of the files' names.
    temperatures_C : sequence of float, optional
        Temperatures of the tables; :func:`default_temperatures` if not given. Fancher's table holds at T_ref.

    Raises
    ------
    BadInput
        If a file cannot be written.
    """
    found = [slow_table(model, T) for T in temperatures_C or default_temperatures(model)]
    texts = {
        f"{stem}-tables.csv": _csv(model, found),
        f"{stem}-tables.json": _json(model, found),
        f"{stem}-fancher.csv": _fancher(model),
    }
    for name, text in texts.items():
        write_text(folder / name, text)
    return tuple(folder / name for name in texts)


def _slope(table: Floats, step_mm: float, x: Floats) -> Floats:
    """Return the slope of a fine table at strokes: those of its cells, joined between their middles."""
    middles = (np.arange(len(table) - 1) + 0.5) * step_mm
    return np.asarray(np.interp(x, middles, np.diff(table) / step_mm), dtype=np.float64)


def _head(model: SpringModel, title: str, lost: Sequence[str]) -> list[str]:
    sense = "extension" if model.sense == "extension" else "compression"
    stop = model.curves.stop_stiffness_kN_per_mm
    return [
        as_cell(f"# {' '.join(model.name.split())}: {title}"),
        f"# Loading ({sense}) positive, stroke 0 is first contact; stop beyond the tables: {stop:g} kN/mm",
        *(f"# Range: {sentence}" for sentence in model.statements),
        *(f"# Lost: {sentence}" for sentence in lost),
    ]


def _rows(header: Sequence[str], rows: Sequence[Sequence[float]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([[_number(value) for value in row] for row in rows])
    return text.getvalue()


def _number(value: float) -> str:
    return f"{value:.9g}"


def _csv(model: SpringModel, found: Sequence[SlowTable]) -> str:
    rows = [
        [table.temperature_C, *row]
        for table in found
        for row in zip(*(column.tolist() for column in table.columns.values()), strict=True)
    ]
    head = _head(model, "curves and transition at single temperatures", TABLES)
    return "\n".join(head) + "\n" + _rows(["temperature_C", *COLUMNS], rows)


def _json(model: SpringModel, found: Sequence[SlowTable]) -> str:
    content = {
        "format": "bufferstand/spring-tables",
        "format_version": 1,
        "name": model.name,
        "origin": model.origin,
        "sense": model.sense,
        "lost": list(TABLES),
        "stop_stiffness_kN_per_mm": model.curves.stop_stiffness_kN_per_mm,
        "reference_C": model.temperature.reference_C,
        "identified": _identified(model),
        "tables": [
            {"temperature_C": table.temperature_C}
            | {
                name: [float(_number(v)) if np.isfinite(v) else None for v in column.tolist()]
                for name, column in table.columns.items()
            }
            for table in found
        ],
    }
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _identified(model: SpringModel) -> dict[str, object] | None:
    """Return where the model was identified and what stands beyond, by the names of the model file."""
    known = model.identified
    if known is None:
        return None
    return {**asdict(known), "valid_C": model.temperature.valid_C, "curves_end_mm": model.curves.end_mm}


def _fancher(model: SpringModel) -> str:
    """Return the table for ``dF/dx = (E - F) / beta``, which is eq. (4) for these E and beta.

    Loading, eq. (4) reads dF/dx = k_l + (F_l - F) b. Fancher's force trails its envelope by beta times the
    envelope's slope, eq. (4)'s does not: so E = F_l + k_l / b and beta = 1 / b; unloading E = F_u - k_u / a.
    """
    x, loading, unloading, _, _, per_a, per_b = _reference_columns(model)
    k_l, k_u = model.curves.loading_stiffness(x), model.curves.unloading_stiffness(x)
    columns = (x, loading, unloading, loading + k_l * per_b, unloading - k_u * per_a, per_b, per_a)
    rows = list(zip(*(column.tolist() for column in columns), strict=True))
    head = _head(model, f"Fancher's form at {model.temperature.reference_C:g} °C", FANCHER)
    head.append("# F1 = E1 + (F0 - E1) exp(-|x1 - x0| / beta), E and beta of the direction")
    return "\n".join(head) + "\n" + _rows(FANCHER_COLUMNS, rows)


def _reference_columns(model: SpringModel) -> tuple[Floats, ...]:
    return tuple(slow_table(model, model.temperature.reference_C).columns.values())
