"""A day of campaigns in one process, in virtual time, on the in-process stand."""

from __future__ import annotations

import gc
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.common.processes import forget_peak, holds, peak_MB
from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.evaluation.document import evaluate_file
from bufferstand.protocols.planning.plan import Plan
from bufferstand.recording.runfile import open_run
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.soak.curves import Curves

S_PER_H = 3600.0
LIMITS = {
    "memory_MB": 1.05,
    "peak_MB": 1.05,
    "handles": 1.0,
    "threads": 1.0,
    "processes": 1.0,
    "run_file_bytes_a_sample": 1.02,
    "other_bytes_a_campaign": 1.02,
    "temporary_files": 1.0,
}
"""What is flat: the largest ratio of the last quarter to the second."""


def campaigns(
    file: Path, hours: float, tell: Callable[[str], object], save: Callable[[Curves], object]
) -> Curves:
    """Run a campaign over and over, evaluate its runs, and look at what the process holds after each.

    Parameters
    ----------
    file : Path
        The campaign.
    hours : float
        How long, in hours of the stand.
    tell, save : callable
        Get a line, and the curves until now, after each campaign: a soak may be interrupted.
    """
    plan = sample_plan(file)[0]
    curves = Curves()
    done_h = 0.0
    with _own_temporary_folder() as temporary:
        while done_h < hours:
            forget_peak()
            took_h, sizes = _one(file, plan, temporary)
            done_h += took_h
            gc.collect()
            left = {"temporary_files": float(len(list(temporary.iterdir())))}
            curves.add(done_h, {**holds(os.getpid()), "peak_MB": peak_MB(), **sizes, **left})
            save(curves)
            now = {name: looks[-1] for name, looks in curves.values.items()}
            tell(f"{done_h:6.2f} h: " + ", ".join(f"{name} {value:.6g}" for name, value in now.items()))
    return curves


def _one(file: Path, plan: Plan, temporary: Path) -> tuple[float, dict[str, float]]:
    """Run the campaign once; return the hours it took, and how large its files are."""
    stand_file = sample_plan(file)[1]
    out = temporary / "campaign"
    opened = open_in_process(stand_file, log_truth=False)
    began_s = opened.clock.now_s()
    outcome = run_campaign(plan, opened.stand, opened.clock, out, facts_of(stand_file), settings=COARSE)
    took_h = (opened.clock.now_s() - began_s) / S_PER_H
    if outcome.status not in ("complete", "stopped"):
        raise RuntimeError(f"the campaign is {outcome.status}: {outcome.reason}")
    run_files = sorted((out / "runs").glob("*.h5"))
    samples = 0
    for one in run_files:
        evaluate_file(one)
        samples += open_run(one).streams["controller"].rows
    run_bytes = sum(one.stat().st_size for one in run_files)
    all_bytes = sum(one.stat().st_size for one in out.rglob("*") if one.is_file())
    shutil.rmtree(out)
    return took_h, {
        "run_file_bytes_a_sample": run_bytes / samples,
        "other_bytes_a_campaign": float(all_bytes - run_bytes),
    }


@contextmanager
def _own_temporary_folder() -> Iterator[Path]:
    """While inside, all temporary files of this process go to a folder of its own, where they are counted."""
    before = tempfile.tempdir
    with tempfile.TemporaryDirectory() as folder:
        tempfile.tempdir = folder
        try:
            yield Path(folder)
        finally:
            tempfile.tempdir = before
