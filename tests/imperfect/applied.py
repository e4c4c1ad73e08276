"""One imperfection as it was put into a record, and how a document may name it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

STROKE_FIGURES = frozenset(
    {
        "stroke_min_mm",
        "stroke_max_mm",
        "prestress_mm",
        "amplitude_mm",
        "speed_loading_max_mm_per_s",
        "speed_unloading_max_mm_per_s",
        "speed_max_mm_per_s",
        "frequency_Hz",
        "immediate-unloading",
        "full-release",
        "full-stroke",
        "speed-limit",
        "cycle-count",
        "pause-limit",
    }
)
FORCE_FIGURES = frozenset({"force_min_kN", "force_max_kN"})
TEMPERATURE_FIGURES = frozenset(
    {"temperature_start_C", "temperature_max_C", "temperature_min_C", "temperature-range"}
)
RUN_CONDITIONS = frozenset({"rest-after-assembly"})
CLAUSE = re.compile(r"[;\n]|\.\s")


@dataclass(frozen=True)
class Applied:
    """One imperfection.

    `figures` says what may be asked: "within", U must hold for every figure; "named", what it falsifies may
    be wrong where the document names the fault; "hidden", the record cannot show the fault (the
    laboratory's own statement is false), and what it falsifies is not held. What it does not falsify is
    held in every case.
    """

    name: str
    size: str
    kinds: tuple[str, ...] = ()  # kinds of a plausibility finding that name it
    words: tuple[str, str] | None = None  # a warning names it by both of these in one clause
    channel: str = ""  # whose readings are false: force, stroke, temperature, time
    figures: str = "within"
    falsifies: frozenset[str] | None = None  # figures and requirements; None: all that the channel goes into
    start_s: float = -math.inf  # where it acts, true time
    end_s: float = math.inf
    may: tuple[str, ...] = ()  # kinds of findings that it may cause besides
    plain: bool = (
        False  # of the list, and so large that it must be named unless figures stay within U
    )
    harmless: bool = False  # costs no cycle and no verdict
    factor: float = 1.0  # by which it changes the force from start_s on
    right: Callable[[float], bool] | None = None  # whether the size that a finding of its kinds tells is true

    def touches(self, figure: str) -> bool:
        """Return whether this figure or requirement is read from what the fault falsifies."""
        if self.figures == "within":
            return False
        if self.falsifies is not None:
            return figure in self.falsifies
        spared = {
            "stroke": FORCE_FIGURES | TEMPERATURE_FIGURES,
            "force": STROKE_FIGURES | TEMPERATURE_FIGURES,
        }
        if self.channel == "temperature":
            return figure in TEMPERATURE_FIGURES
        return figure not in RUN_CONDITIONS | spared.get(self.channel, frozenset())

    def overlaps(self, start_s: float, end_s: float) -> bool:
        """Return whether it acts within this time."""
        return self.start_s <= end_s and self.end_s >= start_s

    def fits(self, finding: dict[str, Any], start_s: float, end_s: float, *, may: bool = False) -> bool:
        """Return whether a plausibility finding names it; start and end are true times of the finding.

        `may`: whether it may be the cause.
        """
        kinds = self.kinds + self.may if may else self.kinds
        kind, channel = finding.get("kind"), str(finding.get("channel") or "")
        # a turned sign shows in the loop's area, cycles that are unlike in either channel
        either = not channel or self.channel in {"", "time"} or kind in {"sign", "unlike"}
        same = either or channel.startswith(self.channel)
        if self.right is not None and kind in self.kinds and not self.right(float(finding["size"])):
            return False
        return kind in kinds and same and self.overlaps(start_s, end_s)

    def said_in(self, warnings: list[str]) -> bool:
        """Return whether a warning says it in words: what is wrong and with what, in one clause."""
        if self.words is None:
            return False
        clauses = (c for w in warnings for c in CLAUSE.split(w))
        return any(all(re.search(p, c, re.IGNORECASE) for p in self.words) for c in clauses)
