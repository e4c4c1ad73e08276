from __future__ import annotations

from pathlib import Path

from drivers.command_port import REJECT_TEXTS
from drivers.ds18b20 import ReadingFault
from drivers.profile import Profile

TEXT = (Path(__file__).parents[2] / "docs" / "drivers.md").read_text(encoding="utf-8")
SENSORS = (Path(__file__).parents[2] / "docs" / "sensors.md").read_text(encoding="utf-8")


def test_the_register_table_is_the_profile(profile: Profile) -> None:
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in TEXT.splitlines()
        if line.startswith("| ") and line.count("|") == 7 and line[2].isdigit()
    ]
    documented = [(int(row[0]), row[1].strip("`"), *row[2:5]) for row in rows]
    real = [(r.address, r.name, r.type, r.access, r.unit) for r in profile.registers.values()]
    assert documented == real


def test_the_ring_is_the_profile(profile: Profile) -> None:
    ring = profile.ring
    assert f"begins at address {ring.address} and has {ring.registers} registers" in TEXT
    assert f"{ring.samples_per_block} samples of {ring.sample_words} registers" in TEXT
    joined = " ".join(TEXT.split())
    for name, kind in (*ring.header, *ring.sample):
        assert f"`{name}` {kind}" in joined


def test_codes_have_a_meaning(profile: Profile) -> None:
    description = profile.find("reject_code").description
    assert all(f"{code} " in description for code in REJECT_TEXTS)
    assert len(ReadingFault) == 13
    assert "Thirteen different faults" in SENSORS
