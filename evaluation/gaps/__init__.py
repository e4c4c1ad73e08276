"""What is not on record: which steps hide something, what is rest, and what the rest may change."""

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
