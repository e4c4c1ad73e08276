"""Known springs of every family, and what a stand measures of them: nodes with noise, at one temperature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bufferstand.model.families import FAMILIES, Family, FamilyData
from bufferstand.model.families.data import nodes_of
from bufferstand.model.identification import LAWS, Drive, Experiment, FixedParts
from bufferstand.model.spring import TemperatureLaw

KNOTS_mm = (0.0, 18.0, 36.0, 54.0, 72.0, 90.0)
FRAME = FixedParts(knots_mm=KNOTS_mm)
LAW = TemperatureLaw()
NOISE_kN = 0.3
BY_NAME = {family.name: family for family in FAMILIES}

TRUE = {
    "kelvin-voigt": (0.04,),
    "maxwell": (0.15, 0.12, 0.1, 0.15),
    "fractional-zener": (0.6, 0.4, 0.5),
    "berg": (3.0, 0.05, 8.0),
    "bouc-wen": (4.0, 1.6, 0.2),
    "ours": (4.0, 0.06, 6.0),
    "ours-spectrum": (4.0, 0.06, 6.0, 0.04),
    "ours-return-points": (4.0, 0.06, 6.0, 0.04),
}
"""Parameters of the spring that is measured, in the order of the family's laws."""

STEPS = (
    # mean, amplitude [mm], frequency [Hz], cycles: a slow stroke, constant amplitude, inner loops
    (44.0, 44.0, 0.0284, 1),
    (20.0, 20.0, 0.08, 3),
    (20.0, 20.0, 0.32, 3),
    (20.0, 20.0, 1.27, 3),
    (40.0, 40.0, 0.04, 3),
    (40.0, 40.0, 0.32, 3),
    (50.0, 4.0, 1.0, 5),
    (70.0, 10.0, 1.27, 3),
    (30.0, 2.0, 2.0, 5),
)


def loading(x_mm):
    return 15.0 + 2.0 * x_mm + 4.6e-6 * x_mm**4


def true_vector(family: Family):
    """The vector of the spring that is measured."""
    x = np.array(KNOTS_mm)
    rises = np.diff(loading(x), prepend=0.0)
    curves = [rises]
    if family.two_curves:
        curves.append(np.diff(loading(x) * (0.82 - 0.004 * x), prepend=0.0))
    laws = [law.to_vector(v) for law, v in zip(family.laws, TRUE[family.name], strict=True)]
    return np.concatenate([*curves, laws])


def path(steps=STEPS, points=24):
    """Time [s], stroke [mm], half stroke of sines from and to contact, ``points`` each, rests between."""
    time, stroke = [np.array([0.0])], [np.array([0.0])]
    at = 0.0
    for mean, amplitude, frequency, cycles in steps:
        low = mean - amplitude
        parts = []
        if low > 0.0:
            parts.append((np.linspace(0.0, low, 8)[1:], np.linspace(0.0, 3.0, 8)[1:]))
        phase = np.arange(1, 2 * points * cycles + 1) / (2.0 * points)
        parts.append((mean - amplitude * np.cos(2.0 * np.pi * phase), phase / frequency))
        if low > 0.0:
            parts.append((np.linspace(low, 0.0, 8)[1:], np.linspace(0.0, 3.0, 8)[1:]))
        parts.append((np.zeros(8), np.linspace(0.0, 20.0, 9)[1:]))
        for x, t in parts:
            time.append(at + t)
            stroke.append(x)
            at = float(time[-1][-1])
    x, t = np.concatenate(stroke), np.concatenate(time)
    moves = np.sign(np.diff(x, append=x[-1]))
    return t, x, np.cumsum(np.diff(moves, prepend=moves[0]) != 0.0)


def data_on(steps=STEPS, points=24) -> FamilyData:
    """Nodes without measured forces."""
    time, stroke, half = path(steps, points)
    drive = Drive(time, stroke, half, np.arange(time.size), np.zeros(time.size), np.full(time.size, NOISE_kN),
                  np.zeros(time.size), np.empty(0), np.empty(0), LAW.reference_C)  # fmt: skip
    used = stroke > 0.5
    warm = np.full(time.size, LAW.reference_C)
    return nodes_of(Experiment(drive, True, used), warm, LAW, KNOTS_mm[-1])


def measured(name: str, seed: int) -> list[FamilyData]:
    """What a stand records of the spring of a family, with noise."""
    data = data_on()
    family = BY_NAME[name]
    force = family.force_kN(FRAME, true_vector(family), data)
    noise = np.random.default_rng(seed).normal(0.0, NOISE_kN, force.size)
    drive = replace(data.experiment.drive, force_kN=force + noise)
    return [replace(data, experiment=replace(data.experiment, drive=drive))]


def start():
    """A vector of our own model to begin with that is none of the true ones."""
    x = np.array(KNOTS_mm)
    rises = np.diff(1.05 * loading(x), prepend=0.0)
    returns = np.diff(0.7 * loading(x), prepend=0.0)
    return np.concatenate([rises, returns, [law.to_vector(law.start) for law in LAWS]])
