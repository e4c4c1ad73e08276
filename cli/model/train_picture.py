"""The picture of a train: forces over gaps and time, speeds, energy ledger."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bufferstand.model.train import Train, TrainMotion


def picture_train(train: Train, motion: TrainMotion) -> Figure:
    """Return force of every gap over time, speeds of all vehicles, and where the energy is."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - only where a picture is drawn

    figure = Figure(figsize=(8.0, 8.4), layout="constrained")
    over, speeds, energies = figure.subplots(3, 1, sharex=True)
    gaps = motion.gap_force_kN.shape[1]
    largest = max(float(np.abs(motion.gap_force_kN).max()), 1e-9)
    mesh = over.pcolormesh(
        motion.time_s,
        np.arange(1, gaps + 1),
        motion.gap_force_kN.T,
        cmap="RdBu_r",
        vmin=-largest,
        vmax=largest,
        shading="nearest",
        rasterized=True,
    )
    over.set_title(train.name)
    over.set_ylabel("gap, from the left")
    over.yaxis.get_major_locator().set_params(integer=True)
    figure.colorbar(mesh, ax=over, label="force [kN], compression positive")
    for k in range(gaps + 1):
        shade = f"{0.75 * k / gaps:.3f}"
        speeds.plot(motion.time_s, motion.speed_m_per_s[:, k], color=shade, linewidth=0.8)
    speeds.set_ylabel("speed of the vehicles [m/s]\n(black: first, grey: last)")
    parts = (motion.kinetic_J / 1e3, motion.stored_J / 1e3, motion.lost_J / 1e3)
    energies.stackplot(
        motion.time_s,
        *parts,
        labels=("kinetic", "stored in the springs", "lost in the springs"),
        colors=("#56B4E9", "#E69F00", "#D55E00"),
    )
    energies.set_ylabel("energy [kJ]")
    energies.set_xlabel("time [s]")
    energies.legend(loc="lower left", framealpha=0.9)
    return figure
