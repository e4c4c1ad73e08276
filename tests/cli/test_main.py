"""What the command sees to before anything else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

_TOLD = """
import os
from bufferstand.cli.main import main
try:
    main(["--version"])
finally:
    print(os.environ["OPENBLAS_NUM_THREADS"])
"""


@pytest.mark.parametrize("threads", ["2", ""])
def test_linear_algebra_has_one_thread_whatever_the_user_has_set(threads: str) -> None:
    """Sums differ in the last bit with their number, and results are kept."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": threads}
    told = subprocess.run(
        [sys.executable, "-P", "-c", _TOLD], env=environment, capture_output=True, text=True, check=True
    )
    assert told.stdout.splitlines()[-1] == "1"


@pytest.mark.parametrize("arguments", [["--help"], ["plan", "--help"], ["runs", "sample_runs/runs"]])
def test_a_reader_that_has_gone_is_no_failure(arguments: list[str]) -> None:
    """Status 1 is that of a specimen that failed (docs/commands.md)."""
    with subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
    ) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert (process.stderr.read(), process.wait()) == (b"", 0)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("arguments", [["plan", "--help"], ["runs", "sample_runs/runs", "--json", "-"]])
def test_an_output_that_takes_no_more_is_said_in_one_line(arguments: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-P", "-m", "bufferstand", *arguments],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            cwd=ROOT,
        )
    assert done.returncode == 2
    assert done.stderr.startswith("bufferstand: standard output: cannot be written: No space left")
    assert done.stderr.count("\n") == 1
