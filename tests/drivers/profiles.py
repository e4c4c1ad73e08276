"""Register maps that tests make of the shipped ones."""

from __future__ import annotations

import tempfile
from pathlib import Path

from bufferstand.drivers.register_maps.profile import SHIPPED, Profile, load_profile

RING_TEXT = (SHIPPED / "ring.toml").read_text(encoding="utf-8")


def changed_ring(changes: dict[str, str]) -> Profile:
    """The shipped ring profile with some words exchanged, each of which must be there."""
    text = RING_TEXT
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new, 1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "changed.toml"
        path.write_text(text, encoding="utf-8")
        return load_profile(str(path))


def plain_ring() -> Profile:
    """A ring without the optional fields: no echo of what was asked, no CRC; 15 samples in 125 registers."""
    return changed_ring({'"asked:u32", ': "", ', "check:u32"]': "]", "registers = 121": "registers = 125"})
