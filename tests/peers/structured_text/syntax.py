"""Structured Text (IEC 61131-3, 2nd edition's part) as a tree: declarations, statements, expressions."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

_WORDS = """
TYPE END_TYPE STRUCT END_STRUCT ARRAY OF FUNCTION END_FUNCTION FUNCTION_BLOCK END_FUNCTION_BLOCK
PROGRAM END_PROGRAM CONFIGURATION END_CONFIGURATION RESOURCE ON END_RESOURCE TASK WITH
VAR VAR_INPUT VAR_OUTPUT VAR_EXTERNAL VAR_GLOBAL CONSTANT END_VAR
IF THEN ELSIF ELSE END_IF CASE END_CASE FOR TO BY DO END_FOR WHILE END_WHILE RETURN EXIT
AND OR XOR NOT MOD TRUE FALSE AT FROM DT DATE TIME STEP ACTION
"""
KEYWORDS = frozenset(_WORDS.split())
"""Words that are no names."""
_TOKEN = re.compile(
    r"(?P<skip>\s+|\(\*.*?\*\))"
    r"|(?P<typed>[A-Za-z]\w*\#(?:16\#)?[0-9A-Fa-f_]+(?:ms|s)?)"
    r"|(?P<real>\d+\.\d+(?:[eE][-+]?\d+)?)|(?P<range>\d+(?=\.\.))|(?P<int>\d+)"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<sign>:=|<=|>=|<>|\.\.|[-+*/=<>()\[\],;:.])",
    re.DOTALL,
)


class SyntaxFault(ValueError):  # noqa: N818 - it names the fact
    """Text that is not of the part of the language that is known here."""


@dataclass(frozen=True)
class Token:
    """A word of the text and the line it stands in."""

    kind: str
    text: str
    line: int


@dataclass(frozen=True)
class Expression:
    """An operator or a leaf, with its operands.

    ``kind``: int, real, typed, bool, name, member, index, call, unary, binary; ``names`` are of a call's
    parameters.
    """

    kind: str
    text: str
    parts: tuple[Expression, ...] = ()
    names: tuple[str, ...] = ()
    line: int = 0


@dataclass(frozen=True)
class Statement:
    """``kind``: assign, call, if, case, for, while."""

    kind: str
    line: int
    expressions: tuple[Expression, ...] = ()
    blocks: tuple[tuple[Statement, ...], ...] = ()
    labels: tuple[tuple[int, ...], ...] = ()


@dataclass(frozen=True)
class Variable:
    """A declared variable: its section, type and first value; ``bounds`` of an array."""

    name: str
    type: str
    section: str
    initial: Expression | None = None
    bounds: tuple[int, int] | None = None


@dataclass
class Unit:
    """A function, function block, program or the configuration."""

    kind: str
    name: str
    result: str = ""
    variables: list[Variable] = field(default_factory=list)
    body: tuple[Statement, ...] = ()


@dataclass
class Source:
    """All that a text declares: types as lists of members, an array type as one member of its own name."""

    types: dict[str, list[Variable]] = field(default_factory=dict)
    units: list[Unit] = field(default_factory=list)


def tokens_of(text: str) -> list[Token]:
    """Cut a text into words."""
    found, at, line = [], 0, 1
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None or match.lastgroup is None:
            raise SyntaxFault(f"line {line}: {text[at : at + 20]!r} is no word of the language")
        kind, word = match.lastgroup, match.group()
        if kind == "name":
            word = word.upper()
            kind = "key" if word in KEYWORDS else "name"
        if kind != "skip":
            found.append(Token("int" if kind == "range" else kind, word, line))
        line += word.count("\n")
        at = match.end()
    return [*found, Token("end", "", line)]


def parse(text: str) -> Source:
    """Read a whole program.

    Raises
    ------
    SyntaxFault
        With the line at which it is not understood.
    """
    return _Parser(tokens_of(text)).source()


_LEVELS = (("OR",), ("XOR",), ("AND",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "MOD"))
"""Operators that bind alike, the weakest first (table of operators of Structured Text)."""


class _Parser:
    def __init__(self, tokens: list[Token]) -> None:
        self._tokens = tokens
        self._at = 0

    @property
    def _next(self) -> Token:
        return self._tokens[self._at]

    def _sees(self, *words: str) -> bool:
        return self._next.text in words

    def _takes(self, *words: str) -> bool:
        if self._sees(*words):
            self._at += 1
            return True
        return False

    def _demand(self, word: str) -> None:
        if not self._takes(word):
            raise SyntaxFault(f"line {self._next.line}: {word!r} should stand where {self._next.text!r} is")

    def _take(self, kind: str) -> str:
        token = self._next
        if token.kind != kind:
            raise SyntaxFault(f"line {token.line}: a {kind} should stand where {token.text!r} is")
        self._at += 1
        return token.text

    def source(self) -> Source:
        """Read all declarations."""
        source = Source()
        while self._next.kind != "end":
            if self._takes("TYPE"):
                while not self._takes("END_TYPE"):
                    name = self._take("name")
                    self._demand(":")
                    source.types[name] = self._type_of(name)
            else:
                source.units.append(self._unit())
        return source

    def _type_of(self, name: str) -> list[Variable]:
        if not self._takes("STRUCT"):
            made = self._shape(name, "")
            self._demand(";")
            return [made]
        members = []
        while not self._takes("END_STRUCT"):
            member = self._take("name")
            self._demand(":")
            members.append(self._shape(member, ""))
            self._demand(";")
        self._demand(";")
        return members

    def _shape(self, name: str, section: str) -> Variable:
        bounds = None
        if self._takes("ARRAY"):
            self._demand("[")
            low = int(self._take("int"))
            self._demand("..")
            bounds = low, int(self._take("int"))
            self._demand("]")
            self._demand("OF")
        type_name = self._take("name")
        initial = self._expression() if self._takes(":=") else None
        return Variable(name, type_name, section, initial, bounds)

    def _unit(self) -> Unit:
        kind = self._next.text
        if kind not in ("FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "CONFIGURATION"):
            raise SyntaxFault(f"line {self._next.line}: {kind!r} begins no declaration")
        self._at += 1
        unit = Unit(kind, self._take("name"))
        if self._takes(":"):
            unit.result = self._take("name")
        while self._next.text.startswith("VAR"):
            unit.variables += self._section()
        if kind == "CONFIGURATION":  # its resource and task are what the runtime is
            while not self._sees("END_CONFIGURATION"):
                self._at += 1
        unit.body = self._statements(f"END_{kind}")
        return unit

    def _section(self) -> list[Variable]:
        section = self._take("key")
        if self._takes("CONSTANT"):
            section = "CONSTANT"
        variables = []
        while not self._takes("END_VAR"):
            name = self._take("name")
            self._demand(":")
            variables.append(self._shape(name, section))
            self._demand(";")
        return variables

    def _block(self, *ends: str) -> tuple[Statement, ...]:
        statements = []
        while not self._sees(*ends):
            statements.append(self._statement())
        return tuple(statements)

    def _statements(self, end: str) -> tuple[Statement, ...]:
        block = self._block(end)
        self._demand(end)
        return block

    def _statement(self) -> Statement:
        line = self._next.line
        if self._takes("IF"):
            statement = self._if(line)
        elif self._takes("CASE"):
            statement = self._case(line)
        elif self._takes("FOR"):
            statement = self._for(line)
        elif self._takes("WHILE"):
            condition = self._expression()
            self._demand("DO")
            statement = Statement("while", line, (condition,), (self._statements("END_WHILE"),))
        else:
            place = self._postfix()
            if place.kind == "call":
                statement = Statement("call", line, (place,))
            else:
                self._demand(":=")
                statement = Statement("assign", line, (place, self._expression()))
        self._demand(";")
        return statement

    def _if(self, line: int) -> Statement:
        conditions, blocks = [], []
        while True:
            conditions.append(self._expression())
            self._demand("THEN")
            blocks.append(self._block("ELSIF", "ELSE", "END_IF"))
            if not self._takes("ELSIF"):
                break
        if self._takes("ELSE"):
            blocks.append(self._block("END_IF"))
        self._demand("END_IF")
        return Statement("if", line, tuple(conditions), tuple(blocks))

    def _case(self, line: int) -> Statement:
        chosen = self._expression()
        self._demand("OF")
        labels, blocks = [], []
        while not self._takes("END_CASE"):
            several = [int(self._take("int"))]
            while self._takes(","):
                several.append(int(self._take("int")))
            self._demand(":")
            labels.append(tuple(several))
            block = []
            while self._next.kind != "int" and not self._sees("END_CASE"):
                block.append(self._statement())
            blocks.append(tuple(block))
        return Statement("case", line, (chosen,), tuple(blocks), tuple(labels))

    def _for(self, line: int) -> Statement:
        counter = self._postfix()
        self._demand(":=")
        first = self._expression()
        self._demand("TO")
        last = self._expression()
        self._demand("DO")
        return Statement("for", line, (counter, first, last), (self._statements("END_FOR"),))

    def _expression(self, level: int = 0) -> Expression:
        if level == len(_LEVELS):
            return self._unary()
        left = self._expression(level + 1)
        while self._sees(*_LEVELS[level]):
            line, sign = self._next.line, self._next.text
            self._at += 1
            left = Expression("binary", sign, (left, self._expression(level + 1)), line=line)
        return left

    def _unary(self) -> Expression:
        line = self._next.line
        for sign in ("NOT", "-"):
            if self._takes(sign):
                return Expression("unary", sign, (self._unary(),), line=line)
        return self._postfix()

    def _postfix(self) -> Expression:
        token = self._next
        if self._takes("("):
            inner = self._expression()
            self._demand(")")
            return inner
        if token.kind in ("int", "real", "typed"):
            self._at += 1
            return Expression(token.kind, token.text, line=token.line)
        if self._takes("TRUE", "FALSE"):
            return Expression("bool", token.text, line=token.line)
        place = Expression("name", self._take("name"), line=token.line)
        while True:
            if self._takes("."):
                place = Expression("member", self._take("name"), (place,), line=token.line)
            elif self._takes("["):
                place = Expression("index", "", (place, self._expression()), line=token.line)
                self._demand("]")
            elif self._takes("("):
                place = self._call(place.text, token.line)
            else:
                return place

    def _call(self, name: str, line: int) -> Expression:
        names, values = [], []
        while not self._takes(")"):
            if self._tokens[self._at + 1].text == ":=":
                names.append(self._take("name"))
                self._demand(":=")
            values.append(self._expression())
            if not self._sees(")"):
                self._demand(",")
        return Expression("call", name, tuple(values), tuple(names), line)
