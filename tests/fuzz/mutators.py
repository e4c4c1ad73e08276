"""Makes inputs of samples: bytes as of bad disks, and what only somebody who knows the form would do."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable, Sequence
from random import Random
from typing import TypeVar

from tests.fuzz.target import Mutate
from tests.hostile.documents import ODD, changed, places
from tests.hostile.mutations import mutated

Part = TypeVar("Part")
NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
TEXT = re.compile(rb'"[^"\n]*"')
EXTREMES = (
    b"0", b"-0.0", b"-1", b"1e308", b"-1e308", b"5e-324", b"1e400", b"1e-400", b"9" * 40, b"9" * 5000, b"nan",
    b"inf", b"-inf", b"true", b'""', b"[]", b"{}", b"0xffffffffffffffffff", b"9223372036854775807",
    b"9223372036854775808", b"-9223372036854775809", b"0.1", b"1_000", b"1e5", b"100000000", b"2026-02-30",
    b"\xff", b"null", b"",
)  # fmt: skip
"""In the place of a number of a text."""
TEXTS = (
    b'""', b'"a"', b'"/"', b'".."', b'"\\u0000"', b'"\\u001b]0;b"', b'"\\u202e"', b'"' + b"a" * 5000 + b'"',
    b"1", b"[]", b"{}", b'["a"]', b"true", b'"\xff"', b'"/dev/zero"', b'"%s%n{0}{x}"', b'"<script>"',
    b'"\xe2\x88\x9e"', b'"\\ud800"', b'"' + b"a.b" * 200 + b'"',
)  # fmt: skip
"""In the place of a quoted text."""
DEPTHS = (50, 500, 100_000)


def of_text(content: bytes, pick: Random) -> bytes:
    """Return a text (TOML, JSON, CSV, XML, lines) with one to three changes of the kinds below."""
    for _ in range(pick.randint(1, 3)):
        content = pick.choice(_OF_TEXT)(content, pick)
    return content


def _number(content: bytes, pick: Random) -> bytes:
    return _replaced(content, NUMBER, EXTREMES, pick)


def _scaled(content: bytes, pick: Random) -> bytes:
    """Multiply or divide a number: what is still believed, but not possible."""
    found = list(NUMBER.finditer(content))
    if not found:
        return content
    one = pick.choice(found)
    try:
        value = float(one[0]) * 10.0 ** pick.randint(-9, 9)
    except (ValueError, OverflowError):
        return content
    text = str(round(value)) if b"." not in one[0] and abs(value) < 2**63 else repr(value)
    return content[: one.start()] + text.encode() + content[one.end() :]


def _quoted(content: bytes, pick: Random) -> bytes:
    return _replaced(content, TEXT, TEXTS, pick)


def _replaced(content: bytes, what: re.Pattern[bytes], by: Sequence[bytes], pick: Random) -> bytes:
    found = list(what.finditer(content))
    if not found:
        return mutated(content, pick)
    one = pick.choice(found)
    return content[: one.start()] + pick.choice(by) + content[one.end() :]


def _lines(content: bytes, pick: Random) -> bytes:
    """Double, drop, swap or join lines: keys are there twice, tables lack theirs."""
    lines = content.split(b"\n")
    one, other = pick.randrange(len(lines)), pick.randrange(len(lines))
    kind = pick.randrange(5)
    if kind == 0:
        lines.insert(other, lines[one])
    elif kind == 1:
        del lines[one]
    elif kind == 2:
        lines[one], lines[other] = lines[other], lines[one]
    elif kind == 3:
        first, last = sorted((one, other))
        lines[first:first] = lines[first : min(last, first + 20)]
    else:
        lines[one] = lines[one] + lines[other]
    return b"\n".join(lines)


def _nested(content: bytes, pick: Random) -> bytes:
    depth = pick.choice(DEPTHS)
    opened, closed = pick.choice(((b"[", b"]"), (b"{a = ", b"}"), (b'{"a": ', b"}"), (b"<a>", b"</a>")))
    inner = opened * depth + b"1" + closed * (depth if pick.random() < 0.5 else 0)
    found = list(NUMBER.finditer(content)) or list(TEXT.finditer(content))
    if not found:
        return content + inner
    one = pick.choice(found)
    return content[: one.start()] + inner + content[one.end() :]


_OF_TEXT: tuple[Mutate, ...] = (_number, _number, _scaled, _scaled, _quoted, _lines, _lines, _nested, mutated)


def of_json(content: bytes, pick: Random) -> bytes:
    """Return a JSON document with an odd value in one of its places, or one that is none."""
    if pick.random() < 0.2:
        return of_text(content, pick)
    try:
        document = json.loads(content)
    except (ValueError, RecursionError):  # it was changed already, and is none any more
        return of_text(content, pick)
    for _ in range(pick.randint(1, 2)):
        where = pick.choice(list(places(document)))
        document = changed(document, where, pick.choice(ODD))
    return json.dumps(document).encode()


def of_json_lines(content: bytes, pick: Random) -> bytes:
    """Return JSON lines of which one is odd, doubled, moved or cut."""
    lines = content.splitlines()
    if pick.random() < 0.3 or not lines:
        return of_text(content, pick)
    at = pick.randrange(len(lines))
    lines[at] = of_json(lines[at], pick)
    return b"\n".join(lines) + b"\n"


def either(*mutators: Mutate) -> Mutate:
    """Return a mutator that takes one of several."""
    return lambda content, pick: pick.choice(mutators)(content, pick)


def pieces(content: bytes) -> list[bytes]:
    """Return the pieces of a sample that :func:`joined` has put together."""
    found, at = [], 0
    while at + 4 <= len(content):
        (size,) = struct.unpack_from("<I", content, at)
        found.append(content[at + 4 : at + 4 + size])
        at += 4 + size
    return found


def joined(parts: Sequence[bytes]) -> bytes:
    """Return pieces as one sample: each with its length before it."""
    return b"".join(struct.pack("<I", len(part)) + part for part in parts)


def change_one(parts: list[Part], one: Callable[[Part, Random], Part], pick: Random, kinds: int) -> None:
    """Swap, double or drop a part, each once in so many kinds; else change it by ``one``."""
    at, other = pick.randrange(len(parts)), pick.randrange(len(parts))
    kind = pick.randrange(kinds)
    if kind == 0:
        parts[at], parts[other] = parts[other], parts[at]
    elif kind == 1:
        parts.insert(other, parts[at])
    elif kind == 2 and len(parts) > 1:
        del parts[at]
    else:
        parts[at] = one(parts[at], pick)


def of_pieces(one: Mutate, most: int = 64) -> Mutate:
    """Return a mutator of samples of several pieces (frames, requests): swapped, doubled, lost or damaged.

    Parameters
    ----------
    one : callable
        Mutates a piece.
    most : int
        Pieces that there may be.
    """

    def mutate(content: bytes, pick: Random) -> bytes:
        parts = pieces(content) or [b""]
        for _ in range(pick.randint(1, 3)):
            change_one(parts, one, pick, kinds=8)
        return joined(parts[:most])

    return mutate


def remade(mutate: Mutate, mend: Callable[[bytes], bytes], share: float = 0.7) -> Mutate:
    """Return a mutator behind which, mostly, the check sum is made anew: so that not it alone refuses."""

    def mutate_and_mend(content: bytes, pick: Random) -> bytes:
        content = mutate(content, pick)
        return mend(content) if pick.random() < share else content

    return mutate_and_mend
