"""Targets that are files: an input is written, and its reader is called with the path."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from tests.fuzz.target import Case, Mutate

ROOT = Path(__file__).resolve().parents[3]
SAMPLES = ROOT / "sample_runs"


def of_file(
    name: str,
    corpus: Callable[[Path], Sequence[bytes]],
    read: Callable[[Path], object],
    mutate: Mutate,
    *,
    beside: Sequence[Path] = (),
) -> Callable[[Path], AbstractContextManager[Case]]:
    """Return how a target is begun whose inputs are files.

    Parameters
    ----------
    name : str
        Of the file.
    corpus : callable
        Gives the samples; may make them in the folder.
    read : callable
        Takes the path.
    mutate : callable
    beside : sequence of Path
        Files and folders that samples name, copied beside them.
    """

    @contextmanager
    def begin(folder: Path) -> Iterator[Case]:
        for one in beside:
            (shutil.copytree if one.is_dir() else shutil.copyfile)(one, folder / one.name)
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        samples = corpus(folder)

        def reader(content: bytes) -> object:
            path.unlink(missing_ok=True)
            path.write_bytes(content)
            return read(path)

        yield Case(samples, reader, mutate)

    return begin


def contents(*paths: Path) -> Callable[[Path], Sequence[bytes]]:
    """Return a corpus of files as they are."""
    return lambda _: [path.read_bytes() for path in paths]
