"""Damages bytes as bad disks, broken transfers and strangers do; the same seed gives the same damage."""

from __future__ import annotations

import random

EXTREMES = (b"\x00" * 8, b"\xff" * 8, b"\xff" * 7 + b"\x7f", b"\x00" * 7 + b"\x80", b"\x01" + b"\x00" * 7)
"""Of eight bytes: as counts, lengths and places in a file they mean nothing, all, or far too much."""


def mutated(content: bytes, pick: random.Random) -> bytes:
    """Return content with one to four damages: bits, extremes, a cut, a doubled or a lost piece."""
    damaged = bytearray(content)
    for _ in range(pick.randint(1, 4)):
        at = pick.randrange(max(1, len(damaged)))
        kind = pick.randrange(6)
        if kind == 0 and damaged:
            damaged[at] ^= 1 << pick.randrange(8)
        elif kind == 1:
            size = pick.choice((1, 2, 4, 8))
            damaged[at : at + size] = pick.choice(EXTREMES)[:size]
        elif kind == 2:
            damaged[at : at + 8] = pick.randbytes(min(8, len(damaged) - at))
        elif kind == 3:
            size = pick.randint(1, 64)
            damaged[at:at] = damaged[at : at + size]
        elif kind == 4:
            del damaged[at : at + pick.randint(1, 64)]
        elif pick.randrange(4) == 0:
            del damaged[at:]
    return bytes(damaged)
