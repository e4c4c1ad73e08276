"""Read every dataset of a folder's runs with bare h5py in so many processes: ``bare_h5py.py FOLDER JOBS``.

The other side of :mod:`benchmarks.archive`. It is run by its path and imports nothing of this project, so
that it is no slower than a user's own script.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import h5py


def read(paths: Sequence[str]) -> int:
    """Open files and read every dataset; return how many bytes they are in memory."""
    size = 0

    def visit(_: str, item: object) -> None:
        nonlocal size
        if isinstance(item, h5py.Dataset):
            size += item[()].nbytes

    for path in paths:
        with h5py.File(path, "r") as tree:
            tree.visititems(visit)
    return size


def main(folder: str, jobs: int) -> None:
    """Read all runs of a folder, a few files to a task."""
    paths = [str(path) for path in sorted(Path(folder).rglob("*.h5"))]
    parts = [paths[first : first + 25] for first in range(0, len(paths), 25)]
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        print(sum(pool.map(read, parts)))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
