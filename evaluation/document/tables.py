"""The tidy tables of an evaluation, for spreadsheets and statistics: a row a cycle, a row a run."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson
from numpy.typing import NDArray

from bufferstand.evaluation.catalogue import MAIN, QUANTITIES
from bufferstand.foundation import BadInput, how_to_add
from bufferstand.foundation.files import replaced_whole

if TYPE_CHECKING:  # takes a third of a second, and CSV does without
    import pandas as pd

SUFFIXES = (".csv", ".parquet", ".xlsx")
EXCEL_ROWS = 1_048_575
"""Rows that a sheet can hold below its heading."""
EXCEL_CHARACTERS = 32_767
"""Characters that a cell can hold."""
_NOT_IN_EXCEL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f]")
_EXCEL = ".xlsx"
_LIBRARY = {".parquet": "pyarrow", _EXCEL: "openpyxl"}

NUMBERS = (
    "cycle",
    "start_s",
    "end_s",
    "complete",
    "steady",
    *QUANTITIES.names,
    *(f"U({name})" for name in MAIN.names),
)
"""Columns of a cycle that are numbers or flags."""
_facts_of = itemgetter("index", "start_s", "end_s", "complete", "steady")
_OF_RUN = ("run", "path", "kind", "specimen")
_TRACE = ("sha256", "settings_sha256", "version")
COLUMNS = (*_OF_RUN, *NUMBERS, *_TRACE)


def cycle_numbers(entry: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the numbers of a run's cycles, shape (C, len(NUMBERS)); NaN where one is missing.

    Raises
    ------
    ValueError
        If a figure that is there is NaN or infinite: JSON has neither, and would hide it as missing.
    """
    rows = [
        (
            *_facts_of(cycle),
            *(quantity.value_in(cycle) for quantity in QUANTITIES),
            *(cycle["expanded_uncertainty"].get(name) for name in MAIN.names),
        )
        for cycle in entry["cycles"]
    ]
    numbers = np.array(rows, dtype=np.float64).reshape(-1, len(NUMBERS))
    if np.count_nonzero(np.isfinite(numbers)) != numbers.size - sum(row.count(None) for row in rows):
        raise ValueError("a figure of a cycle is neither a finite number nor missing")
    return numbers


OfRun = Mapping[str, Sequence[Any]]
"""``run``, ``path``, ``kind``, ``specimen``, ``sha256``, ``settings_sha256``, ``version``: one each a run."""


def cycle_frame(of_run: OfRun, numbers: Sequence[NDArray[np.float64]]) -> pd.DataFrame:
    """Return the table of runs whose cycles' numbers are known.

    Parameters
    ----------
    of_run : mapping of str to sequence
    numbers : sequence of arrays, shape (C, len(NUMBERS))
        One a run (:func:`cycle_numbers`).
    """
    import pandas as pd  # noqa: PLC0415

    count = [len(one) for one in numbers]
    every = np.concatenate(numbers) if numbers else np.zeros((0, len(NUMBERS)))
    texts = {
        name: pd.Series(np.repeat(np.array(of_run[name], dtype=object), count), dtype="object")
        for name in (*_OF_RUN, *_TRACE)
    }
    columns: dict[str, Any] = {**texts, **{name: every[:, i] for i, name in enumerate(NUMBERS)}}
    table = pd.DataFrame({name: columns[name] for name in COLUMNS})
    return table.astype({"cycle": "int64", "complete": bool, "steady": bool})


def cycle_rows(numbers: NDArray[np.float64]) -> str:
    """Return a run's numbers, shape (C, len(NUMBERS)), as they stand in the table as CSV: a line a cycle."""
    rows = [
        (int(cycle), start_s, end_s, bool(complete), bool(steady), *figures)
        for cycle, start_s, end_s, complete, steady, *figures in numbers.tolist()
    ]
    # JSON writes what is missing (NaN) as null, flags in lower case, and a row in brackets.
    text = orjson.dumps(rows)[2:-2].decode().replace("],[", "\n")
    return text.replace("null", "").replace("true", "True").replace("false", "False")


def cycle_csv(of_run: OfRun, rows: Iterable[str]) -> Iterator[str]:
    """Yield the same table as CSV, a piece a run: numbers to the last digit, at a twentieth of pandas' time.

    Parameters
    ----------
    of_run : mapping of str to sequence
    rows : iterable of str
        One a run (:func:`cycle_rows`).
    """
    yield _csv_line(COLUMNS)
    for position, own in enumerate(rows):
        before = _csv_line([of_run[name][position] for name in _OF_RUN])[:-1]
        after = _csv_line([of_run[name][position] for name in _TRACE])
        if own:
            between = f",{after}{before},"
            yield f"{before},{own.replace(chr(10), between)},{after}"


def _csv_line(values: Sequence[Any]) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(values)
    return line.getvalue()


def cycle_table(document: Mapping[str, Any]) -> pd.DataFrame:
    """Return every cycle of an evaluation document as a row.

    Columns: ``run``, ``path``, ``kind``, ``specimen``, ``cycle``, ``start_s``, ``end_s``, ``complete``,
    ``steady``, every quantity by its name in the catalogue, ``U(…)`` of the main results, and what the row
    can be traced to: ``sha256`` of the run's content, ``settings_sha256`` and ``version`` (the last two where
    the document states them). A missing value is missing in the table too.
    """
    return cycle_frame(*_columns(document))


def _columns(document: Mapping[str, Any]) -> tuple[OfRun, list[NDArray[np.float64]]]:
    runs = [entry["run"] for entry in document["runs"]]
    count = len(runs)
    of_run: OfRun = {
        "run": [run["id"] for run in runs],
        "path": [run["path"] for run in runs],
        "kind": [run["kind"] for run in runs],
        "specimen": [run["specimen"].get("id") for run in runs],
        "sha256": [run.get("sha256") for run in runs],
        "settings_sha256": [document.get("settings", {}).get("sha256")] * count,
        "version": [version_text(document.get("software", {}))] * count,
    }
    return of_run, [cycle_numbers(entry) for entry in document["runs"]]


def version_text(software: Mapping[str, Any]) -> str | None:
    """Return version and first digits of the code's hash, as ``software`` of a document states them."""
    version, code = software.get("version"), software.get("code_sha256")
    return f"{version}+{code[:12]}" if version and code else version


def check_table_name(path: Path) -> None:
    """Refuse a name under which no table can be written, before anything is computed.

    Raises
    ------
    BadInput
        If the suffix is none of those known, or needs a library that is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise BadInput(
            f"a table of kind “{suffix}” is not known", file=path, remedy="use .csv, .parquet or .xlsx"
        )
    library = _LIBRARY.get(suffix)
    if library is not None and find_spec(library) is None:
        raise BadInput(
            f"{suffix} needs the library {library}, which is not installed",
            file=path,
            remedy=f"install it ({how_to_add('tables')}) or name a .csv file",
        )


def write_table(document: Mapping[str, Any], path: Path) -> None:
    """Write the table of cycles as CSV (UTF-8), Parquet or Excel, by the file's suffix.

    Raises
    ------
    BadInput
        If the suffix is none of these, it needs a library that is not installed, or the file cannot be
        written.
    """
    write_cycles(*_columns(document), path)


def write_cycles(
    of_run: OfRun,
    numbers: Sequence[NDArray[np.float64]],
    path: Path,
    more: Mapping[str, pd.DataFrame] | None = None,
) -> None:
    """Write the table of runs whose cycles' numbers are known, as :func:`write_table`.

    Parameters
    ----------
    of_run, numbers
        As :func:`cycle_frame`.
    path : Path
    more : mapping of str to DataFrame, optional
        Further sheets of an Excel file, by name.

    Raises
    ------
    BadInput
        As :func:`write_table`.
    """
    if path.suffix.lower() == ".csv":
        write_cycle_csv(of_run, [cycle_rows(own) for own in numbers], path)
        return
    check_table_name(path)
    write_frames({"cycles": cycle_frame(of_run, numbers), **(more or {})}, path)


def write_cycle_csv(of_run: OfRun, rows: Iterable[str], path: Path) -> None:
    """Write the table as CSV (:func:`cycle_csv`).

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    with replaced_whole(path) as place, place.open("w", encoding="utf-8", newline="") as stream:
        stream.writelines(cycle_csv(of_run, rows))


def write_frames(frames: Mapping[str, pd.DataFrame], path: Path) -> None:
    """Write tables: as sheets of their names in Excel; of CSV and Parquet only the first.

    Raises
    ------
    BadInput
        As :func:`write_table`, and if a table has more rows than a sheet.
    """
    check_table_name(path)
    suffix = path.suffix.lower()
    first = next(iter(frames.values()))
    with replaced_whole(path) as place:
        if suffix == ".csv":
            first.to_csv(place, index=False, encoding="utf-8")
        elif suffix == ".parquet":
            first.to_parquet(place, index=False)
        else:
            place.write_bytes(_excel(frames, path))


def _excel(frames: Mapping[str, pd.DataFrame], path: Path) -> bytes:
    """Return a workbook with a sheet a table; texts are texts, also those that look like formulas."""
    import pandas as pd  # noqa: PLC0415

    for name, frame in frames.items():
        if len(frame) > EXCEL_ROWS:
            raise BadInput(
                f"{len(frame)} {name} are more than the {EXCEL_ROWS} rows of a sheet",
                file=path,
                remedy="name a .parquet or .csv file",
            )
    book = io.BytesIO()  # where a disk is full, a workbook that is written to it fails once more when it goes
    with pd.ExcelWriter(book, engine="openpyxl") as writer:
        for name, frame in frames.items():
            texts = set(frame.select_dtypes(exclude=["number", "bool"]).columns)
            fit = frame.assign(**{column: frame[column].map(_fit_for_excel) for column in texts})
            fit.to_excel(writer, sheet_name=name, index=False, freeze_panes=(1, 1))
            for position, column in enumerate(frame.columns, 1):
                if column in texts:
                    _keep_texts(writer.sheets[name], position)
    return book.getvalue()


def _keep_texts(sheet: Any, position: int) -> None:
    """Turn what openpyxl takes for formulas in a column (from 1) back into texts."""
    for (cell,) in sheet.iter_rows(2, None, position, position):
        if cell.data_type == "f":
            cell.data_type = "s"


def _fit_for_excel(text: Any) -> Any:
    """Return a text as a cell can hold it: no control characters, and an end where it is too long."""
    if not isinstance(text, str):
        return text
    fit = _NOT_IN_EXCEL.sub("\ufffd", text)
    return fit if len(fit) <= EXCEL_CHARACTERS else f"{fit[: EXCEL_CHARACTERS - 1]}…"
