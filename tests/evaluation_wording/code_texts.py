"""The texts that code puts together, as templates: what a reader of the finished text may meet.

A text of the evaluation is an f-string, often of pieces that are chosen before. Each is followed to the
text that it ends in: a name to what is assigned to it, a call to what the function of the same file
returns, a constant of another file to its value. What cannot be followed is a fact in braces.
"""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

from tests.evaluation_wording.messages import ROOT

_SAYING = frozenset({"said", "said_count", "label", "numeral"})
"""What makes a text that knows its parts: ``messages`` has those."""
_OF_CODE = frozenset({"TypeVar", "Literal", "cast", "compile"})
_MOST = 48
"""So many forms of one text at most: what has more is followed less deeply."""
_DEEPEST = 10
_IN_PIECES = re.compile(r"  | [:,;.)]|[(][)]|[:,;] ?$| by $")
"""What a text shows that is put together as none ever is: an empty piece where another one stands."""
FACT = re.compile(r"\{(\w+)\}")
_Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class CodeText:
    """A text of the code: where it stands, and every form of it, its facts in braces."""

    file: str
    line: int
    forms: tuple[str, ...]


@dataclass
class _Scope:
    """What the names of a function stand for; texts alone, of what is assigned in plain sight."""

    assigned: dict[str, list[ast.expr]] = field(default_factory=dict)
    added: dict[str, list[tuple[ast.expr, bool]]] = field(default_factory=dict)
    """What ``+=`` adds to them, and whether always: not in a branch or loop."""
    closed: set[str] = field(default_factory=set)
    """Names that are also something else: parameters, targets of loops."""


@cache
def code_texts(file: Path) -> tuple[CodeText, ...]:
    """Return the texts that a file of the code puts together.

    Parameters
    ----------
    file : Path
        A Python file; its imports can be resolved.

    Returns
    -------
    tuple of CodeText
        Without docstrings, messages of exceptions and what ``said`` makes.
    """
    return tuple(_Walk(file).texts())


@cache
def handed_texts(file: Path, names: frozenset[str]) -> tuple[CodeText, ...]:
    """Return the texts that a file hands to what has one of the names, to ``Trip(…)`` for one."""
    walk = _Walk(file)
    calls = [node for node in ast.walk(walk.tree) if isinstance(node, ast.Call) and _name_of(node) in names]
    given = [one for node in calls for one in (*node.args, *_words_of(node))]
    return tuple(text for node in given if (text := walk.text(node)) is not None)


class _Walk:
    def __init__(self, file: Path) -> None:
        self.file = file.relative_to(ROOT).as_posix() if file.is_relative_to(ROOT) else file.name
        self.tree = ast.parse(file.read_text(encoding="utf-8"))
        self.used: set[int] = set()
        self.functions = {one.name: one for one in self.tree.body if isinstance(one, _Function)}
        self.scopes: dict[int, _Scope] = {id(None): _scope_of(self.tree.body)}
        self.home: dict[int, _Function | None] = {}
        self._settle(self.tree, None)
        self.aside = _aside(self.tree)
        self.within: set[tuple[int, str]] = set()

    def texts(self) -> Iterator[CodeText]:
        """Return each text that is no piece of another."""
        found = []
        for node in ast.walk(self.tree):
            is_text = (
                isinstance(node, ast.JoinedStr | ast.Constant | ast.BinOp) and id(node) not in self.aside
            )
            if is_text and (forms := self._forms(node, 0, top=True)):
                found.append((node, forms))
        found += list(self._grown())
        for node, forms in sorted(found, key=lambda one: one[0].lineno):
            if id(node) not in self.used:
                yield self._text_of(node, forms)

    def text(self, node: ast.expr) -> CodeText | None:
        """Return the text of one expression, or None where it is none that can be followed."""
        forms = self._forms(node, 0, top=True)
        return self._text_of(node, forms) if forms else None

    def _text_of(self, node: ast.expr, forms: list[str]) -> CodeText:
        kept = sorted(text for text in forms if not _IN_PIECES.search(text))
        return CodeText(self.file, node.lineno, tuple(kept))

    def _grown(self) -> Iterator[tuple[ast.expr, list[str]]]:
        """Return the texts that something is added to line by line."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                scope = self.scopes[id(self.home[id(node)])]
                if (name := node.target.id) in scope.added and self._forms(node.value, 1):
                    if forms := self._named(node.target, 0):
                        yield node.target, forms
                    scope.added.pop(name, None)

    def _settle(self, node: ast.AST, home: _Function | None) -> None:
        """Note in which function each expression stands."""
        for child in ast.iter_child_nodes(node):
            self.home[id(child)] = home
            if isinstance(child, _Function):
                self.scopes[id(child)] = _scope_of(child.body, child)
                self._settle(child, child)
            else:
                self._settle(child, home)

    def _forms(self, node: ast.expr, depth: int, *, top: bool = False) -> list[str]:
        """Return the forms of an expression, or none where it is no text that can be followed."""
        if depth > _DEEPEST:
            return []
        if not top:
            self._use(node)
        if isinstance(node, ast.Constant):
            return [node.value] if isinstance(node.value, str) else []
        follow: Callable[[Any, int], list[str]] | None = {
            ast.JoinedStr: self._f_string,
            ast.BinOp: self._sum,
            ast.IfExp: self._choice,
            ast.Name: self._named,
            ast.Call: self._returned,
            ast.Subscript: self._member,
        }.get(type(node))
        return [] if follow is None else follow(node, depth)

    def _f_string(self, node: ast.JoinedStr, depth: int) -> list[str]:
        return self._together([self._part(part, depth) for part in node.values])

    def _sum(self, node: ast.BinOp, depth: int) -> list[str]:
        sides = [self._forms(side, depth + 1) for side in (node.left, node.right)]
        if not isinstance(node.op, ast.Add) or not any(sides):
            return []
        return self._together([forms or ["{added}"] for forms in sides])

    def _choice(self, node: ast.IfExp, depth: int) -> list[str]:
        forms = [self._forms(one, depth + 1) for one in (node.body, node.orelse) if not _is_none(one)]
        if not any(forms):
            return []
        return list(dict.fromkeys(text for own in forms for text in own or ["{otherwise}"]))

    def _member(self, node: ast.Subscript, depth: int) -> list[str]:
        return self._held(node.value, depth)

    def _held(self, node: ast.expr, depth: int) -> list[str]:
        """Return the texts that a dictionary or tuple of the file holds."""
        if not isinstance(node, ast.Name):
            return []
        values = self.scopes[id(None)].assigned.get(node.id, [])
        held = [one for value in values if isinstance(value, ast.Dict) for one in value.values]
        held += [one for value in values if isinstance(value, ast.Tuple) for one in value.elts]
        return list(dict.fromkeys(text for one in held for text in self._forms(one, depth + 1)))

    def _use(self, node: ast.expr) -> None:
        self.used.add(id(node))

    def _part(self, part: ast.expr, depth: int) -> list[str]:
        if isinstance(part, ast.FormattedValue):
            inner = self._forms(part.value, depth + 1)
            return inner or ["{" + _fact_name(part.value) + "}"]
        return self._forms(part, depth)

    def _together(self, parts: list[list[str]]) -> list[str]:
        """Return every way to put parts together; where that is too many, the first of the last parts."""
        while (many := _count(parts)) > _MOST and many > 1:
            longest = max(range(len(parts)), key=lambda at: len(parts[at]))
            parts = [*parts[:longest], parts[longest][:-1], *parts[longest + 1 :]]
        return list(dict.fromkeys("".join(chosen) for chosen in product(*parts)))

    def _named(self, node: ast.Name, depth: int) -> list[str]:
        """Return what a name stands for; one that is made of itself is a fact of what is made."""
        home = self.home.get(id(node))
        if (here := (id(home), node.id)) in self.within:
            return []
        self.within.add(here)
        try:
            return self._meant(node, home, depth)
        finally:
            self.within.discard(here)

    def _meant(self, node: ast.Name, home: _Function | None, depth: int) -> list[str]:
        if home is not None and node.id in (names := [one.arg for one in home.args.args]):
            return self._handed_over(home, names.index(node.id), depth)
        for scope in (self.scopes[id(home)], self.scopes[id(None)]):
            if node.id in scope.closed:
                return []
            if values := scope.assigned.get(node.id):
                texts = [text for value in values for text in self._forms(value, depth + 1) or ["{it}"]]
                if texts == ["{it}"] * len(texts):
                    return []
                for more, always in scope.added.get(node.id, ()):
                    tails = self._forms(more, depth + 1) or ["{more}"]
                    longer = [text + tail for text in texts for tail in tails]
                    texts = longer if always else texts + longer
                return list(dict.fromkeys(texts))[:_MOST]
        return self._imported(node.id)

    def _handed_over(self, function: _Function, place: int, depth: int) -> list[str]:
        """Return the texts that a function of the file is given in a place, where it is given such."""
        given = [
            node.args[place]
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == function.name
            and len(node.args) > place
        ]
        forms = [self._forms(one, depth + 1) for one in given]
        texts = list(dict.fromkeys(text for own in forms for text in own))
        return texts + (["{it}"] if texts and not all(forms) else [])

    def _imported(self, name: str) -> list[str]:
        """Return the value of a constant of another file."""
        for node in self.tree.body:
            imports = isinstance(node, ast.ImportFrom) and name in [
                one.asname or one.name for one in node.names
            ]
            if imports and node.module and not node.level:
                value = getattr(importlib.import_module(node.module), name, None)
                return [str(value)] if isinstance(value, str) else []
        return []

    def _returned(self, node: ast.Call, depth: int) -> list[str]:
        """Return what a function of the same file may return, or what ``get`` finds in a dictionary of it."""
        if isinstance(node.func, ast.Attribute):
            return self._held(node.func.value, depth) if node.func.attr == "get" else []
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        function = self.functions.get(name)
        if function is None:
            return []
        returned = [
            node.value
            for node in ast.walk(function)
            if isinstance(node, ast.Return) and node.value and self.home[id(node)] is function
        ]
        forms = [self._forms(value, depth + 1) for value in returned]
        if not any(forms):
            return []
        return list(dict.fromkeys(text for texts in forms for text in texts or ["{" + name.strip("_") + "}"]))


def _words_of(node: ast.Call) -> list[ast.expr]:
    """Return what is handed over by name, but for where something is wrong: it names files and keys."""
    return [word.value for word in node.keywords if word.arg not in {"place", "file"}]


def _name_of(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


def _is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def _count(parts: Iterable[list[str]]) -> int:
    many = 1
    for forms in parts:
        many *= len(forms)
    return many


def _fact_name(node: ast.expr) -> str:
    words = re.findall(r"[a-zA-Z]\w*", ast.unparse(node))
    return words[-1] if words else "fact"


def _scope_of(body: list[ast.stmt], function: _Function | None = None) -> _Scope:
    scope = _Scope()
    if function is not None:
        given = function.args
        scope.closed |= {one.arg for one in (*given.posonlyargs, *given.args, *given.kwonlyargs)}
    always = set(_always_added(body))
    for statement in body:
        for node in _within(statement):
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    _assign(scope, target, node.value)
            elif isinstance(node, ast.AnnAssign | ast.NamedExpr) and node.value is not None:
                _assign(scope, node.target, node.value)
            elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                scope.added.setdefault(node.target.id, []).append((node.value, id(node) in always))
            elif isinstance(node, ast.For | ast.comprehension):
                if isinstance(node.iter, ast.Tuple | ast.List):
                    for one in node.iter.elts:
                        _assign(scope, node.target, one)
                else:
                    scope.closed |= {one.id for one in ast.walk(node.target) if isinstance(one, ast.Name)}
    return scope


def _always_added(body: list[ast.stmt]) -> Iterator[int]:
    """Return which ``+=`` stand in one row with what they add to."""
    set_here: set[str] = set()
    for statement in body:
        if isinstance(statement, ast.Assign):
            set_here |= {one.id for one in statement.targets if isinstance(one, ast.Name)}
        elif isinstance(statement, ast.AugAssign) and getattr(statement.target, "id", "") in set_here:
            yield id(statement)
        for inner in ("body", "orelse", "finalbody"):
            if not isinstance(statement, _Function | ast.ClassDef):
                yield from _always_added(getattr(statement, inner, []))


def _within(node: ast.AST) -> Iterator[ast.AST]:
    """Return a statement and what is in it, but not what functions in it hold."""
    yield node
    if isinstance(node, _Function | ast.ClassDef | ast.Lambda):
        return
    for child in ast.iter_child_nodes(node):
        yield from _within(child)


def _assign(scope: _Scope, target: ast.expr, value: ast.expr) -> None:
    """Note what is assigned; tuples on both sides member by member, also of both branches of a choice."""
    if isinstance(target, ast.Name):
        scope.assigned.setdefault(target.id, []).append(value)
    elif isinstance(target, ast.Tuple | ast.List):
        if isinstance(value, ast.IfExp):
            for one in (value.body, value.orelse):
                _assign(scope, target, one)
        elif isinstance(value, ast.Tuple) and len(value.elts) == len(target.elts):
            for name, one in zip(target.elts, value.elts, strict=True):
                _assign(scope, name, one)
        else:
            scope.closed |= {one.id for one in ast.walk(target) if isinstance(one, ast.Name)}


def _aside(tree: ast.Module) -> set[int]:
    """Return what is no text for a reader of figures: docstrings, keys, messages of exceptions, said ones."""
    left = [one for node in ast.walk(tree) for one in _left_by(node)]
    return {id(one) for node in left for one in ast.walk(node)}


def _left_by(node: ast.AST) -> list[ast.AST]:
    """Return what in a node is no text, or one that ``said`` makes."""
    left: list[ast.AST] = []
    match node:
        case ast.Expr(value=ast.Constant()) | ast.Raise() | ast.Compare() | ast.Assert():
            left = [node]
        case ast.Subscript(slice=key) | ast.DictComp(key=key):
            left = [key]
        case ast.Dict(keys=keys):
            left = [key for key in keys if key is not None]
        case ast.keyword(arg="place" | "file", value=value):
            left = [value]
        case ast.arg(annotation=one) | ast.AnnAssign(annotation=one) if one is not None:
            left = [one]
        case ast.FunctionDef(decorator_list=own, returns=returns):
            left = [*own, *([returns] if returns is not None else [])]
        case ast.FormattedValue(format_spec=how) if how is not None:
            left = [how]
        case ast.JoinedStr(values=parts):
            left = [part for part in parts if isinstance(part, ast.Constant)]
        case ast.Call() if _name_of(node) in _SAYING | _OF_CODE:
            left = [node]
    return left
