"""Reading the consoles of a page, and comparing what they show with what a command really printed."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

RELATIVE = 0.03
"""Share by which a printed figure may differ: sensors are noisy."""
_BLOCK = re.compile(
    r"<!-- file: (?P<file>\S+) -->\n```toml\n(?P<text>.*?)```"
    r"|<!-- change (?P<changed>\S+): (?P<old>.*?) -> (?P<new>.*?) -->"
    r"|```console\n(?P<console>.*?)```",
    re.DOTALL,
)
_NUMBER = r"-?\d+(?:\.\d+)?"
_MOMENT = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d")
ANYTHING = "…"


@dataclass
class Write:
    """A file that the reader saves."""

    file: str
    text: str


@dataclass
class Change:
    """A text that the reader puts in place of another."""

    file: str
    old: str
    new: str


@dataclass
class Command:
    """A command that the reader types, and the lines that the page shows for it."""

    line: str
    shows: list[str] = field(default_factory=list)


def steps_of(page: Path) -> list[Write | Change | Command]:
    """Return what a page has its reader do, in order."""
    steps: list[Write | Change | Command] = []
    for block in _BLOCK.finditer(page.read_text(encoding="utf-8")):
        if block["file"]:
            steps.append(Write(block["file"], block["text"]))
        elif block["changed"]:
            steps.append(Change(block["changed"], block["old"], block["new"]))
        else:
            for line in block["console"].splitlines():
                if line.startswith("$ "):
                    steps.append(Command(line[2:]))
                else:
                    last = steps[-1]
                    assert isinstance(last, Command), f"a console begins with a command, not with {line!r}"
                    last.shows.append(line)
    return steps


def differs(shown: list[str], printed: list[str]) -> str | None:
    """Return the first line of a page that was not printed, None if the page tells the truth.

    White space counts for nothing, a figure may differ by 3 % or one in its last digit, “…” is anything:
    within a line some text, as a line of its own any number of lines.
    """
    shown = [line for line in map(_plain, shown) if line]
    printed = [line for line in map(_plain, printed) if line]
    at, free = 0, False
    for line in shown:
        if line == ANYTHING:
            free = True
            continue
        while not (at < len(printed) and _same(line, printed[at])):
            if not free or at >= len(printed):
                return (
                    f"{line!r} is shown, {printed[at] if at < len(printed) else 'nothing more'!r} was printed"
                )
            at += 1
        at, free = at + 1, False
    if at < len(printed) and not free:
        return f"{printed[at]!r} was printed, the page ends before it"
    return None


def _plain(line: str) -> str:
    return " ".join(_MOMENT.sub("<moment>", line).split())


def _same(shown: str, printed: str) -> bool:
    parts = re.split(f"({_NUMBER}|{ANYTHING})", shown)
    pattern, figures = "", []
    for part in parts:
        if part == ANYTHING:
            pattern += ".*?"
        elif re.fullmatch(_NUMBER, part):
            pattern += f"({_NUMBER})"
            figures.append(part)
        else:
            pattern += re.escape(part)
    match = re.fullmatch(pattern, printed)
    return match is not None and all(map(_near, figures, match.groups()))


def _near(shown: str, printed: str) -> bool:
    last_digit = 10.0 ** -len(shown.partition(".")[2])
    bound = max(RELATIVE * abs(float(shown)), 1.001 * last_digit if "." in shown else 0.0)
    return abs(float(shown) - float(printed)) <= bound
