"""Campaigns, plans and recorders for the tests of this room."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bufferstand.daq.campaign_folder.run_metadata import CampaignMetadata
from bufferstand.daq.operator.progress import CampaignProgress
from bufferstand.foundation.specimen.file import Specimen
from bufferstand.model.file import load_model
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import Plan, make_plan
from bufferstand.protocols.prediction.predictor import ModelPredictor

SAMPLES = Path(__file__).parents[2] / "sample_runs"

HEAD = """
[campaign]
id = "test"
stand = "stand.toml"
specimen = "specimen.toml"
operator = "tester"
"""

HARMONIC = """
[[step]]
kind = "harmonic"
prestress_mm = 10.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 3
"""

STATIC = """
[[step]]
kind = "static"
speed_mm_per_s = 20.0
force_limit_kN = 100.0
cycles = 2
pause_s = 0.5
"""


def write_campaign(folder: Path, steps: str, *, limits: str = "", zero: str = "touch = false") -> Path:
    """Write a campaign file with its neighbours; return its path. By default nothing moves but its steps."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "stand.toml").write_text('[stand]\nid = "fake"\n', encoding="utf-8")
    (folder / "specimen.toml").write_text('[specimen]\nid = "spring"\n', encoding="utf-8")
    text = HEAD + f"[zero]\n{zero}\n" + (f"[limits]\n{limits}\n" if limits else "") + steps
    path = folder / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    return path


def plan_of(path: Path) -> Plan:
    """Plan a campaign for the fake stand."""
    model = load_model(SAMPLES / "models" / "category-a-elastomer.toml")
    limits = StandLimits(600.0, 250.0, 2.55, 800.0)
    return make_plan(load_campaign(path), limits, ModelPredictor(model), Specimen(id="spring"))


FACTS = CampaignMetadata({"stand": {"id": "fake"}}, watchdog_s=2.0)


@dataclass
class ListRecorder:
    """A recorder that keeps everything in lists."""

    blocks: list[tuple[Any, ...]] = field(default_factory=list)
    anchors: list[tuple[int, float, str]] = field(default_factory=list)
    events: list[tuple[float, str, str, dict[str, Any]]] = field(default_factory=list)
    written: int = 0
    durable: int = 0
    failure: Exception | None = None
    disk_warning: str | None = None
    renewals: tuple[str, ...] = ()
    closed: tuple[str, str] | None = None

    def append(
        self, stream: str, sequence: int, time_us: Any, counts: Mapping[str, Any], lost: int = 0
    ) -> None:
        self.blocks.append((stream, sequence, time_us.copy(), {k: v.copy() for k, v in counts.items()}, lost))

    def anchor(self, device_us: int, host_s: float, utc: str) -> None:
        self.anchors.append((device_us, host_s, utc))

    def event(self, at_s: float, kind: str, text: str, **data: Any) -> None:
        self.events.append((at_s, kind, text, data))

    def close(self, status: str, reason: str = "") -> Path:
        self.closed = (status, reason)
        return Path("run.h5")


@dataclass
class Lines:
    """Keeps what would have been shown."""

    lines: list[str] = field(default_factory=list)
    snapshots: list[CampaignProgress] = field(default_factory=list)

    def update(self, progress: CampaignProgress) -> None:
        self.snapshots.append(progress)

    def message(self, text: str) -> None:
        self.lines.append(text)
