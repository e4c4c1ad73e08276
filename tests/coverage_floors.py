"""The share of each room's lines that the fast lane runs must not fall below its floor.

``python -m tests.coverage_floors FILE.json``: the file is coverage's own report, the floors lie in
``coverage_floors.toml``. Exit status 1 where a room fell below.
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

FLOORS = Path(__file__).with_suffix(".toml")


def by_room(report: Mapping[str, Any]) -> dict[str, float]:
    """Return the share [%] of the lines of each room that ran."""
    lines: Counter[str] = Counter()
    ran: Counter[str] = Counter()
    for name, file in report["files"].items():
        room = Path(name).parts[0]
        lines[room] += file["summary"]["num_statements"]
        ran[room] += file["summary"]["covered_lines"]
    return {room: 100.0 * ran[room] / lines[room] for room in sorted(lines) if lines[room]}


def fallen(shares: Mapping[str, float], floors: Mapping[str, int]) -> list[str]:
    """Return a line for each room below its floor, without one, or not measured."""
    below = [
        f"{room}: {shares.get(room, 0.0):.1f} % of its lines run in the fast lane, the floor is {floor} %"
        for room, floor in floors.items()
        if shares.get(room, 0.0) < floor
    ]
    return below + [f"{room}: no floor in {FLOORS.name}" for room in sorted(shares.keys() - floors.keys())]


def main(report: Path) -> int:
    """Print the share of each room beside its floor; return 1 if one fell below."""
    floors = tomllib.loads(FLOORS.read_text(encoding="utf-8"))["percent"]
    shares = by_room(json.loads(report.read_text(encoding="utf-8")))
    for room, share in shares.items():
        print(f"{room:12s} {share:5.1f} %  floor {floors.get(room, '—')} %")
    wrong = fallen(shares, floors)
    for line in wrong:
        print(line, file=sys.stderr)
    return int(bool(wrong))


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1])))
