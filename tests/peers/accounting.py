"""Every sample that a controller made is in a run file, with its own counts, or is counted as lost there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from bufferstand.recording.runfile.file import open_run
from tests.peers.controllers import CHANNELS


@dataclass(frozen=True)
class Account:
    """What became of the samples between the first and the last of a run file."""

    produced: int  # by the controller's own truth
    missed: int  # control cycles that the controller left out: there is no sample
    recorded: int
    lost: int  # as counted in the run file

    @property
    def balanced(self) -> bool:
        """Say whether nothing vanished in silence, and nothing was made up."""
        return self.produced + self.missed == self.recorded + self.lost


def account(path: Path, truth: NDArray[np.void]) -> Account:
    """Hold a run file against the truth of one boot of the controller, bit for bit.

    Samples are matched by the controller's time stamps (lower 32 bits), unique within 71 minutes.
    """
    run = open_run(path)
    lost = sum(n for _, n in run.gaps("controller"))
    with h5py.File(path) as file:
        stream = file["entry/controller"]
        ticks = stream["time_us"][:].astype(np.int64)
        counts = {name: stream[name][:].astype(np.int64) for name in CHANNELS}
    assert np.all(np.diff(ticks) > 0), f"{path.name}: a sample was doubled or stands in the wrong order"
    at = {int(tick): i for i, tick in enumerate(truth["tick_us"])}
    assert len(at) == len(truth)
    rows = np.array([at.get(int(tick % 2**32), -1) for tick in ticks])
    assert np.all(rows >= 0), f"{path.name}: samples that the controller never made"
    for name, recorded in counts.items():
        true = truth[name][rows].astype(np.int64)
        assert np.array_equal(recorded, true), f"{path.name}: {name} is not what the controller measured"
    first, last = int(rows[0]), int(rows[-1])
    return Account(
        produced=last - first + 1,
        missed=int((truth["missed"][last] - truth["missed"][first]) & 0xFFFF),
        recorded=len(rows),
        lost=lost,
    )


def accounts(folder: Path, truth: NDArray[np.void]) -> list[Account]:
    """Give the account of each run file of a campaign."""
    paths = sorted((folder / "runs").glob("*.h5"))
    assert paths, "nothing was recorded"
    return [account(path, truth) for path in paths]
