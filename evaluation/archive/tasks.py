"""A task for one process, here or on a cluster: a handful of files in, small results out.

A task has paths, never arrays, and no effect but its result: it may be done twice.
"""

from __future__ import annotations

import hashlib
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings, Software, software
from bufferstand.evaluation.archive.stored_run import StoredRun, keep
from bufferstand.evaluation.document import evaluate_file
from bufferstand.evaluation.run import collecting_later
from bufferstand.foundation import BadInput
from bufferstand.recording.runfile import USER_BLOCK_BYTES

MOST_FILES = 10
"""Files of one task: enough that handing it out costs nothing, few enough to lose with a worker, and that no
worker waits long for the last task of another …"""
MOST_BYTES = 32_000_000
"""… and no more bytes than this, but for a file that is larger alone."""


@dataclass(frozen=True)
class File:
    """A file to evaluate.

    Attributes
    ----------
    path : str
        For the process that reads it.
    size : int
        In bytes.
    mark : str
        What it is as :func:`mark_of` sees it where it was asked for; empty where the same machine reads it.
    """

    path: str
    size: int
    mark: str = ""


@dataclass(frozen=True)
class Outcome:
    """What became of a file: a result, or the reason why there is none."""

    path: str
    run: StoredRun | None
    problem: str = ""
    lost: bool = False
    """Whether the process that evaluated it died of it."""


class OtherSoftware(Exception):  # noqa: N818 - it names the fact
    """This process would evaluate with other software than it was asked to."""


class OtherFile(Exception):  # noqa: N818 - it names the fact
    """This process sees another file, or none, under the path of one that it was asked to evaluate.

    Parameters
    ----------
    path : str
    """

    def __init__(self, path: str) -> None:
        self.path = path
        super().__init__(path)


def mark_of(path: str) -> str:
    """Return what tells a file from others: its size, and the hash of what it begins with.

    A run file begins with the hash of all its bytes.

    Returns
    -------
    str
        Empty if the file cannot be read.
    """
    try:
        with Path(path).open("rb") as stream:
            size = stream.seek(0, 2)
            stream.seek(0)
            return f"{size} bytes, {hashlib.sha256(stream.read(USER_BLOCK_BYTES)).hexdigest()}"
    except OSError:
        return ""


def difference_of(file: File) -> str:
    """Return how a file differs here from where it was asked for, in words; nothing where it is the same."""
    if not file.mark or (seen := mark_of(file.path)) == file.mark:
        return ""
    return "sees another file under this path" if seen else "sees no such file, or may not read it"


def evaluate_batch(files: Sequence[File], settings: EvaluationSettings, asked: Software) -> list[Outcome]:
    """Evaluate files one after the other; what is wrong with one is its outcome and does not stop the rest.

    Parameters
    ----------
    files : sequence of File
    settings : Settings
    asked : Software
        That of the process that will use the results.

    Raises
    ------
    OtherSoftware
        If this process has other software; the text says which.
    OtherFile
        If it sees one of the files otherwise than who asked.
    """
    if difference := asked.difference(software()):
        raise OtherSoftware(difference)
    for file in files:
        if difference_of(file):
            raise OtherFile(file.path)
    return [_evaluate(file.path, settings) for file in files]


def _evaluate(path: str, settings: EvaluationSettings) -> Outcome:
    try:
        with collecting_later():
            return Outcome(path, keep(evaluate_file(Path(path), settings.options, settings.limit_set)))
    except BadInput as error:
        return Outcome(path, None, what_is_wrong(error))
    except MemoryError:
        return Outcome(
            path, None, "not enough memory to evaluate it; use fewer jobs (--jobs), a larger machine"
        )
    except Exception as error:  # noqa: BLE001 - one file of thousands must not stop the others
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}, line {last.lineno}"
        what = f"{type(error).__name__}: {error} ({where})"
        return Outcome(path, None, f"a bug of bufferstand; please report it with the file: {what}")


def what_is_wrong(error: BadInput) -> str:
    """Return the message of a refusal without the file, which is named apart from it."""
    return BadInput(error.problem, place=error.place, remedy=error.remedy).message()


def batches(files: Sequence[File], workers: int) -> list[list[File]]:
    """Return files in tasks, the largest first, so that no worker waits for another's last one.

    Several tasks a worker, as their pace differs.
    """
    most = max(1, min(MOST_FILES, len(files) // (4 * workers)))
    return sorted(_cut(files, most), key=lambda batch: -sum(file.size for file in batch))


def _cut(files: Sequence[File], most: int) -> Iterator[list[File]]:
    batch: list[File] = []
    for file in files:
        if batch and (len(batch) >= most or sum(f.size for f in batch) + file.size > MOST_BYTES):
            yield batch
            batch = []
        batch.append(file)
    if batch:
        yield batch
