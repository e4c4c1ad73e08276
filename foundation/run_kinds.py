"""The kinds of runs, on their own: options name them before anything heavy is imported."""

from __future__ import annotations

from typing import Literal

Kind = Literal["static", "harmonic", "impact", "proof"]
"""Kind of a run (docs/evaluation-document.md)."""
