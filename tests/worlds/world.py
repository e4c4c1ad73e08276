"""One world: a stand, a specimen, a campaign and what goes wrong, all drawn from one seed."""

from __future__ import annotations

import random
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.contract.stand.backends import AED, GSV2, MODBUS_TCP
from tests.daq.cases import SAMPLES
from tests.worlds.troubles import Trouble, draw_troubles

SPECIMENS = {"category-a-elastomer": 0, "draw-hook-elastomer": 10}
"""Specimens and spring models of the samples, and the least mean stroke of a sine on each [mm]."""
AMPLIFIERS = {"gsv2": GSV2, "aed": AED, "modbus": MODBUS_TCP}
"""Kinds of amplifiers, as lines of the stand file."""
THERMOMETERS = {"w1": "", "ds2480b": 'kind = "ds2480b"\nport = "wires/onewire"\n'}
W1 = 'kind = "w1"\nroot = "wires/w1/devices"\n'
MOST_TROUBLES = 5


@dataclass(frozen=True)
class World:
    """What a seed has drawn.

    Parameters
    ----------
    seed : int
    stand : mapping
        Keys of the table ``[simulation]`` with their values, as TOML has them.
    amplifier, thermometer : str
        Kinds of them.
    specimen : str
        Name of specimen and model.
    touch : bool
        Whether first contact is touched off.
    tight : float or None
        The campaign's force limit as a multiple of what the plan expects; None: 600 kN.
    steps : tuple of str
        Steps of the campaign, as TOML has them.
    phases : tuple of str
        What the campaign goes through, for troubles to strike in.
    troubles : tuple of Trouble
    rests_s : float
        From the end of a killed start to the next one [s].
    seals_in_s : float
        So much stand time passes while a run is sealed [s].
    reports : bool
        Whether a report is written at the end.
    """

    seed: int
    stand: Mapping[str, str]
    amplifier: str
    thermometer: str
    specimen: str
    touch: bool
    tight: float | None
    steps: tuple[str, ...]
    phases: tuple[str, ...]
    troubles: tuple[Trouble, ...]
    rests_s: float
    seals_in_s: float
    reports: bool

    @property
    def starts(self) -> int:
        """Return how many starts it has at most: the last one has no trouble of its own."""
        return 1 + max((one.start + 1 for one in self.troubles), default=0)

    def words(self) -> str:
        """Return it in words."""
        stand = ", ".join(f"{key} = {value}" for key, value in self.stand.items())
        steps = [" ".join(step.replace("[[step]]", "").split()) for step in self.steps]
        limit = "600 kN" if self.tight is None else f"{self.tight:.3g} times the expected force"
        touch = "first contact touched off" if self.touch else "no touch"
        kinds = (self.specimen, self.amplifier, self.thermometer, touch)
        return "\n".join(
            [
                f"seed {self.seed}: {', '.join(kinds)}, force limit {limit}",
                f"  stand: {stand}",
                *(f"  step {number}: {step}" for number, step in enumerate(steps, 1)),
                *(f"  {trouble.words()}" for trouble in self.troubles),
                f"  a run is sealed in {self.seals_in_s:.2g} s, {self.rests_s:.2g} s from a kill to the next",
            ]
        )

    def write(self, folder: Path, force_max_kN: float | None = None) -> Path:
        """Write stand and campaign file; return the campaign's."""
        text = (SAMPLES / "stand.toml").read_text(encoding="utf-8")
        text = text.replace(GSV2, AMPLIFIERS[self.amplifier])
        if self.thermometer != "w1":
            text = text.replace(W1, THERMOMETERS[self.thermometer])
        for key, value in self.stand.items():
            pattern = re.compile(rf"^{key} = .*$", re.MULTILINE)
            line = f"{key} = {value}"
            text = pattern.sub(line, text) if pattern.search(text) else f"{text}{line}\n"
        model = f'model = "{SAMPLES}/models/{self.specimen}.toml"'
        text = re.sub(r'^model = "models/.*$', model, text, flags=re.MULTILINE)
        (folder / "stand.toml").write_text(text, encoding="utf-8")
        limits = f"[limits]\nforce_max_kN = {force_max_kN:.1f}\n" if force_max_kN else ""
        path = folder / "campaign.toml"
        path.write_text(
            f'[campaign]\nid = "world-{self.seed}"\nstand = "stand.toml"\n'
            f'specimen = "{SAMPLES}/specimens/{self.specimen}.toml"\n'
            f"{limits}[conditions]\nambient_C = {self.stand['ambient_C']}\n"
            f"specimen_C = {self.stand['initial_C']}\n"
            f"[guards]\ndisk_stop_s = 2.0\n[zero]\ntouch = {str(self.touch).lower()}\n" + "".join(self.steps),
            encoding="utf-8",
        )
        return path


def draw(seed: int) -> World:
    """Return the world of a seed."""
    dice = random.Random(f"world {seed}")
    touch = dice.random() < 0.5
    specimen = dice.choice(list(SPECIMENS))
    stand = _stand(dice, seed, touch=touch)
    cools = dice.random() < 0.06
    if cools:
        stand["ambient_C"], stand["initial_C"] = "19.0", "25.0"
    steps, phases = _campaign(dice, specimen, float(stand["initial_C"]), cools=cools)
    phases = ("start", *(("touch",) if touch else ()), *phases, "release", "safe stop")
    number = dice.choice((0, 0, 1, 1, 1, 2, 2, 3, 4, MOST_TROUBLES))
    return World(
        seed,
        stand,
        dice.choice(list(AMPLIFIERS)),
        dice.choice(list(THERMOMETERS)),
        specimen,
        touch,
        dice.uniform(1.02, 1.3) if dice.random() < 0.2 else None,
        steps,
        phases,
        draw_troubles(dice, number, phases),
        dice.choice((0.5, 3.0, 15.0)),
        dice.choice((0.05, 0.5, 3.0)),
        seed % 3 == 0,
    )


def _stand(dice: random.Random, seed: int, *, touch: bool) -> dict[str, str]:
    """Draw the stand's imperfections, within what a sound stand may have."""

    def some(low: float, high: float, digits: int = 4) -> str:
        return repr(round(dice.uniform(low, high), digits))

    initial_C = dice.uniform(17.0, 25.0)
    zero_mm = 2.0 if touch else 0.3
    return {
        "seed": str(seed),
        "ambient_C": repr(round(initial_C + dice.uniform(-2.0, 1.0), 1)),
        "initial_C": repr(round(initial_C, 1)),
        "specimen_force_factor": some(0.85, 1.2, 3),
        "force_noise_kN": some(0.05, 0.25),
        "stroke_noise_mm": some(0.003, 0.02),
        "actuator_bandwidth_Hz": some(10.0, 25.0, 1),
        "servo_lag_s": some(0.0, 0.006),
        "reversal_s": some(0.0, 0.05),
        "force_flicker_kN": some(0.0, 0.08),
        "force_hum_kN": some(0.0, 0.08),
        "stroke_flicker_mm": some(0.0, 0.008),
        "force_drift_kN_per_h": some(-0.3, 0.3),
        "force_zero_kN": some(-0.5, 0.5),
        "wire_zero_mm": f"[{some(-zero_mm, zero_mm)}, {some(-0.2, 0.2)}]",
        "gap_mm": some(0.3, 3.0) if touch else "0.0",
        "frame_stiffness_kN_per_mm": some(110.0, 180.0, 1),
        "reply_latency_s": some(0.0001, 0.003, 5),
        "reply_jitter_s": some(0.0, 0.0005, 5),
        "missed_cycles_per_h": some(0.0, 60.0, 1),
        "clock_drift_ppm": some(-100.0, 100.0, 1),
        "tick_start_us": str(dice.choice((0, 0, 0, (1 << 32) - 12_000_000))),
    }


def _campaign(
    dice: random.Random,
    specimen: str,
    initial_C: float,
    *,
    cools: bool,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Draw one to four short steps; return them and the phases that they go through."""
    makers = {
        "static": _static, "harmonic": _harmonic, "hold": _hold, "force-cycles": _force_cycles,
    }  # fmt: skip
    steps: list[dict[str, Any]] = []
    phases: set[str] = set()
    kinds = dice.choices(list(makers), (3, 4, 2, 1), k=dice.choice((1, 1, 2, 2, 3, 4)))
    for kind in kinds:
        steps.append({"kind": kind, **makers[kind](dice, specimen)})
        phases |= {"hold", "ramp"} if kind == "hold" else {"motion", "ramp"}
    if cools:
        cool = {"kind": "cool-down", "temperature_C": initial_C - 0.1, "timeout_s": 1800.0}
        steps.insert(dice.randrange(len(steps) + 1), cool)
        phases.add("cool-down")
    return tuple(_toml(step) for step in steps), tuple(sorted(phases))


def _toml(step: Mapping[str, Any]) -> str:
    lines = (f"{key} = {_value(value)}" for key, value in step.items())
    return "\n[[step]]\n" + "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _static(dice: random.Random, specimen: str) -> dict[str, Any]:
    most_mm = 45.0 if SPECIMENS[specimen] == 0 else 22.0
    return {
        "speed_mm_per_s": round(dice.uniform(8.0, 25.0), 1),
        "stroke_limit_mm": round(dice.uniform(10.0, most_mm), 1),
        "cycles": dice.choice((1, 1, 2)),
    }


def _harmonic(dice: random.Random, specimen: str) -> dict[str, Any]:
    most_mm = 30.0 if SPECIMENS[specimen] == 0 else 15.0
    prestress_mm = round(dice.uniform(6.0, most_mm), 1)
    amplitude_mm = round(dice.uniform(2.0, min(prestress_mm, 10.0)), 1)
    return {
        "prestress_mm": prestress_mm,
        "amplitude_mm": amplitude_mm,
        "frequency_Hz": round(min(dice.uniform(0.5, 2.0), 80.0 / (6.2832 * amplitude_mm)), 3),
        "cycles": dice.randint(1, 5),
    }


def _hold(dice: random.Random, specimen: str) -> dict[str, Any]:
    return {
        "stroke_mm": round(dice.uniform(5.0, 25.0 if SPECIMENS[specimen] == 0 else 15.0), 1),
        "duration_s": round(dice.uniform(1.0, 6.0), 1),
        "record": dice.random() < 0.7,
    }


def _force_cycles(dice: random.Random, specimen: str) -> dict[str, Any]:
    return {
        "force_min_kN": round(dice.uniform(15.0, 40.0), 1),
        "force_max_kN": round(dice.uniform(70.0, 150.0), 1),
        "speed_mm_per_s": round(dice.uniform(8.0, 20.0), 1),
        "cycles": dice.randint(2, 3),
    }
