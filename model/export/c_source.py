"""The spring as one C header: core and curves together, for tools and programs without FMI."""

from __future__ import annotations

import re
import textwrap
from importlib.resources import files
from math import isfinite
from pathlib import Path

from bufferstand.foundation.files import write_text
from bufferstand.model.export.losses import C_SOURCE
from bufferstand.model.export.options import FmuOptions
from bufferstand.model.export.variables import range_rows
from bufferstand.model.spring import SpringModel

_EXAMPLE = """\
/* One stroke to {stroke:g} mm and back in 2 s, at 1 kHz. Build: cc -O2 -ffp-contract=off example.c -lm */
#include <stdio.h>
#include "{header}"

int main(void)
{{
    const bs_law law = {prefix}_law();
    bs_spring spring;
    int k;
    bs_start(&{prefix}_table, &law, &spring, 0.0, 0.0, law.reference_C);
    for (k = 1; k <= 2000; ++k) {{
        const double stroke_mm = {stroke:g} * (k <= 1000 ? k : 2000 - k) / 1000.0;
        const double force_kN = bs_step(&{prefix}_table, &law, &spring, stroke_mm, 0.001);
        printf("%.3f,%.17g,%.17g,%.17g\\n", 0.001 * k, stroke_mm, force_kN, spring.temperature_C);
    }}
    return 0;
}}
"""


def export_c(model: SpringModel, folder: Path, stem: str) -> tuple[Path, ...]:
    """Write ``STEM.h`` (core, curves and laws in one C99 header) and ``example.c``; return their paths.

    Parameters
    ----------
    model : SpringModel
        The spring.
    folder : Path
        Made if it is not there.
    stem : str
        Name of the header; its letters and digits also begin the names in it.

    Raises
    ------
    BadInput
        If a file cannot be written.
    """
    prefix = _identifier(stem)
    header, example = folder / f"{stem}.h", folder / "example.c"
    write_text(header, _header(model, prefix))
    stroke = 0.8 * model.curves.end_mm
    write_text(example, _EXAMPLE.format(stroke=stroke, header=header.name, prefix=prefix))
    return header, example


def _identifier(stem: str) -> str:
    name = re.sub(r"[^A-Za-z0-9]+", "_", stem).strip("_") or "spring"
    return f"spring_{name}" if name[0].isdigit() else name


def _header(model: SpringModel, prefix: str) -> str:
    core = (files("bufferstand.model.export") / "c" / "bufferstand_spring.h").read_text(encoding="utf-8")
    tables, law, heat = model.tables, model.temperature, model.heat
    rows = tables.rows().tolist()
    scale = "HUGE_VAL" if tables.width_scale_max == float("inf") else repr(tables.width_scale_max)
    numbers = {
        "reference_C": law.reference_C,
        "sensitivity_per_K": law.sensitivity_per_K,
        "loss_sensitivity_per_K": law.loss_sensitivity_per_K,
        "floor": law.floor,
        "capacity_J_per_K": heat.capacity_J_per_K,
        "loss_W_per_K": heat.loss_W_per_K,
        "sensor_lag_s": heat.sensor_lag_s,
        "sensor_gain": heat.sensor_gain,
        "beta": model.viscous.beta,
        "tau_s": model.viscous.tau_s,
        "spectrum_per_decade": model.viscous.spectrum_per_decade,
        "stop_kN_per_mm": model.curves.stop_stiffness_kN_per_mm,
    }
    guard = f"{prefix.upper()}_H"
    said = [model.name, *textwrap.wrap(model.origin, 104)]
    said += [line for sentence in model.statements for line in textwrap.wrap(f"Range: {sentence}", 104)]
    said += [f"Lost: {sentence}" for sentence in C_SOURCE]
    comment = "\n".join(f" * {line}".rstrip() for line in said).replace("*/", "* /")
    return "\n".join(
        [
            core,
            f"/*\n{comment}\n */",
            f"#ifndef {guard}\n#define {guard}\n",
            *_range(model, prefix),
            f"static const bs_cell {prefix}_cells[{len(rows)}] = {{",
            *("    {" + ", ".join(map(repr, row)) + "}," for row in rows),
            "};",
            f"static const bs_table {prefix}_table = {{",
            f"    {len(rows) - 1}, {tables.step_mm!r}, {1.0 / tables.step_mm!r}, {tables.end_mm!r}, {scale},",
            f"    {prefix}_cells,\n}};\n",
            f"static inline bs_law {prefix}_law(void)\n{{\n    bs_law law;",
            *(f"    law.{name} = {float(value)!r};" for name, value in numbers.items()),
            f"    law.paper_heat = {int(heat.rule == 'paper')};\n    law.isothermal = 0;",
            "    bs_prepare(&law);\n    return law;\n}\n\n#endif",
            "",
        ]
    )


def _range(model: SpringModel, prefix: str) -> list[str]:
    """Return the range in which the model was identified as macros, those that somebody states."""
    options = FmuOptions(units="mm-kN")
    return [
        f"#define {prefix.upper()}_{name.upper()} {float(value)!r} /* {text} */"
        for name, text, _, value in range_rows(model, options)
        if isfinite(value)
    ]
