"""The mutants of a source: those of cosmic-ray's operators, and one of our own that leaves out calls."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOOL = ROOT / ".mutants"
"""The environment that has cosmic-ray; :func:`set_up` makes it."""
LOCK = Path(__file__).with_name("cosmic-ray.lock")


@dataclass(frozen=True)
class Mutant:
    """One change of one place.

    Parameters
    ----------
    module : str
        The file, from the root.
    where : str
        Qualified name of the function or class that it is in, empty for the module itself.
    first, last : int
        Lines of the statement that it is in (of a compound one its head).
    line, mutant : str
        The changed line, before and after, without what is left and right of it.
    operator : str
        What made it.
    source : str
        The whole file with it.
    """

    module: str
    where: str
    first: int
    last: int
    line: str
    mutant: str
    operator: str
    source: str

    @property
    def identity(self) -> tuple[str, str, str, str]:
        """Return what names it as long as its line is not rewritten."""
        return self.module, self.where, self.line, self.mutant


def set_up() -> None:
    """Make the environment with cosmic-ray, unless it is there as the lock has it.

    Raises
    ------
    subprocess.CalledProcessError
        Where its packages cannot be had.
    """
    stamp = TOOL / "lock"
    if stamp.is_file() and stamp.read_bytes() == LOCK.read_bytes():
        return
    shutil.rmtree(TOOL, ignore_errors=True)
    subprocess.run([sys.executable, "-m", "venv", str(TOOL)], check=True)
    pip = [str(TOOL / "bin" / "python"), "-m", "pip", "install", "-q", "--no-deps", "--require-hashes"]
    subprocess.run([*pip, "-r", str(LOCK)], check=True)
    shutil.copyfile(LOCK, stamp)


def is_set_up() -> bool:
    """Return whether cosmic-ray's operators can be had."""
    return (TOOL / "lock").is_file()


def mutants_of(module: str, source: str) -> list[Mutant]:
    """Return all mutants of a source, in the order of its lines, each once.

    Left out are those that say the same, those that do not compile, those of annotations of functions,
    and unions of types in any annotation: nothing of them is run. So are the ``frozen`` and ``slots`` of
    dataclasses: they are for who writes code, and the type checker holds them. Protocols are never run.
    """
    done = subprocess.run(
        [str(TOOL / "bin" / "python"), str(Path(__file__).with_name("operators.py"))],
        input=source,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=True,
    )
    raw = [(one["operator"], one["line"], one["column"], one["source"]) for one in json.loads(done.stdout)]
    return placed(module, source, [*raw, *_without_calls(source)])


def placed(module: str, source: str, changed: list[tuple[str, int, int, str]]) -> list[Mutant]:
    """Return what differs from a source when it is run, with the places in it.

    Parameters
    ----------
    changed : list of tuple
        Operator, line (from 1), column (from 0) and whole source of each.
    """
    tree = ast.parse(source)
    skipped = list(_not_run(tree))
    seen = {ast.dump(tree)}
    found = []
    for operator, line, column, mutated in sorted(changed, key=lambda one: one[1:3]):
        if any(start <= (line, column) < end and only in operator for start, end, only in skipped):
            continue
        try:
            compile(mutated, module, "exec")
            code = ast.dump(ast.parse(mutated))
        except SyntaxError:
            continue
        if "_Mul_Div" in operator and _products(mutated) == _products(source):
            continue  # the * that stands before parameters given by name
        if code in seen:
            continue
        seen.add(code)
        where, first, last = _place(tree, line, column)
        found.append(Mutant(module, where, first, last, *_lines(source, mutated, line), operator, mutated))
    return found


def _products(source: str) -> int:
    return sum(isinstance(node, ast.Mult) for node in ast.walk(ast.parse(source)))


def _lines(source: str, mutated: str, line: int) -> tuple[str, str]:
    """Return the changed line before and after; what is left out as a whole has nothing after it."""
    before, after = source.splitlines(), mutated.splitlines()
    if len(before) != len(after):
        return before[line - 1].strip(), ""
    at = next(number for number, pair in enumerate(zip(before, after, strict=True)) if pair[0] != pair[1])
    return before[at].strip(), after[at].strip()


def _place(tree: ast.Module, line: int, column: int) -> tuple[str, int, int]:
    """Return the qualified name around a place, and the first and last line of its statement."""
    names, span = [], (line, line)
    node: ast.AST = tree
    while True:
        inner = next((one for one in _statements(node) if _first(one) <= line <= (one.end_lineno or 0)), None)
        if inner is None:
            return ".".join(names), *span
        body = getattr(inner, "body", None)
        head = body[0].lineno - 1 if body and isinstance(body, list) else inner.end_lineno or line
        span = (inner.lineno, max(head, inner.lineno))
        if isinstance(inner, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            names.append(inner.name)
        node = inner


def _first(node: ast.stmt | ast.ExceptHandler | ast.match_case) -> int:
    """Return the first line of a statement, decorators included."""
    marks = getattr(node, "decorator_list", [])
    if isinstance(node, ast.match_case):
        return node.pattern.lineno
    return min([node.lineno, *(mark.lineno for mark in marks)])


def _statements(node: ast.AST) -> Iterator[ast.stmt]:
    """Yield the statements directly in a node, through its handlers and cases."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt):
            yield child
        elif isinstance(child, ast.ExceptHandler | ast.match_case):
            yield from _statements(child)


def _not_run(tree: ast.Module) -> Iterator[tuple[tuple[int, int], tuple[int, int], str]]:
    """Yield the places of annotations, and which operators are not for them."""
    for node in ast.walk(tree):
        found: list[tuple[ast.expr | None, str]] = []
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found = [(node.returns, "")]
        elif isinstance(node, ast.arg):
            found = [(node.annotation, "")]
        elif isinstance(node, ast.AnnAssign):
            found = [(node.annotation, "BitOr")]
        elif isinstance(node, ast.ClassDef):
            found = [(mark, "TrueWithFalse") for mark in node.decorator_list if "frozen" in ast.unparse(mark)]
            if any("Protocol" in ast.unparse(base) for base in node.bases):
                yield (node.lineno, 0), (node.end_lineno or 0, 1 << 20), ""
        for one, only in found:
            if one is not None:
                yield (one.lineno, one.col_offset), (one.end_lineno or 0, one.end_col_offset or 0), only


def _without_calls(source: str) -> Iterator[tuple[str, int, int, str]]:
    """Yield the source without each of its calls that stand alone, done for its effect."""
    lines = source.splitlines(keepends=True)
    for node in ast.walk(ast.parse(source)):
        if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call | ast.Await | ast.YieldFrom)):
            continue
        first, last = node.lineno - 1, node.end_lineno or node.lineno
        head = lines[first].encode()[: node.col_offset].decode()
        tail = lines[last - 1].encode()[node.end_col_offset :].decode()
        yield (
            "RemoveCall",
            node.lineno,
            node.col_offset,
            "".join([*lines[:first], head + "pass" + tail, "\n" * (last - first - 1), *lines[last:]]),
        )
