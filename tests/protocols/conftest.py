"""A campaign file in a temporary folder, and a plan of it on the closed-form spring."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bufferstand.foundation.specimen.file import Specimen
from bufferstand.protocols.campaign_file.schema import Campaign, load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import Plan, make_plan
from tests.protocols.spring import ClosedFormSpring

HEAD = '[campaign]\nid = "test"\nstand = "stand.toml"\nspecimen = "specimens/a.toml"\n'
STAND = StandLimits(force_max_kN=600.0, stroke_max_mm=250.0, frequency_max_Hz=2.55, speed_max_mm_per_s=800.0)
SPECIMEN = Specimen(id="A-1", category="A", max_stroke_mm=105.0, elastic_system="elastomer")

Load = Callable[[str], Campaign]
MakePlan = Callable[..., Plan]


def harmonic(
    prestress: float, amplitude: float, rate: str = "frequency_Hz = 1.0", cycles: int = 5, more: str = ""
) -> str:
    return (
        f'[[step]]\nkind = "harmonic"\nprestress_mm = {prestress!r}\namplitude_mm = {amplitude!r}\n{rate}\n'
        f"cycles = {cycles}\n{more}\n"
    )


@pytest.fixture
def load(tmp_path: Path) -> Load:
    def read(text: str) -> Campaign:
        path = tmp_path / "campaign.toml"
        path.write_text(HEAD + text, encoding="utf-8")
        return load_campaign(path)

    return read


@pytest.fixture
def plan(load: Load) -> MakePlan:
    def make(
        text: str,
        *,
        stand: StandLimits = STAND,
        specimen: Specimen = SPECIMEN,
        spring: ClosedFormSpring | None = None,
    ) -> Plan:
        return make_plan(load(text), stand, spring or ClosedFormSpring(), specimen)

    return make
