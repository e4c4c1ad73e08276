"""The public Python API: recorded runs and what they mean, as tables (docs/python-api.md).

What is listed here stays; later versions only add. Everything else of the packages may change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd

from bufferstand.evaluation.document.build import evaluate_file, evaluate_paths
from bufferstand.evaluation.document.tables import cycle_table
from bufferstand.evaluation.facts import DecisionRule, EvaluationDocument, Options, check_draws
from bufferstand.evaluation.record import channels_of_quantity
from bufferstand.foundation import BadInput
from bufferstand.recording.finding import facts_of, run_files
from bufferstand.recording.foreign import Imported, ImportOptions, import_file
from bufferstand.recording.runfile import Run, to_dataset, to_frame
from bufferstand.recording.runfile import open_run as _open_run

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "BadInput",
    "ImportOptions",
    "Imported",
    "Run",
    "before_after",
    "channels",
    "cycles",
    "dataset",
    "evaluate",
    "holds",
    "import_record",
    "loops",
    "open_run",
    "requirements",
    "residual_strokes",
    "runs",
    "settling",
    "summaries",
]

Paths = str | Path | Sequence[str | Path]


def open_run(path: str | Path) -> Run:
    """Open a run file that is whole and unaltered.

    Raises
    ------
    BadInput
        If it is no run file, of a newer format, or damaged.
    """
    return _open_run(Path(path))


def runs(paths: Paths) -> pd.DataFrame:
    """Return the key facts of run files, and of all in folders: a row a run.

    Parameters
    ----------
    paths : path, or sequence of paths
        Run files and folders.

    Returns
    -------
    pandas.DataFrame
        Columns ``path``, ``id``, ``kind``, ``status``, ``started_utc``, ``specimen_id``, ``step``,
        ``prestress_mm``, ``amplitude_mm``, ``frequency_Hz``, ``sha256``, ``problem`` (why a file could not
        be read, else missing).

    Raises
    ------
    BadInput
        If a path does not exist, or a folder holds no run file.
    """
    rows = [asdict(facts_of(path)) for path in run_files(paths_of(paths))]
    table = pd.DataFrame(rows)
    return table.assign(path=table["path"].map(str))


def channels(run: str | Path | Run, stream: str | None = None) -> pd.DataFrame:
    """Return the samples of a run as a table (:func:`bufferstand.recording.runfile.data_frames.to_frame`).

    Raises
    ------
    BadInput
        As :func:`open_run`, or if there is no such stream.
    """
    return to_frame(run if isinstance(run, Run) else open_run(run), stream)


def signals(run: str | Path | Run, quantity: str) -> dict[str, pd.Series]:
    """Return the channels of a run that measure a quantity: “pressure”, “acceleration”, “force” …

    Returns
    -------
    dict of str to pandas.Series
        By the channel's name: values in the unit of the quantity (``attrs["unit"]``; kN, mm, mm/s, °C, bar,
        m/s²), the index ``time_s`` with the channel's delay taken off [s]. Empty where none measures it.

    Raises
    ------
    BadInput
        As :func:`open_run`, or if there is no such quantity.
    """
    found = {}
    for one in channels_of_quantity(run if isinstance(run, Run) else open_run(run), quantity):
        series = pd.Series(one.value, index=pd.Index(one.time_s, name="time_s"), name=one.name)
        series.attrs |= {"unit": one.unit, "place": one.place}
        found[one.name] = series
    return found


def dataset(run: str | Path | Run) -> xr.Dataset:
    """Return all channels of a run as an xarray dataset
    (:func:`bufferstand.recording.runfile.data_frames.to_dataset`).

    Raises
    ------
    BadInput
        As :func:`open_run`, or if xarray is not installed.
    """
    return to_dataset(run if isinstance(run, Run) else open_run(run))


def evaluate(
    paths: Paths,
    *,
    decision_rule: DecisionRule = "simple",
    draws: int = Options.draws,
    conformity: Sequence[str] = (),
) -> EvaluationDocument:
    """Evaluate run files and folders into the evaluation document (docs/evaluation-document.md).

    Parameters
    ----------
    paths : path, or sequence of paths
    decision_rule : "simple" or "guard-band"
    draws : int
        Monte Carlo draws a run; 0: no uncertainties.
    conformity : sequence of str
        Runs that are the conformity test of their specimen, by id or path; else what their campaign says, or
        the first static run of a specimen that meets the conditions.

    Raises
    ------
    BadInput
        If a run cannot be evaluated, ``conformity`` names none of them, or so few draws tell no uncertainty.
    """
    options = Options(decision_rule=decision_rule, draws=check_draws(draws))
    return evaluate_paths(paths_of(paths), options, conformity=conformity)


def cycles(evaluation: EvaluationDocument | Paths) -> pd.DataFrame:
    """Return a row a cycle with all its figures, units in their names.

    Parameters
    ----------
    evaluation : dict, path, or sequence of paths
        What :func:`evaluate` gave; or runs, which are evaluated first.

    Raises
    ------
    BadInput
        As :func:`evaluate`.
    """
    return cycle_table(evaluation if isinstance(evaluation, dict) else evaluate(evaluation))


def requirements(evaluation: EvaluationDocument | Paths) -> pd.DataFrame:
    """Return a row a requirement with its limits, measured value, uncertainty and verdict.

    Raises
    ------
    BadInput
        As :func:`evaluate`.
    """
    document = evaluation if isinstance(evaluation, dict) else evaluate(evaluation)
    return pd.DataFrame(
        [
            {"run": entry["run"]["id"], **requirement}
            for entry in document["runs"]
            for requirement in entry["requirements"]
        ]
    )


def summaries(evaluation: EvaluationDocument | Paths) -> pd.DataFrame:
    """Return a row a run with the means that stand for it; of a run with several steps a row a step.

    Parameters
    ----------
    evaluation : dict, path, or sequence of paths
        What :func:`evaluate` gave; or runs, which are evaluated first.

    Returns
    -------
    pandas.DataFrame
        Columns ``run``, ``part`` (number of the step; missing where the run is one), ``start_s``, ``end_s``
        (of the step), ``cycles_used`` (how many), the means by their names, ``U(…)`` of each.

    Raises
    ------
    BadInput
        As :func:`evaluate`.
    """
    document = evaluation if isinstance(evaluation, dict) else evaluate(evaluation)
    rows: list[dict[str, Any]] = []
    for entry in document["runs"]:
        parts: Sequence[Mapping[str, Any]] = entry["steps"] or [{"summary": entry["summary"]}]
        for part in parts:
            means = {name: mean for name, mean in part["summary"].items() if name != "cycles_used"}
            rows.append(
                {
                    "run": entry["run"]["id"],
                    "part": part.get("index"),
                    "start_s": part.get("start_s"),
                    "end_s": part.get("end_s"),
                    "cycles_used": len(part["summary"]["cycles_used"]),
                    **{name: mean["value"] for name, mean in means.items()},
                    **{f"U({name})": mean["expanded_uncertainty"] for name, mean in means.items()},
                }
            )
    table = pd.DataFrame(rows)
    texts = {"run": "object", "part": "Int64", "cycles_used": "int64"}
    return table.astype({name: texts.get(name, "float64") for name in table.columns})


def holds(evaluation: EvaluationDocument | Paths) -> pd.DataFrame:
    """Return a row a hold at an upper turning point: what relaxed or crept, and by how much a decade of time.

    Parameters
    ----------
    evaluation : dict, path, or sequence of paths
        What :func:`evaluate` gave; or runs, which are evaluated first.

    Returns
    -------
    pandas.DataFrame
        Columns ``run``, ``cycle``, ``kind``, ``start_s``, ``duration_s``, force and stroke at start and end,
        and of each what changes a decade with its U(…).

    Raises
    ------
    BadInput
        As :func:`evaluate`.
    """
    slopes = ("force_per_decade_kN", "stroke_per_decade_mm")
    rows = []
    for row in _of_runs(evaluation, "holds"):
        flat = {name: value for name, value in row.items() if name not in slopes}
        for name in slopes:
            flat |= {name: row[name]["value"], f"U({name})": row[name]["expanded_uncertainty"]}
        rows.append(flat)
    return pd.DataFrame(rows)


def residual_strokes(evaluation: EvaluationDocument | Paths) -> pd.DataFrame:
    """Return a row a stroke that ends in a pause: what stays of it, and what the pause takes back [mm].

    Raises
    ------
    BadInput
        As :func:`evaluate`.
    """
    return pd.DataFrame(_of_runs(evaluation, "residual_strokes"))


def settling(evaluation: EvaluationDocument | Paths) -> pd.DataFrame:
    """Return a row a run (or step of it, ``part``) and quantity: how it changes over the complete cycles.

    Raises
    ------
    BadInput
        As :func:`evaluate`.
    """
    return pd.DataFrame(_of_runs(evaluation, "settling"))


def before_after(evaluation: EvaluationDocument | Paths) -> pd.DataFrame:
    """Return a row a figure of each run whose step its specimen went through before, against the first time.

    Returns
    -------
    pandas.DataFrame
        Columns ``specimen``, ``kind``, ``run``, ``reference`` (the first run), ``quantity``, ``before``,
        ``after``, ``change``, ``relative_change``, ``expanded_uncertainty``, ``coverage_factor``,
        ``half_width_95``, ``beyond`` (whether the change is greater than U).

    Raises
    ------
    BadInput
        As :func:`evaluate`.
    """
    document = evaluation if isinstance(evaluation, dict) else evaluate(evaluation)
    return pd.DataFrame(
        [
            {
                "specimen": entry["specimen"],
                "kind": entry["kind"],
                "run": after["run"],
                "reference": entry["before"]["run"],
                "quantity": quantity,
                **change,
            }
            for entry in document["before_after"]
            for after in entry["after"]
            for quantity, change in after["changes"].items()
        ]
    )


def _of_runs(
    evaluation: EvaluationDocument | Paths, key: Literal["holds", "residual_strokes", "settling"]
) -> list[dict[str, Any]]:
    document = evaluation if isinstance(evaluation, dict) else evaluate(evaluation)
    return [{"run": run["run"]["id"], **entry} for run in document["runs"] for entry in run[key]]


def loops(path: str | Path) -> pd.DataFrame:
    """Return stroke and force as the evaluation works on them: delays taken off, at common instants.

    Returns
    -------
    pandas.DataFrame
        Columns ``time_s``, ``stroke_mm`` (mean of the draw wires), ``force_kN``, ``cycle`` (from 1; 0 outside
        of cycles), ``complete``, ``steady`` (of that cycle). A long run is averaged over blocks
        (docs/evaluation-document.md).

    Raises
    ------
    BadInput
        If the run cannot be evaluated.
    """
    result = evaluate_file(Path(path), Options(draws=0))
    record = result.record
    number = np.zeros(record.time_s.size, dtype=np.int64)
    flags = {"complete": np.zeros(number.size, dtype=bool), "steady": np.zeros(number.size, dtype=bool)}
    for item in result.cycles:
        inside = (record.time_s >= item.cycle.start_s) & (record.time_s < item.cycle.end_s)
        number[inside] = item.cycle.index
        flags["complete"][inside] = item.cycle.complete
        flags["steady"][inside] = item.cycle.steady
    return pd.DataFrame(
        {
            "time_s": record.time_s,
            "stroke_mm": record.stroke_mm,
            "force_kN": record.force_kN,
            "cycle": number,
            **flags,
        }
    )


def import_record(path: str | Path, out: str | Path, options: ImportOptions | None = None) -> Imported:
    """Import a foreign record as a run file into the folder ``out`` (docs/import.md).

    Raises
    ------
    BadInput
        If it cannot be read without guessing.
    """
    return import_file(Path(path), Path(out), options)


def paths_of(paths: Paths) -> list[Path]:
    """Return one path or several as a list."""
    return [Path(paths)] if isinstance(paths, str | Path) else [Path(path) for path in paths]
