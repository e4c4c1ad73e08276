"""Stands in virtual time whose first contact is touched off: wired wrongly in many ways, and right at random.

``python -m tests.daq.touch_stands N`` touches N right stands off and says which were doubted.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.model.file import load_model
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import make_plan
from bufferstand.protocols.prediction.predictor import ModelPredictor
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import COARSE, facts_of

MODEL = SAMPLES / "models" / "category-a-elastomer.toml"
STATIC = """
[[step]]
kind = "static"
speed_mm_per_s = 5.0
force_limit_kN = {force_kN}
cycles = 1
"""
FAST = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 15.0
peak_speed_mm_per_s = 40.0
cycles = 1
"""


HELD = """
[[step]]
kind = "hold"
stroke_mm = 5.0
duration_s = 1.0
record = true
"""


@dataclass(frozen=True)
class Ran:
    """A campaign that was run, what is on record of its end, and how far the specimen went by truth."""

    outcome: CampaignOutcome
    trip: Mapping[str, Any]
    lines: tuple[str, ...]
    folder: Path
    furthest_mm: float
    most_kN: float


def run_stand(
    folder: Path,
    simulation: Mapping[str, object] | None = None,
    miswired: str = "",
    *,
    steps: str = STATIC.format(force_kN=300.0),
    head: str = "",
    amplifier: bool = True,
) -> Ran:
    """Run a campaign on the sample stand with keys of its simulation changed, and wired wrongly."""
    folder.mkdir(parents=True, exist_ok=True)
    text = (SAMPLES / "stand.toml").read_text(encoding="utf-8")
    if not amplifier:
        text = re.sub(r"^\[amplifier\].*?(?=^\[temperature\])", "", text, flags=re.DOTALL | re.MULTILINE)
    for key, value in {"model": f'"{MODEL}"', **(simulation or {})}.items():
        line = f"{key} = {value}"
        text, there = re.subn(rf"^{key} = .*$", line, text, flags=re.MULTILINE)
        text += "" if there else f"{line}\n"
    (folder / "stand.toml").write_text(f"{text}\n{miswired}", encoding="utf-8")
    specimen = SAMPLES / "specimens" / "category-a-elastomer.toml"
    path = folder / "campaign.toml"
    start = f'[campaign]\nid = "test"\nstand = "stand.toml"\nspecimen = "{specimen}"\n{head}'
    path.write_text(start + steps, encoding="utf-8")
    file = load_campaign(path)
    stand_file, predictor = load_stand(file.stand_path), ModelPredictor(load_model(MODEL))
    limits = StandLimits(**stand_file.limits.model_dump())
    plan = make_plan(file, limits, predictor, load_specimen(file.specimen_path).specimen)
    opened = open_in_process(stand_file)
    shown = Lines()
    outcome = run_campaign(
        plan, opened.stand, opened.clock, folder / "out", facts_of(stand_file),
        progress=shown, predictor=predictor, settings=COARSE,
    )  # fmt: skip
    opened.stand.close()
    record = json.loads((folder / "out" / "campaign.json").read_text(encoding="utf-8"))
    truth = opened.truth.arrays()
    return Ran(
        outcome, record["trip"], tuple(shown.lines), folder / "out", float(truth["stroke_mm"].max()),
        float(truth["force_kN"].max()),
    )  # fmt: skip


def wrong(signal: str, **keys: object) -> str:
    """Return a table of ``[simulation.miswired]``."""
    rows = "".join(f"{key} = {json.dumps(value)}\n" for key, value in keys.items())
    return f"[simulation.miswired.{signal}]\n{rows}\n"


def exchange(one: str, other: str, **keys: object) -> str:
    """Return the tables of two channels with each other's inputs."""
    return wrong(one, reads=other, **keys) + wrong(other, reads=one)


@dataclass(frozen=True)
class Kind:
    """What is wrong, the sensors that must be named, and what is said of them."""

    tables: str
    sensor: str
    doubts: tuple[str, ...]
    most_kN: float = 10.0
    """Greatest force that the specimen may see."""
    seen_safe: bool = True
    """Whether the force that is left can be seen to be none: not by one whose zero reads as a load."""


def _force(doubts: str | tuple[str, ...] = "scale", most_kN: float = 10.0, **keys: object) -> Kind:
    return Kind(wrong("force", **keys), "force", (doubts,) if isinstance(doubts, str) else doubts, most_kN)


def _position(doubt: str, **keys: object) -> Kind:
    return Kind(wrong("position", **keys), "position", (doubt,))


KINDS: Mapping[str, Kind] = {
    "force: ten times": Kind(wrong("force", scale=10.0), "force", ("scale",), seen_safe=False),
    "force: five times": _force(scale=5.0),
    "force: a fifth": _force(scale=0.2, most_kN=40.0),
    "force: a tenth": _force(scale=0.1, most_kN=40.0),
    "force: a fifth in the file": _force(scale=0.2, controller_too=False),
    "force: a hundredth": Kind(wrong("force", scale=0.01), "force, force_2", ("scale",)),
    "force: sign": _force("sign", scale=-1.0),
    "force: 0.2 s late": _force("delay", delay_s=0.2),
    "force: 0.4 s late": _force("delay", most_kN=15.0, delay_s=0.4),
    "force: 0.8 s late": _force("delay", most_kN=15.0, delay_s=0.8),
    "force: 0.5 s late in the file": _force("delay", delay_s=0.5, controller_too=False),
    "force: the piston's way": _force("disagrees", reads="position"),
    "piston: half": _position("scale", scale=0.5),
    "piston: twice": _position("scale", scale=2.0),
    "piston: sign": _position("sign", scale=-1.0),
    "piston: 15 mm off": _position("zero", zero=15.0),
    "force and wire": Kind(exchange("force", "stroke_1"), "force, stroke_1", ("swapped",)),
    "force and wire in the file": Kind(
        exchange("force", "stroke_2", controller_too=False), "force, stroke_2", ("swapped",)
    ),
    "force and piston": Kind(exchange("force", "position"), "force, position", ("swapped",)),
    "force and piston in the file": Kind(
        exchange("force", "position", controller_too=False), "force, position", ("swapped",)
    ),
    "both wires 15 mm off": Kind(
        wrong("stroke_1", zero=15.0) + wrong("stroke_2", zero=15.0), "stroke_1, stroke_2", ("zero",)
    ),
    "a wire 15 mm off": Kind(wrong("stroke_2", zero=-15.0), "stroke_2", ("zero",)),
}
"""Met in the touch, on the sample stand: each must be named before the first full stroke."""


def right_stand(seed: int) -> tuple[dict[str, object], bool, str]:
    """Return a right stand at random: keys of its simulation, whether it has an amplifier, and a step."""
    random = np.random.default_rng(seed)

    def pick(*values: float) -> float:
        return float(values[random.integers(len(values))])

    wire_mm = float(random.uniform(-9.0, 9.0))
    apart_mm = float(np.sign(wire_mm) * random.uniform(0.0, 1.5))
    gap_mm = float(random.uniform(-2.0, 9.5)) if random.integers(4) else 0.0
    keys: dict[str, object] = {
        "seed": seed,
        "specimen_force_factor": round(float(random.uniform(0.6, 1.4)), 3),
        "wire_zero_mm": [round(wire_mm, 3), round(wire_mm - apart_mm, 3)],
        "gap_mm": round(gap_mm, 3),
        "piston_start_mm": round(min(0.0, gap_mm) - max(0.0, float(random.uniform(-4.0, 6.0))), 3),
        "force_zero_kN": round(float(random.uniform(-0.8, 3.0)), 3),
        "force_noise_kN": pick(0.03, 0.1, 0.15, 0.25),
        "force_flicker_kN": pick(0.0, 0.02, 0.05),
        "force_hum_kN": pick(0.0, 0.05, 0.1),
        "force_delay_s": pick(0.0008, 0.005, 0.02),
        "force_low_pass_Hz": pick(20.0, 50.0, 100.0, 1000.0),
        "stroke_noise_mm": pick(0.005, 0.01, 0.03),
        "stroke_flicker_mm": pick(0.0, 0.005, 0.01),
        "stroke_hum_mm": pick(0.0, 0.005, 0.02, 0.05),
        "frame_stiffness_kN_per_mm": pick(100.0, 120.0, 150.0, 300.0),
        "actuator_bandwidth_Hz": pick(3.0, 8.0, 15.0, 30.0),
        "servo_lag_s": pick(0.0, 0.003, 0.02, 0.1),
        "reversal_s": pick(0.0, 0.01, 0.03, 0.06, 0.2),
        "wire_tilt": pick(0.0, 0.001, 0.005),
        "reply_jitter_s": pick(0.0, 0.0001, 0.002),
        "missed_cycles_per_h": pick(0.0, 30.0, 3000.0),
    }
    step = STATIC.format(force_kN=60.0) if random.integers(2) else FAST
    return keys, bool(random.integers(4)), step


def alarms(folder: Path, seeds: Iterable[int]) -> list[str]:
    """Return what was doubted of right stands."""
    found = []
    for seed in seeds:
        keys, amplifier, step = right_stand(seed)
        if float(str(keys["gap_mm"])) < 0.0:
            step = HELD  # no cycles begin there
        ran = run_stand(folder / str(seed), keys, steps=step, amplifier=amplifier)
        if ran.trip.get("doubt"):
            found.append(f"{seed}: {ran.outcome.reason} {keys}")
    return found


def main(first: int, end: int) -> None:
    """Print what the study finds."""
    with TemporaryDirectory() as folder:
        found = alarms(Path(folder), range(first, end))
    print(f"right stands {first} to {end - 1}: {len(found)} doubted", *found, sep="\n  ")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
