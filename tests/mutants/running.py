"""Try mutants of a module against its tests.

Three kinds of process: this one never imports what is mutated; a child of it imports the module and collects
its tests once, looks which test runs which lines, and forks a child for each mutant inside a function;
a mutant of what is run at import gets a child of a third, which imports what uses it with it.
"""

from __future__ import annotations

import importlib
import importlib.machinery
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.mutants.generating import ROOT, Mutant
from tests.mutants.in_place import InPlace
from tests.mutants.processes import Work, in_processes
from tests.mutants.testing import NoShrinking, first_failed, use_folder, what_each_runs

BUDGET_S = 8.0
"""Of the tests that run a mutant's line, the quickest so many seconds of processor time are run."""
TIMES, AND_S = 4.0, 2.0
"""With a mutant each test may take so many times what it took without, and so many seconds more."""
QUIET = (
    *("-q", "-s", "-p", "no:cacheprovider", "-m", "not slow and not long"),
    *("-W", "ignore::pytest.PytestAssertRewriteWarning"),
)


@dataclass(frozen=True)
class Outcome:
    """What became of a mutant.

    Parameters
    ----------
    mutant : Mutant
        It.
    ended : str
        ``killed``, ``timed out`` (which counts as killed) or ``survived``.
    by : str
        The test that failed; of a survivor how many tests it survived.
    """

    mutant: Mutant
    ended: str
    by: str


class CannotTry(Exception):  # noqa: N818 - it names the fact
    """The tests do not pass, or there are none, without any mutant."""


@dataclass(frozen=True)
class _Test:
    name: str
    lines: frozenset[int]
    cpu_s: float
    wall_s: float


class _Engine:
    """A plugin in the place of pytest's own loop: tries the mutants that can be put in place."""

    def __init__(self, module: str, mutants: Sequence[Mutant], jobs: int) -> None:
        self._module, self._mutants, self._jobs = module, mutants, jobs
        self.said: dict[str, Any] = {"problem": "nothing was collected"}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.said = self._all(session)
        return True

    def _all(self, session: pytest.Session) -> dict[str, Any]:
        if session.testsfailed or not session.items:
            return {"problem": "its tests cannot be collected"}
        file = _file(self._module)
        items = {item.nodeid: item for item in session.items}
        chunks = _chunks(list(items.values()), self._jobs * 4)

        def looked(chunk: list[pytest.Item]) -> bytes:
            use_folder(session.config)
            return what_each_runs(chunk, file)

        works = [Work(None, lambda chunk=chunk: looked(chunk), 3600, 3600) for chunk in chunks]
        seen: dict[str, Any] = {}
        for done in in_processes(works, self._jobs):
            if done.said is None:
                return {"problem": "a process of its tests died without any mutant"}
            seen |= json.loads(done.said)
        if failed := [name for name, one in seen.items() if one["ended"] == "failed"]:
            return {"problem": f"without any mutant these fail: {', '.join(failed[:5])}"}
        tests = [
            _Test(name, frozenset(one["lines"]), one["cpu_s"], one["wall_s"])
            for name, one in seen.items()
            if one["ended"] == "passed"
        ]
        place = InPlace(file, Path(file).read_text(encoding="utf-8"))
        works, left, unseen = [], [], []
        for number, mutant in enumerate(self._mutants):
            chosen = _chosen(tests, mutant)
            if not place.put(mutant.source, try_only=True):
                left.append(number)
                continue
            if not chosen:
                unseen.append((number, "survived", "no test runs it"))
                continue

            def tried(mutant: Mutant = mutant, chosen: Sequence[_Test] = tuple(chosen)) -> bytes:
                use_folder(session.config)
                place.put(mutant.source)
                _load_instead(mutant)
                return first_failed([items[one.name] for one in chosen], _each(chosen)).encode()

            works.append(Work((number, len(chosen)), tried, *_limits(chosen)))
        outcomes = [
            _ended(done.tag, done.said, timed_out=done.timed_out) for done in in_processes(works, self._jobs)
        ]
        return {
            "outcomes": [*outcomes, *unseen],
            "left": left,
            "tests": {one.name: (one.cpu_s, one.wall_s) for one in tests},
            "modules": [name for name in sys.modules if name.split(".")[0] not in ("tests", "__main__")],
        }


def _ended(tag: tuple[int, int], said: bytes | None, *, timed_out: bool) -> tuple[int, str, str]:
    """Return number, end and by what, of one mutant."""
    number, tests = tag
    if timed_out:
        return number, "timed out", ""
    if said is None:
        return number, "killed", "the process died"
    return (number, "killed", said.decode()) if said else (number, "survived", f"{tests} tests")


def _file(module: str) -> str:
    """Return the file of a module as its code names it."""
    found = importlib.import_module(_name(module)).__file__
    assert found is not None
    return found


def _name(module: str) -> str:
    """Return the name by which the file of a module is imported."""
    name = module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    return name if name.startswith("tests.") else f"bufferstand.{name}"


def _chunks(items: list[pytest.Item], number: int) -> list[list[pytest.Item]]:
    """Return tests in about so many parts; those of a file stay together where it is small."""
    size = max(1, -(-len(items) // number))
    return [items[at : at + size] for at in range(0, len(items), size)]


def _chosen(tests: Sequence[_Test], mutant: Mutant) -> list[_Test]:
    """Return the tests that run a mutant's statement, the quickest first, within the budget."""
    span = set(range(mutant.first, mutant.last + 1))
    return _within([one for one in tests if span & one.lines])


def _within(tests: Sequence[_Test]) -> list[_Test]:
    """Return the quickest tests within the budget."""
    found, used_s = [], 0.0
    for one in sorted(tests, key=lambda one: one.cpu_s):
        used_s += one.cpu_s
        if found and used_s > BUDGET_S:
            break
        found.append(one)
    return found


def _limits(tests: Sequence[_Test]) -> tuple[float, float]:
    """Return the limits of processor time and of the wall's for all tests with a mutant [s].

    The wall's is for tests that wait for what never comes, with other programs on the same processors.
    """
    cpu_s = TIMES * sum(one.cpu_s for one in tests) + 4 * AND_S
    return cpu_s, 2 * TIMES * sum(max(one.cpu_s, one.wall_s) for one in tests) + 16 * AND_S


def _each(tests: Sequence[_Test]) -> dict[str, float]:
    """Return the limit of processor time of each test with a mutant [s]."""
    return {one.name: TIMES * one.cpu_s + AND_S for one in tests}


class _Only:
    """A plugin: of what is collected, these tests in this order."""

    def __init__(self, limits_s: Mapping[str, float]) -> None:
        self._limits_s = limits_s
        self._turn = {name: number for number, name in enumerate(limits_s)}
        self.failed = ""

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = sorted(
            (item for item in items if item.nodeid in self._turn), key=lambda item: self._turn[item.nodeid]
        )

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        use_folder(session.config)
        if session.testsfailed or len(session.items) != len(self._turn):
            self.failed = "its tests cannot be collected"
        else:
            self.failed = first_failed(session.items, self._limits_s)
        return True


def _load_instead(mutant: Mutant) -> None:
    """Have whoever loads the file from now on in this process load the mutant."""
    real = os.path.realpath(ROOT / mutant.module)
    plain = importlib.machinery.SourceFileLoader.get_code

    def get_code(self: importlib.machinery.SourceFileLoader, fullname: str) -> Any:
        path = self.get_filename(fullname)
        if os.path.realpath(path) == real:
            return compile(mutant.source, path, "exec", dont_inherit=True)
        return plain(self, fullname)

    importlib.machinery.SourceFileLoader.get_code = get_code  # type: ignore[method-assign]


def _anew(mutant: Mutant, limits_s: Mapping[str, float]) -> bytes:
    """Import everything with a mutant and run tests in turn; return which failed, empty where all passed."""
    _load_instead(mutant)
    only = _Only(limits_s)
    files = sorted({name.partition("::")[0] for name in limits_s})
    status = pytest.main([*QUIET, *files], plugins=[NoShrinking(), only])
    return (only.failed or ("" if status == pytest.ExitCode.OK else f"pytest ends with {status}")).encode()


def _collected(module: str, mutants: Sequence[Mutant], tests: Sequence[str], jobs: int) -> bytes:
    """Be the process that collects the tests of a module."""
    engine = _Engine(module, mutants, jobs)
    pytest.main([*QUIET, *tests], plugins=[NoShrinking(), engine])
    return json.dumps(engine.said).encode()


def try_all(module: str, mutants: Sequence[Mutant], tests: Sequence[str], jobs: int) -> Iterator[Outcome]:
    """Yield what becomes of each mutant of a module.

    Parameters
    ----------
    tests : sequence of str
        Files and folders of tests, from the root.
    jobs : int
        So many at a time.

    Raises
    ------
    CannotTry
        If the tests do not pass without any mutant.
    """
    work = Work(None, lambda: _collected(module, mutants, tests, jobs), 86400, 86400)
    (done,) = in_processes([work], 1)
    if done.said is None:
        raise CannotTry(f"{module}: the process that collects its tests died")
    said = json.loads(done.said)
    if "problem" in said:
        raise CannotTry(f"{module}: {said['problem']}")
    for number, ended, by in said["outcomes"]:
        yield Outcome(mutants[number], ended, by)
    if said["left"]:
        chosen = _within([_Test(name, frozenset(), *of) for name, of in said["tests"].items()])
        work = Work(
            None, lambda: _all_anew(mutants, said["left"], chosen, said["modules"], jobs), 86400, 86400
        )
        (done,) = in_processes([work], 1)
        if done.said is None:
            raise CannotTry(f"{module}: the process that imports anew died")
        for number, ended, by in json.loads(done.said):
            yield Outcome(mutants[number], ended, by)


def _all_anew(
    mutants: Sequence[Mutant], left: Sequence[int], tests: Sequence[_Test], modules: Sequence[str], jobs: int
) -> bytes:
    """Be the process that tries mutants of what is run at import: each in a child that imports its users."""
    _know(modules, _name(mutants[left[0]].module))
    limits_s = _each(tests)
    cpu_s, wall_s = _limits(tests)
    works = [
        Work((number, len(tests)), lambda one=mutants[number]: _anew(one, limits_s), cpu_s + 20, wall_s + 60)
        for number in left
    ]
    return json.dumps(
        [_ended(done.tag, done.said, timed_out=done.timed_out) for done in in_processes(works, jobs)]
    ).encode()


class _Kept:
    """A finder that lets nobody import a module."""

    def __init__(self, name: str) -> None:
        self._name = name

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:  # noqa: ARG002
        if name == self._name:
            raise ImportError(name)


def _know(names: Sequence[str], kept: str) -> None:
    """Import, once for all children, what does not use the mutated module."""
    finder = _Kept(kept)
    sys.meta_path.insert(0, finder)
    for name in names:
        try:
            importlib.import_module(name)
        except Exception:  # noqa: BLE001 - what cannot be imported is not known beforehand
            continue
    sys.meta_path.remove(finder)
