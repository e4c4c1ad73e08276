"""Pages written by hand say what the code says: every key of a file, and messages as they are printed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
ROOMS = sorted(path.resolve() for path in (ROOT / "bufferstand").iterdir() if path.is_symlink())


def tables(page: str) -> dict[str, list[tuple[str, ...]]]:
    """Return the rows of a page's tables by the heading above them, each a tuple of its cells."""
    found: dict[str, list[tuple[str, ...]]] = {}
    heading = ""
    for line in (DOCS / page).read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            heading = line.removeprefix("## ").strip("`[] ")
        elif line.startswith("| ") and not line.startswith("| key"):
            found.setdefault(heading, []).append(tuple(re.split(r"\s*\|\s*", line)[1:-1]))
    return found


def printed() -> Iterator[str]:
    """Yield the source of every module, in which messages stand; what lines part is joined."""
    for room in ROOMS:
        for path in room.rglob("*.py"):
            yield re.sub(r'"\s*\n\s*f?"', "", path.read_text(encoding="utf-8"))


def test_messages_in_the_page_of_troubles_are_the_programs_own() -> None:
    said = [
        message
        for rows in tables("troubleshooting.md").values()
        for row in rows
        for message in re.findall(r"`([^`]+)`", row[0])
        if message not in {"—", "check"}
    ]
    assert len(said) >= 20
    code = "\n".join(printed())
    assert [message for message in said if message not in code] == []
