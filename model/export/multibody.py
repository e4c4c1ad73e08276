"""The curves as two multibody programs read them: Modelica's tables, and MBDyn's scalar functions. In SI.

Modelica: ``Modelica.Blocks.Tables.CombiTable1Ds`` with ``tableOnFile``, the text format of the Modelica
Standard Library (documentation of the block; Wolfram System Modeler, *File Formats: CombiTimeTable Files*),
which OpenModelica, Dymola and SystemModeler share. MBDyn: *Input File Format*, sections "Scalar functions"
(multilinear) and "Scalar function elastic orthotropic".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.files import write_text
from bufferstand.model.export.losses import MULTIBODY
from bufferstand.model.export.tables import default_temperatures, slow_table
from bufferstand.model.spring import SpringModel

Floats = NDArray[np.float64]

CONTACT_MM = 0.1
"""Before contact, over which a preload that jumps is spread: a table cannot jump."""
_BEFORE_MM, _INTO_STOP_MM = 1.0, 1.0


@dataclass(frozen=True)
class WholeCurves:
    """Both curves from before contact into the stop, so that straight continuation at either end is right.

    Parameters
    ----------
    temperature_C : float
        Where they hold.
    stroke_m, loading_N, unloading_N : NDArray, shape (n,)
        Strokes from first contact, rising; negative ones without force.
    """

    temperature_C: float
    stroke_m: Floats
    loading_N: Floats
    unloading_N: Floats


def whole_curves(model: SpringModel, temperature_C: float) -> WholeCurves:
    """Return the curves of a slow stroke at one temperature, completed at both ends."""
    columns = slow_table(model, temperature_C).columns
    stroke = columns["stroke_mm"]
    x = np.concatenate([[-_BEFORE_MM, -CONTACT_MM], stroke, [stroke[-1] + _INTO_STOP_MM]])
    stop = model.curves.stop_stiffness_kN_per_mm * _INTO_STOP_MM

    def whole(force: Floats) -> Floats:
        return 1e3 * np.concatenate([[0.0, 0.0], force, [force[-1] + stop]])

    return WholeCurves(temperature_C, 1e-3 * x, whole(columns["loading_kN"]), whole(columns["unloading_kN"]))


def export_modelica(
    model: SpringModel, folder: Path, stem: str, temperatures_C: Sequence[float] | None = None
) -> Path:
    """Write ``STEM-modelica.txt``: one table a temperature, stroke [m], loading and unloading curve [N].

    Parameters
    ----------
    model : SpringModel
        The spring.
    folder : Path
        Made if it is not there.
    stem : str
        Beginning of the file's name.
    temperatures_C : sequence of float, optional
        Temperatures of the tables; T_ref and the bounds of ``valid_C`` if not given.

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    lines = ["#1", *_head(model)]
    lines.append("# columns: stroke [m], loading curve [N], unloading curve [N]")
    for table in _tables(model, temperatures_C):
        rows = np.column_stack([table.stroke_m, table.loading_N, table.unloading_N]).tolist()
        name = f"curves_{_degrees(table.temperature_C)}"
        lines += ["", f"double {name}({len(rows)},3)   # at {table.temperature_C:g} degC"]
        lines += [" ".join(_number(value) for value in row) for row in rows]
    path = folder / f"{stem}-modelica.txt"
    write_text(path, "\n".join(lines) + "\n")
    return path


def export_mbdyn(
    model: SpringModel, folder: Path, stem: str, temperatures_C: Sequence[float] | None = None
) -> Path:
    """Write ``STEM-mbdyn.mbd``: of each curve a scalar function, force [N] over extension [m].

    In MBDyn extension and tension are positive: curves of a buffer are those of negative arguments.

    Parameters
    ----------
    model, folder, stem, temperatures_C
        As of :func:`export_modelica`.

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    sign = 1.0 if model.sense == "extension" else -1.0
    lines = _head(model)
    lines.append("# argument: extension [m], negative in compression; value: force [N], tension positive")
    for table in _tables(model, temperatures_C):
        for curve, force in (("loading", table.loading_N), ("unloading", table.unloading_N)):
            points = sorted(zip((sign * table.stroke_m).tolist(), (sign * force).tolist(), strict=True))
            name = f"{_plain(stem)}_{curve}_{_degrees(table.temperature_C)}"
            lines += ["", f'scalar function: "{name}", multilinear,']
            lines.append(",\n".join(f"    {_number(x)}, {_number(y)}" for x, y in points) + ";")
            law = f'scalar function elastic orthotropic, "{name}", null, null'
            lines.append(f"# constitutive law: 1, 3, {law};")
    path = folder / f"{stem}-mbdyn.mbd"
    write_text(path, "\n".join(lines) + "\n")
    return path


def _tables(model: SpringModel, temperatures_C: Sequence[float] | None) -> list[WholeCurves]:
    return [whole_curves(model, T) for T in dict.fromkeys(temperatures_C or default_temperatures(model))]


def _head(model: SpringModel) -> list[str]:
    """Return what must be known, as comments in ASCII: one of the two readers takes no other letters."""
    sense = "extension" if model.sense == "extension" else "compression"
    said = [
        f"{model.name}: curves of a slow stroke, stroke 0 is first contact ({sense})",
        *(f"Range: {sentence}" for sentence in model.statements),
        *(f"Lost: {sentence}" for sentence in MULTIBODY),
    ]
    return [f"# {_ascii(' '.join(sentence.split()))}" for sentence in said]


def _ascii(text: str) -> str:
    known = text.replace("…", "...").replace("°C", "degC").replace("–", "-").replace("−", "-")
    return known.encode("ascii", "replace").decode("ascii")


def _plain(text: str) -> str:
    """Return a name of letters, digits and underscores."""
    return "".join(c if c.isascii() and c.isalnum() else "_" for c in text)


def _degrees(temperature_C: float) -> str:
    """Return a temperature as part of a name: 25degC, minus12p5degC."""
    return f"{temperature_C:g}degC".replace("-", "minus").replace(".", "p")


def _number(value: float) -> str:
    return f"{value + 0.0:.9g}"
