"""Campaigns on the simulated stand whose stand file is wrong about its wires: counts are right, what is made
of them is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign_folder.run_metadata import CampaignMetadata
from bufferstand.drivers.interfaces import Controller, Identity, StreamFacts
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.foundation.channels.channel import Channel
from bufferstand.model.file import load_model
from bufferstand.model.stepper import SpringStepper
from bufferstand.protocols.prediction.predictor import ModelPredictor
from tests.daq.cases import Lines
from tests.daq.run_in_process import facts_of
from tests.daq.stroke_bench import MODEL, Case, SoftSpring, planned

STATIC = """
[[step]]
kind = "static"
speed_mm_per_s = 5.0
stroke_limit_mm = 50.0
force_limit_kN = 300.0
cycles = 1
"""
UNTOUCHED = "[zero]\ntouch = false\nstroke_untouched_max_mm = 2.0\n"


@dataclass(frozen=True)
class Misread:
    """What a stand file says of a channel that is not so: a factor, an offset in its unit, a delay."""

    by: float = 1.0
    plus: float = 0.0
    delay_s: float = 0.0


@dataclass(frozen=True)
class Ran:
    """A campaign that was run, and how far the specimen was compressed by truth."""

    outcome: CampaignOutcome
    opened: InProcessStand
    lines: Sequence[str]
    folder: Path
    furthest_mm: float
    most_kN: float = field(default=0.0)


def misread(facts: StreamFacts, wrong: Mapping[str, Misread]) -> StreamFacts:
    """Return a stream as a wrong stand file has it."""

    def of(channel: Channel) -> Channel:
        if (one := wrong.get(channel.name)) is None:
            return channel
        zero, slope = channel.calibration.coefficients
        coefficients = (one.by * zero + one.plus, one.by * slope)
        calibration = channel.calibration.model_copy(update={"coefficients": coefficients})
        return channel.model_copy(
            update={"calibration": calibration, "delay_s": channel.delay_s + one.delay_s}
        )

    return replace(facts, channels=tuple(of(channel) for channel in facts.channels))


def read_wrong(controller: Controller, wrong: Mapping[str, Misread]) -> None:
    """Let a controller's driver go by a stand file that is wrong, from when it connects."""
    connect = controller.connect

    def misconnect() -> Identity:
        identity = connect()
        controller.facts = misread(controller.facts, wrong)
        return identity

    controller.connect = misconnect  # type: ignore[method-assign]


def run_miswired(
    folder: Path,
    wrong: Mapping[str, Misread],
    *,
    steps: str = STATIC,
    case: Case | None = None,
    swapped: tuple[str, str] | None = None,
    factor: float = 1.0,
) -> Ran:
    """Run a campaign with a stand file that is wrong about channels, or about two thermometers' roles."""
    case = case or Case(softening=factor)
    plan, stand_file = planned(folder, steps, case)
    model = load_model(MODEL)
    opened = open_in_process(stand_file, spring=SoftSpring(SpringStepper(model, 21.0, 21.0), factor))
    read_wrong(opened.stand.controller, wrong)
    for sensor in opened.stand.sensors:
        sensor.facts = misread(sensor.facts, wrong)
    facts = facts_of(stand_file)
    shown = Lines()
    outcome = run_campaign(
        plan, opened.stand, opened.clock, folder / "out", _with_roles(facts, swapped),
        progress=shown, predictor=ModelPredictor(model),
        settings=RunSettings(pace=LoopPace(tick_s=case.tick_s)),
    )  # fmt: skip
    opened.stand.close()
    truth = opened.truth.arrays()
    return Ran(
        outcome, opened, shown.lines, folder / "out", float(truth["stroke_mm"].max()),
        float(truth["force_kN"].max()),
    )  # fmt: skip


def _with_roles(facts: CampaignMetadata, swapped: tuple[str, str] | None) -> CampaignMetadata:
    if swapped is None:
        return facts
    stand = dict(facts.stand)
    sensors = [dict(sensor) for sensor in stand["temperature"]["sensor"]]
    roles = {sensor["name"]: sensor["role"] for sensor in sensors}
    one, other = swapped
    roles[one], roles[other] = roles[other], roles[one]
    for sensor in sensors:
        sensor["role"] = roles[sensor["name"]]
    stand["temperature"] = {**stand["temperature"], "sensor": sensors}
    return replace(facts, stand=stand)
