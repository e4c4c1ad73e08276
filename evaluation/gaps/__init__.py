"""Gaps of a record: which steps hide something, which are rest, and what the others may change."""

__all__ = [
    "bounds",
    "bridge",
    "clock",
    "coarse",
    "donors",
    "even",
    "events",
    "found",
    "numbering",
    "reread",
    "steps",
    "words",
]
