"""The demo, run once as a user runs it, and what it left behind."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray


def bufferstand(*words: str | Path, timeout_s: float = 900.0) -> subprocess.CompletedProcess[str]:
    """Run the command as a process of its own."""
    return subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


@dataclass(frozen=True)
class Demo:
    """A finished demo."""

    folder: Path
    truth_file: Path
    process: subprocess.CompletedProcess[str]

    @cached_property
    def document(self) -> dict[str, Any]:
        return json.loads((self.folder / "evaluation.json").read_text())

    @cached_property
    def record(self) -> dict[str, Any]:
        return json.loads((self.folder / "campaign.json").read_text())

    @cached_property
    def truth(self) -> dict[str, NDArray[np.float64]]:
        with np.load(self.truth_file) as arrays:
            return {name: arrays[name] for name in arrays.files}

    def entry(self, start: str) -> dict[str, Any]:
        """Return the evaluation of the run whose id starts so."""
        (found,) = [run for run in self.document["runs"] if run["run"]["id"].startswith(start)]
        return found


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Demo:
    folder = tmp_path_factory.mktemp("main job") / "demo campaign"  # a space in the path, as users have
    truth = folder.parent / "truth.npz"
    process = bufferstand("demo", "--out", folder, "--truth", truth)
    assert process.returncode == 0, process.stderr
    return Demo(folder, truth, process)
