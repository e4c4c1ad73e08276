"""How many mutants of each module were noticed when it was last tried in full: ``scores.json``."""

from __future__ import annotations

import json
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("scores.json")


def scores() -> dict[str, dict[str, Any]]:
    """Return killed, timed out, survived, day and commit by module."""
    content: dict[str, dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    return content


def remember(module: str, ends: Counter[str], commit: str) -> None:
    """Keep what became of all mutants of a module."""
    new = {end: ends[end] for end in ("killed", "timed out", "survived")}
    day = datetime.now(UTC).date().isoformat()
    content = scores() | {module: {**new, "day": day, "commit": commit}}
    FILE.write_text(json.dumps(dict(sorted(content.items())), indent=1) + "\n", encoding="utf-8")
