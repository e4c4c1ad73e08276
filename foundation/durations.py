"""Durations in words: one wording for plan, demo and report."""

from __future__ import annotations


def duration_text(duration_s: float) -> str:
    """Return a duration as a person says it: ``5.5 s``, ``7 min 48 s`` or ``2 h 05 min``."""
    if duration_s < 60.0:
        return f"{duration_s:.1f} s"
    minutes, seconds = divmod(round(duration_s), 60)
    if minutes < 60:
        return f"{minutes} min {seconds:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"
