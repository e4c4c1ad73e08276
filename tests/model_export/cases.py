"""Springs, histories and exported files that the tests of this room share."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from bufferstand.model.file import load_model
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw, ViscousBranch
from bufferstand.model.stepper import SpringStepper
from tests.model.cases import reference_curves, spring

FOLDER = Path(__file__).parents[2] / "sample_runs" / "models"
BUFFER, HOOK = FOLDER / "category-a-elastomer.toml", FOLDER / "draw-hook-elastomer.toml"


@cache
def springs() -> dict[str, SpringModel]:
    """Springs that together use every law: both heat rules, c_eta, the branches, the stop, no limits."""
    shipped = load_model(BUFFER)
    return {
        "buffer": shipped,
        "hook": load_model(HOOK),
        "paper-heat": replace(shipped, heat=replace(shipped.heat, rule="paper", capacity_J_per_K=2000.0)),
        "spectrum": replace(shipped, viscous=ViscousBranch(0.05, 7.0, 0.04)),
        "bare": spring(reference_curves()),
        "insulated": spring(
            temperature=TemperatureLaw(30.0, 0.012, 15.0, 0.002, 0.3),
            heat=HeatBalance(1500.0, 0.0, sensor_lag_s=3.0, sensor_gain=0.8),
        ),
    }


def wandering(model: SpringModel, count: int = 4000, seed: int = 6) -> np.ndarray:
    """A stroke history [mm] that begins at 0 and reaches lost contact, rest and the stop."""
    random = np.random.default_rng(seed)
    end = model.curves.end_mm
    t = np.arange(count) / count
    x = 0.55 * end * (1.0 - np.cos(2.0 * np.pi * 9.3 * t)) + 0.05 * end * np.sin(2.0 * np.pi * 61.0 * t)
    x[count // 2 : count // 2 + 50] = x[count // 2]
    x[count // 3 :: 400] += random.normal(0.0, 0.1 * end, len(x[count // 3 :: 400]))
    x[-40:-20] = -0.02 * end
    x[0] = 0.0
    return x


def stepped(model: SpringModel, stroke_mm: np.ndarray, dt_s: float, temperature_C: float, ambient_C: float):
    """What the library gives step by step: columns force, temperature, sensor, heat, work, band."""
    stepper = SpringStepper(model, temperature_C, ambient_C)
    rows = []
    for x in stroke_mm.tolist():
        force = stepper.step(x, dt_s)
        rows.append(
            (
                force,
                stepper.temperature_C,
                stepper.sensor_temperature_C,
                stepper.heat_J,
                stepper.work_J,
                stepper.band,
            )
        )
    return np.array(rows)


def unpack(fmu: Path, folder: Path) -> Path:
    """Unpack an FMU; return the folder."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return folder
