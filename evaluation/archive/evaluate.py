"""Evaluates an archive: known results come from the cache, the rest is computed here or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

from bufferstand.evaluation.across_runs import Copy, each_once
from bufferstand.evaluation.across_runs.conformity import Decided, decide_purposes
from bufferstand.evaluation.archive.cache import Cache
from bufferstand.evaluation.archive.settings_and_software import (
    EvaluationSettings,
    Software,
    settings_entry,
    software,
)
from bufferstand.evaluation.archive.stored_run import RequestedParts, StoredRun
from bufferstand.evaluation.archive.tasks import File, Outcome
from bufferstand.evaluation.document import SCHEMA, what_runs_say_together
from bufferstand.foundation.files import readable
from bufferstand.recording.finding import Stamp, stamp_of

_EVERYTHING = RequestedParts()
_KEEP_EVERY = 50
"""Results are kept this many at a time: what is lost if the evaluation is killed."""


class Workers(Protocol):
    """Who evaluates: the cores of this machine, or a cluster."""

    def evaluate(self, files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
        """Evaluate files and yield what became of each, in any order, under the path it was given."""
        ...


@dataclass(frozen=True)
class Failure:
    """A file that could not be evaluated, and why."""

    path: str
    problem: str
    lost: bool = False
    """Whether the process that evaluated it died of it."""


@dataclass(frozen=True)
class ArchiveProgress:
    """How far an evaluation is."""

    done: int
    total: int
    reused: int
    failed: int


@dataclass(frozen=True)
class ArchiveEvaluation:
    """All runs of an archive, in the order in which they were named.

    Attributes
    ----------
    runs : tuple of KeptRun
    failures : tuple of Failure
        Files that could not be evaluated.
    settings : Settings
    software : Software
    reused : int
        Runs that were known from before.
    conformity : tuple of str
        Runs that the user names as conformity tests, by id or path.
    copies : tuple of Copy
        Files that hold the recording of another one: it is among ``runs`` once.
    warnings : tuple of str
        What is to be said of copies.
    """

    runs: tuple[StoredRun, ...]
    failures: tuple[Failure, ...]
    settings: EvaluationSettings
    software: Software
    reused: int = 0
    conformity: tuple[str, ...] = ()
    copies: tuple[Copy, ...] = ()
    warnings: tuple[str, ...] = ()

    @cached_property
    def decided(self) -> Decided:
        """What each run is for.

        Raises
        ------
        BadInput
            If ``conformity`` names a run that is none of them, or can be no conformity test.
        """
        return decide_purposes([run.candidate for run in self.runs], self.conformity)

    @cached_property
    def settings_entry(self) -> dict[str, Any]:
        """Settings with the runs that the user named, and their hash, as document and tables state it."""
        return settings_entry(self.settings.content, self.decided.named)

    def head(self) -> dict[str, Any]:
        """Return the keys of the evaluation document that come before its runs."""
        return {"schema": SCHEMA, "software": self._software()}

    @cached_property
    def tail(self) -> dict[str, Any]:
        """The keys of the evaluation document that come after its runs."""
        together = what_runs_say_together([run.light() for run in self.runs])
        return {
            **together,
            "warnings": [*self.warnings, *together["warnings"]],
            "copies": [copy.entry() for copy in self.copies],
            "decision_rule": self.settings.options.decision_rule,
            "conformity": [statement.entry() for statement in self.decided.statements],
            "settings": self.settings_entry,
            "failures": [{"path": failure.path, "problem": failure.problem} for failure in self.failures],
        }

    def _software(self) -> dict[str, Any]:
        own = self.software
        return {
            "version": own.version,
            "code_sha256": own.code_sha256,
            "python": own.python,
            "libraries": dict(own.libraries),
        }


def evaluate_archive(
    files: Sequence[Path],
    settings: EvaluationSettings,
    workers: Workers,
    cache: Cache | None = None,
    *,
    wanted: RequestedParts = _EVERYTHING,
    conformity: Sequence[str] = (),
    report: Callable[[ArchiveProgress], None] = lambda _: None,
) -> ArchiveEvaluation:
    """Evaluate run files.

    Parameters
    ----------
    files : sequence of Path
    settings : Settings
    workers : Workers
        :class:`bufferstand.evaluation.archive.local_workers.LocalWorkers` or
        :class:`bufferstand.evaluation.archive.dask_cluster.ClusterWorkers`.
    cache : Cache, optional
        What is known already; without one everything is evaluated.
    wanted : Wanted
        What will be asked for; trends and comparisons do without any of it.
    conformity : sequence of str
        Runs that are the conformity test of their specimen, by id or path.
    report : callable
        Told of the progress.

    Returns
    -------
    ArchiveEvaluation
        The same whoever worked, and whatever the cache knew.

    Raises
    ------
    BadInput, DeviceFault
        If the workers cannot be reached or used, or ``conformity`` names none of the runs. A file that cannot
        be evaluated is a failure in the result.
    """
    kept = _Kept(cache, {str(path): stamp_of(path) for path in files})
    found = _known([(path, kept.stamps[str(path)]) for path in files], cache, wanted)
    failed: dict[str, Failure] = {}
    reused = len(found)

    def tell() -> None:
        report(ArchiveProgress(len(found) + len(failed), len(files), reused, len(failed)))

    left = []
    for path in files:
        stamp = kept.stamps[str(path)]
        if stamp is None:
            failed[str(path)] = Failure(readable(path), "no such file; check the path, or renew the list")
        elif str(path) not in found:
            left.append(File(str(path), stamp.size))
    tell()
    try:
        for outcome in workers.evaluate(left, settings):
            if outcome.run is None:
                failed[outcome.path] = Failure(readable(outcome.path), outcome.problem, outcome.lost)
            else:
                kept.add(outcome.path, outcome.run)
                found[outcome.path] = outcome.run.with_only(wanted)
            tell()
    finally:
        kept.flush()
    names = [str(path) for path in files]
    runs = [found[name] for name in names if name in found]
    told = each_once([run.recording for run in runs])
    evaluation = ArchiveEvaluation(
        runs=tuple(runs[place] for place in told.kept),
        failures=tuple(failed[name] for name in names if name in failed),
        settings=settings,
        software=software(),
        reused=reused,
        conformity=told.counted(conformity),
        copies=told.copies,
        warnings=told.warnings,
    )
    _ = evaluation.decided  # what the user named must be there before anything is written
    return evaluation


def _known(
    stamps: Sequence[tuple[Path, Stamp | None]], cache: Cache | None, wanted: RequestedParts
) -> dict[str, StoredRun]:
    if cache is None:
        return {}
    contents = cache.known_contents(stamps)
    found = {}
    for path, content in contents.items():
        run = cache.find(str(path), content, wanted)
        if run is not None:
            found[str(path)] = run
    return found


class _Kept:
    """Results on their way into the cache."""

    def __init__(self, cache: Cache | None, stamps: dict[str, Stamp | None]) -> None:
        self._cache = cache
        self.stamps = stamps
        """Taken before anything is read: a file that changes meanwhile will not have its stamp any more."""
        self._results: list[tuple[Path, Stamp | None, StoredRun]] = []

    def add(self, path: str, run: StoredRun) -> None:
        """Take a result."""
        if self._cache is None:
            return
        self._results.append((Path(path), self.stamps.get(path), run))
        if len(self._results) >= _KEEP_EVERY:
            self.flush()

    def flush(self) -> None:
        """Write what was taken."""
        if self._cache is not None and self._results:
            self._cache.remember(self._results)
        self._results = []
