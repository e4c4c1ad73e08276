"""The tidy table of an evaluation: a row a cycle, for spreadsheets and statistics."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pandas as pd

from evaluation.document import CYCLE_QUANTITIES
from foundation.errors import BadInput

SUFFIXES = (".csv", ".parquet")


def cycle_table(document: Mapping[str, Any]) -> pd.DataFrame:
    """Return every cycle of an evaluation document as a row.

    Columns: ``run``, ``path``, ``kind``, ``specimen``, ``cycle``, ``start_s``, ``end_s``, ``complete``,
    ``steady``, the figures by their names in the document, ``temperature_start_C``, ``temperature_max_C``,
    and ``U(damping)``, ``U(stored_energy_J)``, ``U(absorbed_energy_J)``, ``U(tangent_stiffness_kN_per_mm)``.
    A missing value is missing in the table too.
    """
    rows = [
        {
            "run": entry["run"]["id"],
            "path": entry["run"]["path"],
            "kind": entry["run"]["kind"],
            "specimen": entry["run"]["specimen"].get("id"),
            "cycle": cycle["index"],
            **{name: cycle[name] for name in ("start_s", "end_s", "complete", "steady", *CYCLE_QUANTITIES)},
            "temperature_start_C": cycle["temperature_C"]["start"],
            "temperature_max_C": cycle["temperature_C"]["max"],
            **{f"U({name})": cycle["expanded_uncertainty"].get(name) for name in _WITH_UNCERTAINTY},
        }
        for entry in document["runs"]
        for cycle in entry["cycles"]
    ]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    numeric = [name for name in COLUMNS if name not in _TEXT_OR_FLAG]
    return table.astype(
        dict.fromkeys(numeric, "float64") | {"cycle": "int64", "complete": bool, "steady": bool}
    )


_WITH_UNCERTAINTY = ("stored_energy_J", "absorbed_energy_J", "damping", "tangent_stiffness_kN_per_mm")
_TEXT_OR_FLAG = ("run", "path", "kind", "specimen", "cycle", "complete", "steady")
COLUMNS = (
    "run",
    "path",
    "kind",
    "specimen",
    "cycle",
    "start_s",
    "end_s",
    "complete",
    "steady",
    *CYCLE_QUANTITIES,
    "temperature_start_C",
    "temperature_max_C",
    *(f"U({name})" for name in _WITH_UNCERTAINTY),
)


def write_table(document: Mapping[str, Any], path: Path) -> None:
    """Write the table as CSV (UTF-8) or Parquet, by the file's suffix.

    Raises
    ------
    BadInput
        If the suffix is neither, Parquet needs a library that is not installed, or the file cannot be
        written.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise BadInput(f"a table of kind “{suffix}” is not known", file=path, remedy="use .csv or .parquet")
    if suffix == ".parquet" and find_spec("pyarrow") is None:
        raise BadInput(
            "Parquet needs the library pyarrow, which is not installed",
            file=path,
            remedy="install it (pip install pyarrow) or name a .csv file",
        )
    table = cycle_table(document)
    try:
        if suffix == ".csv":
            table.to_csv(path, index=False, encoding="utf-8")
        else:
            table.to_parquet(path, index=False)
    except OSError as error:
        raise BadInput(
            f"cannot be written: {error.strerror or error}",
            file=path,
            remedy="name a file in an existing folder",
        ) from None
