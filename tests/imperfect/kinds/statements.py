"""What the laboratory states is false: zeros, delays, units, signs."""

from __future__ import annotations

import numpy as np

from tests.imperfect.applied import Applied
from tests.imperfect.chain import Array, Scene

from .channels import CHANNEL_WORDS
from .common import cycle_s, unloaded

UNIT = r"\bunits?\b|\bfactor|implausib|not plausible|range of the stand|\b1000\b"
PLACES = frozenset({"force-at-25mm", "force-at-60mm", "force-at-100mm", "preload"})
STROKE_ZERO = PLACES | {"stroke_min_mm", "stroke_max_mm", "prestress_mm", "full-stroke", "full-release"}
FORCE_ZERO = PLACES | {
    "force_min_kN",
    "force_max_kN",
    "stored_energy_J",
    "damping",
    "stored-energy",
    "absorbed-energy-ratio",
}
PHASE = PLACES | {
    "force_min_kN",
    "stored_energy_J",
    "absorbed_energy_J",
    "damping",
    "tangent_stiffness_kN_per_mm",
    "secant_stiffness_kN_per_mm",
    "dynamic_stiffness_kN_per_mm",
    "storage_stiffness_kN_per_mm",
    "loss_stiffness_kN_per_mm",
    "loss_factor",
    "stored-energy",
    "absorbed-energy-ratio",
    "first contact",
}

# docs/plausibility.md, "Wiring and scaling": a lateness is told from 20 ms and two steps of the sampling on
LEAST_LATE_S, LEAST_LATE_STEPS, TWO_DIGITS = 0.02, 2.0, 0.05


def force_late(rng: np.random.Generator, s: Scene) -> Applied:
    """The force is late or early by more than is stated: few records show that, and none needs to."""
    late = rng.uniform(0.005, 0.05) * cycle_s(s) * rng.choice([-1.0, 1.0])
    s.force_read_kN = _delayed(rng.spawn(1)[0], s, late)
    return Applied(
        "force-late-beyond",
        f"{late * 1e3:.1f} ms",
        kinds=("delay",),
        channel="force",
        figures="hidden",
        falsifies=PHASE,
        # a force that is early makes loops of negative area; a late one still falls at rests
        may=("sign", "unlike", "offset-jump", "gain-jump", "drift", "zero"),
        right=lambda told_s: abs(told_s - late) <= told_within_s(s, late),
    )


def _delayed(rng: np.random.Generator, s: Scene, late_s: float) -> Array:
    """Return the force of a moment so much earlier; what came before the first reading has its own noise."""
    at = s.time_s - late_s
    read = np.interp(at, s.time_s, s.force_read_kN)
    beyond = (at < s.time_s[0]) | (at > s.time_s[-1])
    edge = np.clip(at, s.time_s[0], s.time_s[-1])
    moved = np.interp(at, s.motion.time_s, s.force_kN) - np.interp(edge, s.motion.time_s, s.force_kN)
    noise = rng.normal(0.0, float(str(s.facts["noise_kN"])), len(at))
    return np.asarray(np.where(beyond, read + moved + noise, read))


def told_within_s(s: Scene, late_s: float) -> float:
    """Return how exactly a lateness is told: no lesser one is (plausibility.md), and it has two digits."""
    step_s = float(np.median(np.diff(s.time_s)))
    return max(LEAST_LATE_S, LEAST_LATE_STEPS * step_s) + TWO_DIGITS * abs(late_s)


def zero_off(rng: np.random.Generator, s: Scene) -> Applied | None:
    """Stroke 0 is not at first contact; a record that begins without load shows it."""
    size = rng.uniform(1.0, 5.0) * rng.choice([-1.0, 1.0])
    s.strokes_mm = [x + size for x in s.strokes_mm]
    step_mm = s.motion.facts.get("speed_mm_per_s", 0.0) * s.dt_s
    begins_free = s.motion.kind == "static" and bool(s.true_stroke()[0] <= 0.0)
    seen = begins_free and abs(size) > 2.0 * step_mm + 0.5  # 0.5: limits of the zero, the seat
    return Applied(
        "zero-off",
        f"{size:+.2f} mm",
        kinds=("zero",),
        words=(r"\bzero", r"\blies\b|\boff\b|counted from (first )?contact|\bmm before|\bmm behind"),
        channel="stroke",
        figures="named" if seen else "hidden",
        falsifies=STROKE_ZERO,
        may=("sign", "unlike"),
        plain=seen,
    )


def force_zero_off(rng: np.random.Generator, s: Scene) -> Applied:
    """The force was not zeroed; a record that begins free of the stand shows it."""
    size = rng.uniform(4.0, 20.0) * rng.choice([-1.0, 1.0])
    s.force_read_kN = s.force_read_kN + size
    seen = unloaded(s, 0)
    return Applied(
        "force-zero-off",
        f"{size:+.1f} kN",
        kinds=("zero",),
        words=(CHANNEL_WORDS["force"], r"\bzero|\boffset|\btare|unloaded|without load"),
        channel="force",
        figures="named" if seen else "hidden",
        falsifies=FORCE_ZERO,
        may=("sign", "drift", "unlike"),
        plain=seen,
    )


def _unit(s: Scene, name: str, which: str, factor: float, *, seen: bool = True) -> Applied:
    s.factor[which] = factor
    if factor < 0.1:
        s.decimals[which] = 7
    return Applied(
        name,
        f"{which} x {factor:g}",
        kinds=("unit",),
        words=(CHANNEL_WORDS[which], UNIT),
        channel=which,
        figures="named" if seen else "hidden",
        may=("unlike", "zero", "clipped", "offset-jump", "gain-jump", "stroke-jump", "spike"),
        plain=seen,
    )


def newtons(rng: np.random.Generator, s: Scene) -> Applied:
    """Newtons called kN."""
    return _unit(s, "unit-N-as-kN", "force", 1000.0)


def pounds(rng: np.random.Generator, s: Scene) -> Applied:
    """Pounds called kN."""
    return _unit(s, "unit-lbf-as-kN", "force", 1.0 / 0.0044482216)


def metres(rng: np.random.Generator, s: Scene) -> Applied:
    """Metres called mm."""
    return _unit(s, "unit-m-as-mm", "stroke", 0.001)


def inches(rng: np.random.Generator, s: Scene) -> Applied:
    """Inches called mm; a loop of small amplitude remains one of a stiff specimen, a full stroke does not."""
    return _unit(s, "unit-in-as-mm", "stroke", 1.0 / 25.4, seen=s.motion.kind == "static")


def times_ten(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A decimal sign out of place."""
    if s.motion.kind != "static":
        return None
    return _unit(s, "times-ten", str(rng.choice(["force", "stroke"])), 10.0)


def _sign(s: Scene, which: str) -> Applied:
    s.factor[which] = -1.0
    return Applied(
        f"sign-{which}",
        "turned",
        kinds=("sign",),
        words=(r".", r"negative|\bsign\b"),  # a loop turned over absorbs a negative energy
        channel=which,
        figures="named",
        may=("unlike", "zero", "unit"),
        plain=True,
    )


def sign_force(rng: np.random.Generator, s: Scene) -> Applied:
    """The force has the other sign."""
    return _sign(s, "force")


def sign_stroke(rng: np.random.Generator, s: Scene) -> Applied:
    """The stroke has the other sign."""
    return _sign(s, "stroke")
