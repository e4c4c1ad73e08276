"""Expressions that select runs: ``kind == "harmonic" and prestress >= 50 and damping < 0.4``.

The text is parsed as an expression of Python, of which only comparisons of names with values, ``in``,
``is None``, ``and``, ``or`` and ``not`` are let through; nothing of it is ever executed. What is unknown of a
run matches nothing but ``is None``, nor does its contrary.
"""

from __future__ import annotations

import ast
import difflib
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from bufferstand.foundation import BadInput
from bufferstand.recording.finding.dates import comparable, written_date

FieldType = Literal["text", "number", "date"]
Facts = Mapping[str, Any]
Test = Callable[[Facts], bool | None]
"""True, False, or None where it hangs on what is not known."""

OPTION = "--where"
_ORDER: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_MIRRORED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.Gt,
    ast.LtE: ast.GtE,
    ast.Gt: ast.Lt,
    ast.GtE: ast.LtE,
    ast.Eq: ast.Eq,
    ast.NotEq: ast.NotEq,
}
_DECIMAL = re.compile(r"[\d_]*\.?[\d_]*([eE][+-]?[\d_]+)?")
_LARGEST = 300
"""Powers of ten beyond are no numbers that a computer calculates with."""
_BREAKS = str.maketrans("\r\n", "  ")
_LONGEST = 2000
_EXAMPLE = 'write for example  prestress >= 50 and specimen == "A-105"'


@dataclass(frozen=True)
class QueryField:
    """Something that can be asked of a run: the name of the fact, and what it is."""

    fact: str
    type: FieldType


@dataclass(frozen=True)
class Query:
    """An expression that was understood.

    Attributes
    ----------
    facts : frozenset of str
        The facts that it asks for.
    matches : callable
        Tells of a run's facts whether they match; a fact that is missing or None is unknown.
    """

    facts: frozenset[str]
    matches: Callable[[Facts], bool]


def parse_query(text: str, fields: Mapping[str, QueryField]) -> Query:
    """Return the query that an expression stands for.

    Parameters
    ----------
    text : str
        Numbers match ``==`` as far as they are written out: ``frequency == 0.32`` is from 0.315 to 0.325.
        Dates are texts (``date >= "2026-03"``); ``"A-105" in specimen`` looks for a part of a text.
    fields : mapping of str to Field
        What can be asked, by every name under which it may be.

    Raises
    ------
    BadInput
        If it is no such expression; the message names the place and, of an unknown name, the nearest one.
    """
    if len(text) > _LONGEST:
        raise BadInput(f"longer than {_LONGEST} characters", file=OPTION, remedy="ask for less at a time")
    text = text.translate(_BREAKS)
    begin = len(text) - len(text.lstrip())
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        at = f"column {begin + error.offset}" if isinstance(error, SyntaxError) and error.offset else ""
        single = re.search(r"(?<![=!<>])=(?!=)", text)
        remedy = "equality is written ==" if single else _EXAMPLE
        raise BadInput("this is no expression", file=OPTION, place=at, remedy=remedy) from None
    parser = _Parser(text.strip(), begin, fields)
    try:
        test = parser.test(tree.body)
        return Query(matches=lambda facts: test(facts) is True, facts=frozenset(parser.facts))
    except RecursionError:
        raise BadInput("nested too deeply", file=OPTION, remedy=_EXAMPLE) from None


class _Parser:
    def __init__(self, text: str, begin: int, fields: Mapping[str, QueryField]) -> None:
        self._text, self._begin, self._fields = text, begin, fields
        self.facts: set[str] = set()

    def test(self, node: ast.expr) -> Test:
        """Return the test that a part of the expression is."""
        if isinstance(node, ast.BoolOp):
            tests = [self.test(value) for value in node.values]
            return _joined(tests, decided_by=isinstance(node.op, ast.Or))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return _negated(self.test(node.operand))
        if isinstance(node, ast.Compare):
            return self._comparison(node)
        if isinstance(node, ast.Name):
            self._field(node)
            raise self._wrong(node, f"“{node.id}” is compared with nothing")
        raise self._wrong(node, "only comparisons joined by and, or, not are understood here")

    def _comparison(self, node: ast.Compare) -> Test:
        sides = [node.left, *node.comparators]
        tests = [
            self._pair(left, sign, right)
            for left, sign, right in zip(sides, node.ops, sides[1:], strict=False)
        ]
        return tests[0] if len(tests) == 1 else _joined(tests, decided_by=False)

    def _pair(self, left: ast.expr, sign: ast.cmpop, right: ast.expr) -> Test:
        if isinstance(sign, ast.In | ast.NotIn):
            return self._membership(left, right, negated=isinstance(sign, ast.NotIn))
        if isinstance(sign, ast.Is | ast.IsNot):
            field = self._field(left)
            if not (isinstance(right, ast.Constant) and right.value is None):
                raise self._wrong(right, "“is” is only for None: what is not known")
            wanted = isinstance(sign, ast.Is)
            return lambda facts: (facts.get(field.fact) is None) == wanted
        if not isinstance(left, ast.Name):
            if not isinstance(right, ast.Name):
                raise self._wrong(left, "there is no name to compare")
            return self._pair(right, _MIRRORED[type(sign)](), left)
        if isinstance(right, ast.Name):
            raise self._wrong(right, "two names are compared", 'a text is written in quotes: "…"')
        return self._ordered(self._field(left), type(sign), right)

    def _ordered(self, field: QueryField, sign: type[ast.cmpop], node: ast.expr) -> Test:
        value, fact = self._value(node, field), field.fact
        if sign in (ast.Eq, ast.NotEq):
            same = self._same(field, node, value)
            test = _of_date(fact, same) if field.type == "date" else _of_known(fact, same)
            return test if sign is ast.Eq else _negated(test)
        if field.type == "text":
            raise self._wrong(node, f"“{fact}” is a text, it has no order", "use ==, != or in")
        compare = _ORDER[sign]
        if field.type == "date":
            # Only as far as it is written out, so that a day ends with its last second.
            return _of_date(fact, lambda known: compare(known[: len(value)], value))
        return _of_known(fact, lambda known: compare(known, value))

    def _same(self, field: QueryField, node: ast.expr, value: Any) -> Callable[[Any], bool]:
        if field.type == "date":
            return lambda known: bool(known[: len(value)] == value)
        if field.type == "text":
            return lambda known: bool(known == value)
        half = 0.5 * 10.0 ** -self._decimals(node)
        return lambda known: bool(abs(known - value) <= half * (1.0 + 1e-9))

    def _decimals(self, node: ast.expr) -> int:
        """Return how many decimals a number is written with."""
        while isinstance(node, ast.UnaryOp):
            node = node.operand
        written = (ast.get_source_segment(self._text, node) or "").lower().replace("_", "")
        mantissa, _, exponent = written.partition("e")
        return len(mantissa.partition(".")[2]) - int(exponent or 0)

    def _membership(self, left: ast.expr, right: ast.expr, *, negated: bool) -> Test:
        if isinstance(left, ast.Name) and isinstance(right, ast.Tuple | ast.List | ast.Set):
            field = self._field(left)
            tests = [self._ordered(field, ast.Eq, element) for element in right.elts]
            test = _joined(tests, decided_by=True)
            return _negated(test) if negated else test
        if isinstance(left, ast.Constant) and isinstance(left.value, str) and isinstance(right, ast.Name):
            field, part = self._field(right), left.value
            if field.type != "text":
                raise self._wrong(right, f"“{field.fact}” is no text")
            return _of_known(field.fact, lambda known: (part in known) != negated)
        raise self._wrong(left, '“in” is understood as  name in (a, b)  or  "part" in name')

    def _field(self, node: ast.expr) -> QueryField:
        if not isinstance(node, ast.Name):
            raise self._wrong(node, "a name is wanted here")
        field = self._fields.get(node.id)
        if field is None:
            near = difflib.get_close_matches(node.id, self._fields, n=1, cutoff=0.5)
            known = "known are " + ", ".join(self._fields)
            raise self._wrong(
                node, f"unknown name “{node.id}”", f"did you mean “{near[0]}”?" if near else known
            )
        self.facts.add(field.fact)
        return field

    def _value(self, node: ast.expr, field: QueryField) -> Any:
        """Return the value that is written at a place, of the field's type."""
        value: Any = None
        if isinstance(node, ast.Constant):
            value = node.value
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            number = self._value(node.operand, field)
            if isinstance(number, int | float):
                return -number if isinstance(node.op, ast.USub) else number
        if field.type == "number":
            if isinstance(value, int | float) and not isinstance(value, bool):
                return self._number(node, value)
            raise self._wrong(node, f"“{field.fact}” is a number", "write it without quotes")
        if not isinstance(value, str):
            remedy = "“is None” asks for what is not known" if value is None else 'write it in quotes: "…"'
            raise self._wrong(node, f"“{field.fact}” is a {field.type}", remedy)
        if field.type == "date":
            try:
                return written_date(value)
            except ValueError as error:
                remedy = 'write "2026-03-05" or "2026-03-05T14:30", in UTC'
                raise self._wrong(node, f"“{value}” {error}", remedy) from None
        return value

    def _number(self, node: ast.expr, value: float) -> float:
        """Return a number that is written in decimals, and that others can be compared with."""
        if not _DECIMAL.fullmatch(ast.get_source_segment(self._text, node) or ""):
            raise self._wrong(node, "this number is not a decimal one", "write it as 495 or 4.95e2")
        if abs(value) > 10.0**_LARGEST or -self._decimals(node) > _LARGEST:
            raise self._wrong(node, "this number is too large", "compare with a smaller one")
        return float(value)

    def _wrong(self, node: ast.expr, problem: str, remedy: str = _EXAMPLE) -> BadInput:
        before = self._text.encode()[: node.col_offset].decode()  # the parser counts bytes
        place = f"column {self._begin + len(before) + 1}"
        return BadInput(problem, file=OPTION, place=place, remedy=remedy)


def _of_known(fact: str, test: Callable[[Any], bool]) -> Test:
    return lambda facts: None if (known := facts.get(fact)) is None else test(known)


def _of_date(fact: str, test: Callable[[Any], bool]) -> Test:
    return lambda facts: None if (known := comparable(facts.get(fact) or "")) is None else test(known)


def _negated(test: Test) -> Test:
    return lambda facts: None if (found := test(facts)) is None else not found


def _joined(tests: Sequence[Test], *, decided_by: bool) -> Test:
    """Return “or” (one True decides) or “and” (one False does); else one unknown leaves it unknown."""

    def test(facts: Facts) -> bool | None:
        found = [one(facts) for one in tests]
        if decided_by in found:
            return decided_by
        return None if None in found else not decided_by

    return test
