"""The paper's whole grid in virtual time, in either order: ``python -m tests.daq.orders ORDER``."""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign_folder.as_run import read_as_run
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.model.file import load_model
from bufferstand.protocols.planning.plan import Plan
from bufferstand.protocols.prediction.predictor import ModelPredictor
from tests.daq.cases import SAMPLES
from tests.daq.run_in_process import facts_of, sample_plan

PASS_S = 0.1
"""Five times the pass of a stand: every sample is judged all the same, only the reaction is later by as much
(0.1 s of virtual time, where nobody is hurt), and a tenth of a temperature's period."""


@dataclass(frozen=True)
class Measured:
    """How a campaign went: what was planned, the stand's time, and that of the processor [s]."""

    plan: Plan
    outcome: CampaignOutcome
    stand_s: float
    processor_s: float
    waited_s: float


def campaign_as_given(folder: Path) -> Path:
    """Write the paper's grid with its steps in the order as written."""
    text = (
        (SAMPLES / "paper-full.toml")
        .read_text(encoding="utf-8")
        .replace('order = "soonest"', 'order = "given"')
    )
    for name in ("stand.toml", "specimens/category-a-elastomer.toml"):
        text = text.replace(f'"{name}"', f'"{SAMPLES / name}"')
    path = folder / "paper-given.toml"
    path.write_text(text, encoding="utf-8")
    return path


def measure(campaign: Path, out: Path, *, pass_s: float = PASS_S) -> Measured:
    """Run a campaign on the in-process stand, learning as it goes."""
    began_s = time.process_time()
    plan, stand_file = sample_plan(campaign)
    predictor = ModelPredictor(load_model(SAMPLES / "models" / "category-a-elastomer.toml"))
    opened = open_in_process(stand_file, log_truth=False)
    outcome = run_campaign(
        plan, opened.stand, opened.clock, out, facts_of(stand_file),
        settings=RunSettings(pace=LoopPace(tick_s=pass_s)), predictor=predictor,
    )  # fmt: skip
    waited_s = sum(row.duration_s for row in read_as_run(out) if row.pause or row.kind == "cool-down")
    return Measured(plan, outcome, opened.clock.now_s(), time.process_time() - began_s, waited_s)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("order", choices=("soonest", "given"))
    parser.add_argument("--pass-s", type=float, default=PASS_S)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="bufferstand-") as name:
        folder = Path(name)
        campaign = SAMPLES / "paper-full.toml" if given.order == "soonest" else campaign_as_given(folder)
        began_s = time.perf_counter()
        found = measure(campaign, folder / "out", pass_s=given.pass_s)
        print(
            f"{given.order}: {found.outcome.status} {found.outcome.reason}, {len(found.outcome.runs)} runs, "
            f"{found.stand_s:.0f} s of the stand (planned {found.plan.expected_duration_s:.0f} s), of which "
            f"{found.waited_s:.0f} s waiting to cool, in {found.processor_s:.0f} s of a processor, "
            f"{time.perf_counter() - began_s:.0f} s of the wall",
            flush=True,
        )


if __name__ == "__main__":
    main()
