"""A short campaign as a user runs it, in processes of its own."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

SAMPLES = Path(__file__).parents[2] / "sample_runs"
SPECIMEN = "A-105-E-01"
CAMPAIGN = """
[campaign]
id = "peer"
stand = "stand.toml"
specimen = "specimens/category-a-elastomer.toml"
operator = "peers"

[limits]
force_max_kN = 300.0
no_temperature_stop = "a peer has no thermometer; its springs are bits"

[[step]]
kind = "static"
speed_mm_per_s = 20.0
stroke_limit_mm = 15.0

[[step]]
kind = "harmonic"
prestress_mm = 12.0
amplitude_mm = 8.0
frequency_Hz = 2.5
cycles = {cycles}
"""


def write_campaign(folder: Path, cycles: int = 5, *, touch: bool = True) -> Path:
    """Put a campaign beside the stand file of a peer; ``touch``: it begins with touching off."""
    for name in ("specimens/category-a-elastomer.toml", "models/category-a-elastomer.toml"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes((SAMPLES / name).read_bytes())
    campaign = folder / "campaign.toml"
    zero = "" if touch else "\n[zero]\ntouch = false\n"
    campaign.write_text(CAMPAIGN.format(cycles=cycles) + zero)
    return campaign


def command(*words: str | Path) -> list[str]:
    """Give the words that start a command of bufferstand."""
    return [sys.executable, "-P", "-m", "bufferstand", *map(str, words)]


def bufferstand(*words: str | Path, timeout_s: float = 300.0) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(command(*words), capture_output=True, text=True, timeout=timeout_s, check=False)


@cache
def armed(name: str) -> tuple[str, ...]:
    """Give the answer that `run` and `resume` want before they move a real stand."""
    asks = "--yes-move" in bufferstand(name, "--help").stdout
    return ("--yes-move", SPECIMEN) if asks else ()
