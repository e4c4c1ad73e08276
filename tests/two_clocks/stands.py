"""The shipped stand with a LabJack T7 beside its controller, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bufferstand.daq.acquisition import LoopPace
from bufferstand.daq.campaign import CampaignOutcome, RunSettings, run_campaign
from bufferstand.drivers.simulated.faults import ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from tests.daq.cases import Lines
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

ACQUISITION = """
[figures]
force = "force_2"

[[acquisition]]
kind = "labjack"
model = "T7"
host = "127.0.0.1"
rate_Hz = 1000.0

[[acquisition.input]]
terminal = "AIN0"
channel = FORCE

[[acquisition.input]]
terminal = "AIN1"
channel = STROKE

[simulation]
"""
CERTIFICATE = 'certificate = "bench", date = "2026-01-15", valid_until = "2099-01-15"'
FORCE = (
    '{ name = "force_2", quantity = "force", unit = "kN", calibration = { id = "630 kN at 10 V", '
    f"coefficients = [0.0, 63.0], {CERTIFICATE} }}, "
    "uncertainty = { accuracy_percent = 0.1, zero = 0.3, u_delay_s = 2e-5 } }"
)
STROKE = (
    '{ name = "stroke_3", quantity = "stroke", unit = "mm", calibration = { id = "500 mm at 10 V", '
    f"coefficients = [-35.0, 50.0], {CERTIFICATE} }}, "
    "uncertainty = { linearity = 0.25, zero = 0.05, u_delay_s = 2e-5 } }"
)
STEP = """
[[step]]
kind = "harmonic"
prestress_mm = 40.0
amplitude_mm = 10.0
frequency_Hz = 1.0
cycles = 25
"""


def with_acquisition(text: str) -> str:
    """Return a stand file with a T7 instead of the second amplifier."""
    before, _, behind = text.partition("[amplifier]\n")
    _, head, rest = behind.partition("[temperature]\n")
    assert head
    return (
        before
        + head
        + rest.replace("[simulation]\n", ACQUISITION.replace("FORCE", FORCE).replace("STROKE", STROKE), 1)
    )


def written(folder: Path, steps: str = STEP, simulation: str = "") -> Path:
    path = campaign(folder, steps)
    stand = folder / "stand.toml"
    text = with_acquisition(stand.read_text(encoding="utf-8"))
    stand.write_text(text + simulation, encoding="utf-8")
    return path


def run(
    path: Path, *, faults: Sequence[ScheduledFault] = (), out: str = "out"
) -> tuple[CampaignOutcome, InProcessStand, Lines]:
    plan, stand_file = sample_plan(path)
    opened = open_in_process(stand_file, faults=faults)
    shown = Lines()
    settings = RunSettings(pace=LoopPace(tick_s=0.05))
    outcome = run_campaign(
        plan,
        opened.stand,
        opened.clock,
        path.parent / out,
        facts_of(stand_file),
        progress=shown,
        settings=settings,
    )
    opened.stand.close()
    return outcome, opened, shown
