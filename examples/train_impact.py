"""A train runs into a standing one: forces, speeds and energy with the identified buffer and draw gear.

    python -m examples.train_impact --out DIR [--wagons 10] [--speed 2.5] [--duration 6]

Wagons are rigid masses on straight track, without brakes or rolling resistance. Between two wagons stand two
buffers on either side, face to face, and two draw hooks with a screw coupling without play. Equal springs
that have met only each other share a closing equally, so one buffer and one hook of a gap are stepped at half
of the closing; the buffer counts four times in the energies and the hook twice.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bufferstand.model import SpringModel, SpringStepper, load_model, stored_energy

Floats = NDArray[np.float64]
MODELS = Path(__file__).parents[1] / "sample_runs" / "models"


@dataclass(frozen=True)
class Scene:
    """What runs into what: ``running`` wagons at ``speed_m_per_s`` into ``standing`` ones, coupled each."""

    running: int = 10
    standing: int = 10
    mass_kg: float = 60_000.0
    speed_m_per_s: float = 2.5
    approach_mm: float = 50.0
    temperature_C: float = 20.0
    duration_s: float = 6.0
    step_s: float = 1e-3


@dataclass(frozen=True)
class Impact:
    """History of an impact; m instants, n wagons, n - 1 gaps.

    Parameters
    ----------
    time_s : NDArray, shape (m,)
    speed_m_per_s : NDArray, shape (m, n)
    gap_force_kN : NDArray, shape (m, n - 1)
        Force between neighbours, compressive positive: both buffers less the draw gear.
    kinetic_J, stored_J, lost_J : NDArray, shape (m,)
        The energy ledger: of the masses, in the springs, gone in them.
    momentum_Ns : NDArray, shape (m,)
    buffer_stroke_mm : NDArray, shape (m, n - 1)
        Of one buffer.
    warming_K : NDArray, shape (n - 1,)
        Of the buffers at the end.
    """

    time_s: Floats
    speed_m_per_s: Floats
    gap_force_kN: Floats
    kinetic_J: Floats
    stored_J: Floats
    lost_J: Floats
    momentum_Ns: Floats
    buffer_stroke_mm: Floats
    warming_K: Floats


def run_impact(scene: Scene, buffer: SpringModel, draw_hook: SpringModel, *, every: int = 5) -> Impact:
    """Return what happens; every ``every``-th step is kept.

    Velocity Verlet: positions by the forces of now, forces there, speeds by the mean of both forces. Momentum
    is kept to rounding; the ledger closes to the square of the step.
    """
    wagons = scene.running + scene.standing
    gaps = wagons - 1
    coupled = np.arange(gaps) != scene.running - 1
    buffers, hooks = (
        [SpringStepper(model, scene.temperature_C, scene.temperature_C) for _ in range(gaps)]
        for model in (buffer, draw_hook)
    )
    play_mm = np.where(coupled, 0.0, scene.approach_mm)
    place_mm = np.zeros(wagons)
    speed = np.where(np.arange(wagons) < scene.running, scene.speed_m_per_s, 0.0)
    force = np.zeros(wagons)
    dt, rows = scene.step_s, []
    for step in range(round(scene.duration_s / dt) + 1):
        if step:
            half = speed + 0.5 * dt * force / scene.mass_kg
            place_mm = place_mm + 1e3 * dt * half
        closing = place_mm[:-1] - place_mm[1:] - play_mm
        stretch = np.where(coupled, -0.5 * closing, 0.0)
        pushed = _step(buffers, 0.5 * closing, dt if step else 0.0)
        between = 2.0 * pushed - _step(hooks, stretch, dt if step else 0.0)
        force = 1e3 * (np.append(0.0, between) - np.append(between, 0.0))
        if step:
            speed = half + 0.5 * dt * force / scene.mass_kg
        if step % every == 0:
            kinetic = 0.5 * scene.mass_kg * float(speed @ speed)
            stored = 4.0 * _stored_J(buffers) + 2.0 * _stored_J(hooks)
            lost = 4.0 * sum(b.heat_J for b in buffers) + 2.0 * sum(h.heat_J for h in hooks)
            momentum = scene.mass_kg * float(speed.sum())
            rows.append((step * dt, speed.copy(), between, kinetic, stored, lost, momentum, 0.5 * closing))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Impact(*columns, warming_K=np.array([b.temperature_C for b in buffers]) - scene.temperature_C)


def _step(springs: list[SpringStepper], stroke_mm: Floats, dt_s: float) -> Floats:
    """Step each spring to its stroke; return the forces [kN]."""
    return np.array([spring.step(x, dt_s) for spring, x in zip(springs, stroke_mm.tolist(), strict=True)])


def _stored_J(springs: list[SpringStepper]) -> float:  # noqa: N802 - the unit's own letter
    """Return the energy [J] that springs of one kind hold by their state alone: no sum of work less heat."""
    state = np.array([(s.stroke_mm, s.band, s.temperature_C, *s.lags_mm) for s in springs]).T
    return float(stored_energy(springs[0].model, state[0], state[1], state[3:], state[2]).sum())


def facts(scene: Scene, impact: Impact) -> dict[str, float]:
    """Return the figures of an impact by name."""
    total = impact.kinetic_J + impact.stored_J + impact.lost_J
    before = float(impact.kinetic_J[0])
    return {
        "largest compressive force [kN]": float(impact.gap_force_kN.max()),
        "largest tensile force [kN]": float(-impact.gap_force_kN.min()),
        "largest buffer stroke [mm]": float(impact.buffer_stroke_mm.max()),
        "kinetic energy before [kJ]": before / 1e3,
        "lost in the springs [kJ]": float(impact.lost_J[-1]) / 1e3,
        "lost, share of what an inelastic impact loses": float(
            impact.lost_J[-1] / (before * scene.standing / (scene.running + scene.standing))
        ),
        "hottest buffer [K above the start]": float(impact.warming_K.max()),
        "ledger, largest gap over kinetic energy before": float(np.abs(total - total[0]).max() / before),
        "momentum, largest change": float(np.ptp(impact.momentum_Ns) / impact.momentum_Ns[0]),
    }


def draw(impact: Impact, file: Path) -> None:
    """Write the picture: forces over gaps and time, speeds, energy ledger."""
    figure = Figure(figsize=(8.0, 8.4), layout="constrained")
    FigureCanvasAgg(figure)
    over, speeds, energies = figure.subplots(3, 1, sharex=True)
    gaps = impact.gap_force_kN.shape[1]
    largest = float(np.abs(impact.gap_force_kN).max())
    mesh = over.pcolormesh(
        impact.time_s,
        np.arange(1, gaps + 1),
        impact.gap_force_kN.T,
        cmap="RdBu_r",
        vmin=-largest,
        vmax=largest,
        shading="nearest",
        rasterized=True,
    )
    over.set_ylabel("gap, from the running end")
    figure.colorbar(mesh, ax=over, label="force [kN], compression positive")
    shades = [f"{0.75 * k / max(1, gaps):.3f}" for k in range(gaps + 1)]
    for wagon, shade in enumerate(shades):
        speeds.plot(impact.time_s, impact.speed_m_per_s[:, wagon], color=shade, linewidth=0.8)
    speeds.set_ylabel("speed of the wagons [m/s]\n(black: first, grey: last)")
    parts = (impact.kinetic_J / 1e3, impact.stored_J / 1e3, impact.lost_J / 1e3)
    energies.stackplot(
        impact.time_s,
        *parts,
        labels=("kinetic", "stored in the springs", "lost in the springs"),
        colors=("#56B4E9", "#E69F00", "#D55E00"),
    )
    energies.set_ylabel("energy [kJ]")
    energies.set_xlabel("time [s]")
    energies.legend(loc="lower left", framealpha=0.9)
    figure.savefig(file, dpi=120)


def main(arguments: list[str] | None = None) -> None:
    """Simulate, write ``train-impact.png`` and ``train-impact.json``, print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for picture and figures")
    parser.add_argument("--wagons", type=int, default=10, help="wagons of each train")
    parser.add_argument("--speed", type=float, default=2.5, help="of the running train [m/s]")
    parser.add_argument("--duration", type=float, default=6.0, help="how long to watch [s]")
    chosen = parser.parse_args(arguments)
    scene = Scene(chosen.wagons, chosen.wagons, speed_m_per_s=chosen.speed, duration_s=chosen.duration)
    buffer = load_model(MODELS / "category-a-elastomer.toml")
    draw_hook = load_model(MODELS / "draw-hook-elastomer.toml")
    impact = run_impact(scene, buffer, draw_hook)
    chosen.out.mkdir(parents=True, exist_ok=True)
    draw(impact, chosen.out / "train-impact.png")
    figures = facts(scene, impact)
    text = json.dumps(figures, indent=2) + "\n"
    (chosen.out / "train-impact.json").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
