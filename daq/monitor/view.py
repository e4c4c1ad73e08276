"""What every page shows: rows of samples and named sections, each made into JSON once for all pages."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

KEPT_PACKETS = 600
"""Packets of rows that are kept: a page that opens begins with the last half minute."""


@dataclass
class Cursor:
    """How far a page has been told."""

    packet: int = -1
    revisions: dict[str, int] = field(default_factory=dict)
    skipped: int = 0


class View:
    """Rows and sections with their revisions; for one thread.

    Parameters
    ----------
    wall_s : callable
        Time of the wall [s].
    """

    def __init__(self, wall_s: Callable[[], float] = time.monotonic) -> None:
        self._wall_s = wall_s
        self._rows: deque[tuple[int, str]] = deque(maxlen=KEPT_PACKETS)
        self._number = 0
        self._sections: dict[str, tuple[int, str]] = {}
        self._sampled_s: float | None = None
        self.over = False
        """Nothing more will come: the page is to be told so and closed."""

    def put(self, name: str, content: Any) -> None:
        """Replace a section; pages are told only if it has changed."""
        text = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
        revision, before = self._sections.get(name, (0, ""))
        if text != before:
            self._sections[name] = (revision + 1, text)

    def add_rows(self, rows: dict[str, Any], *, old_s: float = 0.0) -> None:
        """Take rows of samples, the newest of which is ``old_s`` old."""
        if not rows:
            return
        self._sampled_s = self._wall_s() - old_s
        self._rows.append((self._number, json.dumps(rows, separators=(",", ":"))))
        self._number += 1

    def clear_rows(self) -> None:
        """Forget the rows: another run begins somewhere else on the device's clock."""
        self._rows.clear()

    @property
    def sample_age_s(self) -> float | None:
        """Return how old the newest sample is [s], None where there was none."""
        return None if self._sampled_s is None else self._wall_s() - self._sampled_s

    def news(self, cursor: Cursor) -> str | None:
        """Return a message with all that a page does not know yet, and move its cursor; None if nothing."""
        first = self._rows[0][0] if self._rows else self._number
        skipped = max(0, first - cursor.packet - 1) if cursor.packet >= 0 else 0
        rows = [text for number, text in self._rows if number > cursor.packet]
        sections = {
            name: (revision, text)
            for name, (revision, text) in self._sections.items()
            if cursor.revisions.get(name) != revision
        }
        if not rows and not sections:
            return None
        cursor.packet = self._number - 1
        cursor.skipped += skipped
        cursor.revisions.update({name: revision for name, (revision, _) in sections.items()})
        told = ",".join(f"{json.dumps(name)}:{text}" for name, (_, text) in sections.items())
        return (
            f'{{"rows":[{",".join(rows)}],"sections":{{{told}}},'
            f'"age_s":{json.dumps(self._rounded_age())},"skipped":{cursor.skipped}}}'
        )

    def sign_of_life(self) -> str:
        """Return a message that says only how old the newest sample is."""
        return f'{{"age_s":{json.dumps(self._rounded_age())}}}'

    def _rounded_age(self) -> float | None:
        age_s = self.sample_age_s
        return None if age_s is None else round(age_s, 2)
