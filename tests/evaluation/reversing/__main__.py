"""``python -m tests.evaluation.reversing``: the table of all motions and reversals, against the truth.

Per motion and reversal: the largest error of a cycle's frequency and its U, that of the mean, and of each
group of figures the largest error over U.
"""

from __future__ import annotations

import numpy as np

from tests.evaluation.reversing.runs import Harmonic, Motion, Static
from tests.evaluation.reversing.study import Compared, compared

REVERSALS_S = (0.0, 0.01, 0.02, 0.03, 0.06)
MOTIONS: tuple[Motion, ...] = (
    Harmonic(0.2, 20.0),
    Harmonic(0.5, 20.0),
    Harmonic(0.5, 5.0),
    Harmonic(1.0, 10.0),
    Harmonic(1.273, 20.0),
    Harmonic(1.7, 15.0),
    Harmonic(2.546, 5.0),
    Static(20.0),
    Static(50.0),
    Static(20.0, pause_s=5.0),
    Static(100.0, pause_s=1.0),
)
GROUPS = {
    "W, D": ("stored_energy_J", "absorbed_energy_J", "damping"),
    "stroke": ("stroke_min_mm", "stroke_max_mm"),
    "K": (
        "tangent_stiffness_kN_per_mm",
        "secant_stiffness_kN_per_mm",
        "storage_stiffness_kN_per_mm",
        "loss_stiffness_kN_per_mm",
    ),
    "F": ("force_max_kN",),
    "speed": ("speed_loading_max_mm_per_s", "speed_unloading_max_mm_per_s"),
}


def row(motion: Motion, reversal_s: float) -> str:
    """Return one line of the table."""
    found = compared(motion, reversal_s)
    cells = [_name(motion), f"{reversal_s:.2f}", _frequency(found), _mean(motion, found)]
    for names in GROUPS.values():
        known = [found.over_U(name) for name in names if name in found.error_percent]
        cells.append(f"{float(np.max(np.concatenate(known))):.2f}" if known else "—")
    return " | ".join(cells)


def _name(motion: Motion) -> str:
    if isinstance(motion, Harmonic):
        return f"{motion.frequency_Hz:g} Hz ± {motion.amplitude_mm:g} mm"
    return f"{motion.speed_mm_per_s:g} mm/s, rests {motion.pause_s:g} s"


def _frequency(found: Compared) -> str:
    inner = slice(None) if isinstance(found.run.motion, Harmonic) else slice(1, -1)
    error, expanded = (a["frequency_Hz"][inner] for a in (found.error_percent, found.expanded_percent))
    return f"{np.max(np.abs(error)):.3f} ({np.max(expanded):.3f})"


def _mean(motion: Motion, found: Compared) -> str:
    mean = found.mean_Hz
    if not isinstance(motion, Harmonic) or mean is None or mean.value is None:
        return "—"
    error = 100.0 * (mean.value / motion.frequency_Hz - 1.0)
    return f"{error:+.3f} ({100.0 * (mean.expanded_uncertainty or 0.0) / motion.frequency_Hz:.3f})"


if __name__ == "__main__":
    print(" | ".join(("motion", "reversal s", "f of a cycle % (U)", "mean f % (U)", *GROUPS)))
    for each in MOTIONS:
        for reversal_s in REVERSALS_S:
            print(row(each, reversal_s), flush=True)
