"""The demo, run once as a user runs it, and what it left behind; the command, in a process or in this one."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bufferstand.cli.main import main


def bufferstand(*words: str | Path, timeout_s: float = 900.0) -> subprocess.CompletedProcess[str]:
    """Run the command as a process of its own."""
    return subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


def here(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the command in this process, as its own would: where only words and status are looked at."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    status = ended.value.code
    assert isinstance(status, int)
    out.seek(0)
    err.seek(0)
    return subprocess.CompletedProcess(words, status, out.read(), err.read())


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
