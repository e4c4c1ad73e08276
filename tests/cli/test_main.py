"""What the command sees to before anything else."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

_TOLD = """
import os
from cli.main import main
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
