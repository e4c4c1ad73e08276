"""Group ``steps``: records in which amplitude, frequency or mean stroke changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.validation.making.closed_form import plain
from tests.validation.making.sines import ENERGIES, MOTION, Ellipse, agreed_means
from tests.validation.making.standard_set import StandardSet, of_step


def stepped_sets() -> list[StandardSet]:
    """Return the sets of the group."""
    return [
        _steps(
            "amplitude",
            "Three amplitudes in one file",
            [Ellipse(amplitude_mm=a, force_kN=4 * a) for a in (5.0, 10.0, 15.0)],
        ),
        _steps(
            "frequency", "Three frequencies in one file", [Ellipse(frequency_Hz=f) for f in (0.25, 0.5, 1.0)]
        ),
        _steps(
            "mean-stroke",
            "Two mean strokes in one file",
            [Ellipse(mean_mm=m, mean_kN=k) for m, k in ((30.0, 80.0), (55.0, 140.0))],
        ),
    ]


def _steps(name: str, title: str, ellipses: Sequence[Ellipse]) -> StandardSet:
    """Return six cycles of each ellipse, with 2 s of rest at the lower turn and a ramp of 2 s to the next."""
    rate = 60.0
    strokes, forces = [], []
    for number, ellipse in enumerate(ellipses):
        moment = np.arange(round(6.0 / ellipse.frequency_Hz * rate)) / rate
        strokes.append(ellipse.stroke_mm(moment))
        forces.append(ellipse.force_at(moment))
        follows = ellipses[number + 1] if number + 1 < len(ellipses) else ellipse
        share = np.clip(np.arange(round(6.0 * rate)) / rate / 2.0 - 1.0, 0.0, 1.0)
        zero = np.zeros(1)
        a, b = float(ellipse.stroke_mm(zero)[0]), float(follows.stroke_mm(zero)[0])
        f, g = float(ellipse.force_at(zero)[0]), float(follows.force_at(zero)[0])
        strokes.append(a + (b - a) * share)
        forces.append(f + (g - f) * share)
    stroke, force = np.concatenate(strokes), np.concatenate(forces)
    time_s = np.arange(stroke.size) / rate
    agreed = []
    for number, ellipse in enumerate(ellipses, start=1):
        agreed += agreed_means(ellipse, {ENERGIES: 2e-3, MOTION: 2e-3}, step=number)
        # The first and last cycle join a rest, from which a cosine departs too slowly to say when.
        agreed.append(of_step(number, "frequency_Hz", ellipse.frequency_Hz, "f", share=2e-2))
    return StandardSet(
        f"steps/{name}",
        title,
        "Six cycles a step, rests and ramps between. A mean over all of them would mean nothing.",
        agreed,
        plain(time_s, stroke, force),
    )
