"""The matrix as a table: `python -m tests.peers.table [WORD…]` runs the cases whose names hold every word."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from tests.peers.building import build_c, build_go
from tests.peers.controllers import Case
from tests.peers.test_peers import SLOW, SPECIAL
from tests.peers.trials import Outcome, carried, kill_and_resume, run_campaign, run_check


def _tried(trial: Callable[[Case, Path, Path], Outcome], case: Case, program: Path, folder: Path) -> str:
    try:
        outcome = trial(case, program, folder)
    except AssertionError as error:
        return f"{str(error).splitlines()[0][:160]} | – | –"
    figures = outcome.figures + ("" if all(run.balanced for run in outcome.runs) else " UNBALANCED")
    why = (
        ""
        if outcome.exit_status == 0
        else " " + outcome.said.strip().splitlines()[-1][:200].replace("|", "/")
    )
    return f"{outcome.exit_status}{why} | {figures} | {'yes' if outcome.at_rest else 'NO'}"


def _checked(done: subprocess.CompletedProcess[str]) -> str:
    """Return the exit status, what the wire carries at most, and where it is a fault, which."""
    faults = [line.split()[1] for line in done.stdout.splitlines() if line.strip().startswith("FAULT")]
    return f"{done.returncode}{' ' if faults else ''}{', '.join(faults)} | {' | '.join(carried(done.stdout))}"


def main(words: list[str]) -> None:
    """Print a row for each case: exit statuses, samples, and whether it ended at rest."""
    print(
        "| case | check | a block | samples/s at most "
        "| campaign | produced / missed / recorded / lost | at rest "
        "| kill, resume | the same | at rest |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        programs = {"c": build_c(root), "go": build_go(root)}
        for i, case in enumerate(SLOW + SPECIAL):
            if not all(word in str(case) for word in words):
                continue
            program = programs[case.peer]
            checked = _checked(run_check(case, program, root / f"{i}-check"))
            ran = _tried(run_campaign, case, program, root / f"{i}-run")
            resumed = _tried(kill_and_resume, case, program, root / f"{i}-kill")
            print(f"| {case} | {checked} | {ran} | {resumed} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
