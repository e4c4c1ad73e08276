"""What the commands do, for scripts: report, compare, fit a model, plan and run a campaign.

The package's door hands these on (``import bufferstand as bs``, docs/python-api.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bufferstand.cli.campaign import consent_to_move, demand_begun_anew, perform, prepare
from bufferstand.cli.model import read_runs, settings_of, sittings
from bufferstand.daq.campaign import CampaignOutcome
from bufferstand.daq.campaign_folder import load_record
from bufferstand.evaluation.archive import EvaluationComparison, compare_evaluations, load_evaluation
from bufferstand.evaluation.document import Paths, paths_of
from bufferstand.evaluation.report import formats_here
from bufferstand.evaluation.report import write_comparison as write_comparison_report
from bufferstand.evaluation.report import write_report as write_run_report
from bufferstand.foundation import BadInput
from bufferstand.model.identification import Identification, identify
from bufferstand.protocols.planning import Plan


def write_report(paths: Paths, out: str | Path) -> list[Path]:
    """Write the test report of a run or a campaign, or of several side by side, as ``bufferstand report``.

    Parameters
    ----------
    paths : path, or sequence of paths
        Run files or campaign folders; of two or more, the first is the reference.
    out : path
        Folder for the report.

    Returns
    -------
    list of Path
        The files written: HTML, and PDF where typst is installed.

    Raises
    ------
    BadInput
        If there is no run, or one cannot be evaluated.
    """
    sources = _some(paths)
    if len(sources) > 1:
        return write_comparison_report(sources, Path(out), formats=formats_here())
    return write_run_report(sources[0], Path(out), formats=formats_here())


def compare(
    old: Mapping[str, Any] | str | Path, new: Mapping[str, Any] | str | Path, *, cycles: bool = False
) -> EvaluationComparison:
    """Return what moved between two evaluations, as ``bufferstand compare``.

    Parameters
    ----------
    old, new : dict or path
        What ``evaluate`` gave, or a file of ``bufferstand evaluate --json``.
    cycles : bool
        Compare every cycle, too, not only the means of the runs.

    Raises
    ------
    BadInput
        If a file is no evaluation.
    """
    return compare_evaluations(_evaluation(old), _evaluation(new), cycles=cycles)


def fit_model(paths: Paths, *, ambient_C: float | None = None, name: str | None = None) -> Identification:
    """Identify the spring model from static and harmonic runs of one specimen, as ``bufferstand model fit``.

    Parameters
    ----------
    paths : path, or sequence of paths
        Run files and folders.
    ambient_C : float, optional
        Temperature of the air [°C]; that of the run's own sensor if not given.
    name : str, optional
        Name of the model; the specimen's id if not given.

    Returns
    -------
    Identification
        The model, every parameter with its interval, and what the runs do not tell.

    Raises
    ------
    BadInput
        If the runs are of several specimens, or do not tell a spring.
    """
    runs = read_runs(_some(paths), ambient_C)
    return identify(sittings(runs), settings_of(runs, name))


def plan_campaign(campaign: str | Path) -> Plan:
    """Return the plan of a campaign file: every step with force, heat, temperature, duration and disk.

    Raises
    ------
    BadInput
        If a file cannot be read or breaks its schema, or a step breaks a limit.
    """
    return prepare(Path(campaign)).plan


def run_campaign(
    campaign: str | Path,
    out: str | Path,
    *,
    simulate: bool = False,
    speed: float = 1.0,
    yes_move: str | None = None,
) -> CampaignOutcome:
    """Run a campaign, as ``bufferstand run``; from the main thread only, because it catches signals.

    Parameters
    ----------
    campaign : path
        The campaign file.
    out : path
        Folder of the campaign; it must not hold one that has recorded something.
    simulate : bool
        On a simulated stand that is started for it.
    speed : float
        Stand time in multiples of real time; only a simulated stand can be faster than 1.
    yes_move : str, optional
        The specimen's id: without it, no real stand moves.

    Returns
    -------
    CampaignOutcome
        How it ended, and its runs.

    Raises
    ------
    BadInput
        If a file is wrong, a step breaks a limit, ``out`` holds a campaign, or consent to move is missing.
    """
    prepared = prepare(Path(campaign))
    folder = Path(out)
    if (record := load_record(folder)) is not None:
        demand_begun_anew(record, folder, simulate=simulate)
    if not simulate and yes_move is None:
        raise BadInput(
            "a real stand moves only once the specimen's id was given",
            remedy="see that the right specimen is in place, then give its id as yes_move",
        )
    consent = consent_to_move(prepared, folder, None, simulate=simulate, speed=speed, yes_move=yes_move)
    return perform(prepared, folder, simulate=simulate, speed=speed, consent=consent)


def _some(paths: Paths) -> list[Path]:
    found = paths_of(paths)
    if not found:
        raise BadInput("no run was given", remedy="give run files or folders")
    return found


def _evaluation(given: Mapping[str, Any] | str | Path) -> Mapping[str, Any]:
    return given if isinstance(given, Mapping) else load_evaluation(Path(given))
