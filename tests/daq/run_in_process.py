"""A campaign on the in-process stand, as a program: ``python -m tests.daq.run_in_process CAMPAIGN OUT``."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign_folder.run_metadata import CampaignMetadata
from bufferstand.daq.operator.stop_request import StopRequest, stop_on_signals
from bufferstand.daq.operator.terminal import PlainLines
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.model.file import load_model
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import Plan, make_plan
from bufferstand.protocols.prediction.predictor import ModelPredictor

COARSE = RunSettings(pace=LoopPace(tick_s=0.05))
"""A pass every 50 ms: a third of the processor time, where it is not the reaction that is tried."""


def sample_plan(campaign_file: Path) -> tuple[Plan, StandFile]:
    """Plan a campaign as the commands do."""
    campaign = load_campaign(campaign_file)
    stand_file = load_stand(campaign.stand_path)
    specimen = load_specimen(campaign.specimen_path).specimen
    assert specimen.model is not None
    model = load_model(campaign.specimen_path.parent / specimen.model)
    limits = StandLimits(**stand_file.limits.model_dump())
    return make_plan(campaign, limits, ModelPredictor(model), specimen), stand_file


def facts_of(stand_file: StandFile) -> CampaignMetadata:
    return CampaignMetadata(stand_file.model_dump(mode="json"), stand_file.controller.watchdog_s)


class SlowLines(PlainLines):
    """Gives the parent time to interrupt: virtual time would be over before."""

    def update(self, progress: object) -> None:
        if getattr(progress, "phase", "") == "motion":
            print("MOVING", flush=True)
            time.sleep(0.05)


def main(campaign_file: Path, out: Path) -> CampaignOutcome:
    plan, stand_file = sample_plan(campaign_file)
    opened = open_in_process(stand_file)
    request = StopRequest()
    with stop_on_signals(request):
        outcome = run_campaign(
            plan, opened.stand, opened.clock, out, facts_of(stand_file),
            progress=SlowLines(sys.stderr), stop_request=request,
        )  # fmt: skip
    truth = opened.truth.arrays()
    print(f"END {truth['force_kN'][-1]:.3f} {opened.device.controller.valve_on}", flush=True)
    return outcome


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])).exit_status)
