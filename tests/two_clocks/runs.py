"""Recorded runs whose force is of another clock than the stroke, with a known offset, drift and jitter.

The spring is Kelvin-Voigt's: F = F₀ + K′ (x − x₀) + K″ ẋ / ω, so that a cycle absorbs π K″ A² whatever the
frequency, and stores what the loading branch has below it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.channels import Calibration, Channel, ChannelUncertainty
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile import CLOCK_EVENT

Array = NDArray[np.float64]
FREQUENCY_HZ, MEAN_MM, AMPLITUDE_MM = 1.5, 40.0, 15.0
FORCE_KN, STORAGE, LOSS = 120.0, 4.0, 0.8
OMEGA = 2.0 * np.pi * FREQUENCY_HZ
ABSORBED_J = np.pi * LOSS * AMPLITUDE_MM**2
STORED_J = 2.0 * FORCE_KN * AMPLITUDE_MM + 0.5 * ABSORBED_J
DAMPING = ABSORBED_J / STORED_J
OFFSET_S, DRIFT = 3.7e-3, 40e-6
BOOT_S = 812.0
"""The device was switched on so long before the controller [s]."""


@dataclass(frozen=True)
class World:
    """How the two clocks are, and how they are read.

    Parameters
    ----------
    seed : int
    lasts_s : float
    offset_s, drift : float
        Of the device's clock against the controller's, beyond :data:`BOOT_S`.
    trip_s, jitter_s : float
        Least round trip of a reading, and the mean of what comes on top, on one way or the other [s].
    own_force, own_wire : bool
        Whether the controller measures the force, and the device the stroke, too.
    own_late_s : float
        By how much the controller's force is late, which is stated nowhere.
    u_delay_s : float or None
        Stated of every channel.
    """

    seed: int = 1
    lasts_s: float = 40.0
    offset_s: float = OFFSET_S
    drift: float = DRIFT
    trip_s: float = 2e-4
    jitter_s: float = 1e-3
    own_force: bool = True
    own_wire: bool = False
    own_late_s: float = 0.0
    u_delay_s: float | None = 2e-5

    def stamp_us(self, at_s: Array) -> NDArray[np.int64]:
        """Return what the device's clock shows at times of the controller's [s]."""
        return np.rint(((1.0 + self.drift) * at_s + BOOT_S + self.offset_s) * 1e6).astype(np.int64)


def stroke_mm(at_s: Array) -> Array:
    return np.asarray(MEAN_MM - AMPLITUDE_MM * np.cos(OMEGA * at_s))


def force_kN(at_s: Array) -> Array:  # noqa: N802
    swing = -STORAGE * AMPLITUDE_MM * np.cos(OMEGA * at_s) + LOSS * AMPLITUDE_MM * np.sin(OMEGA * at_s)
    return np.asarray(FORCE_KN + swing)


def channel(name: str, quantity: Any, unit: str, u_delay_s: float | None) -> dict[str, Any]:
    stated = ChannelUncertainty(accuracy_percent=0.05, zero=0.02, linearity=0.02, u_delay_s=u_delay_s)
    if quantity == "force":
        stated = stated.model_copy(update={"linearity": None, "reversibility_percent": 0.02})
    made = Channel(
        name=name,
        quantity=quantity,
        unit=unit,
        calibration=Calibration(coefficients=(0.0, 1.0)),
        uncertainty=stated,
    )
    return made.model_dump(mode="json")


def document(world: World, run_id: str) -> dict[str, Any]:
    own = [channel("force", "force", "kN", world.u_delay_s)] if world.own_force else []
    own += [channel("stroke_1", "stroke", "mm", world.u_delay_s)]
    beside = [channel("force_2", "force", "kN", world.u_delay_s)]
    if world.own_wire:
        beside.append(channel("stroke_2", "stroke", "mm", world.u_delay_s))
    return {
        "format": "bufferstand/run",
        "format_version": 1,
        "run": {
            "id": run_id,
            "kind": "harmonic",
            "started_utc": "2026-03-01T08:00:00+00:00",
            "operator": "",
            "campaign": "c",
            "step_index": 1,
        },
        "software": {"name": "bufferstand", "version": "0"},
        "specimen": {"id": "B-17", "kind": "buffer"},
        "stand": {"acquisition": [{"kind": "labjack"}], "figures": {"force": "force_2", "stroke": []}},
        "step": {
            "name": "sine",
            "prestress_mm": MEAN_MM,
            "amplitude_mm": AMPLITUDE_MM,
            "frequency_Hz": FREQUENCY_HZ,
        },
        "streams": {
            "controller": {"clock": "device", "rate_Hz": 1000.0, "device": "ring", "channels": own},
            "acquisition": {"clock": "device", "rate_Hz": 1000.0, "device": "T7", "channels": beside},
        },
    }


def record(folder: Path, world: World, *, readings: bool = True) -> Path:
    """Record a run; both clocks are read once a second."""
    random = np.random.default_rng(world.seed)
    run_id = f"run-{world.seed}"
    recorder = RunRecorder(folder, run_id, document(world, run_id))
    rows = round(world.lasts_s * 1000.0)
    at_s = np.arange(rows) / 1000.0
    own: dict[str, Any] = {"stroke_1": stroke_mm(at_s) + 0.01 * random.standard_normal(rows)}
    if world.own_force:
        own["force"] = force_kN(at_s - world.own_late_s) + 0.15 * random.standard_normal(rows)
    recorder.append("controller", 0, np.rint(at_s * 1e6).astype(np.int64), own)
    # The device's scans lie anywhere between the controller's, and begin earlier.
    device_s = (np.arange(rows + 400) - 200) / (1000.0 * (1.0 + world.drift)) + 3.1e-4
    beside: dict[str, Any] = {"force_2": force_kN(device_s) + 0.05 * random.standard_normal(device_s.size)}
    if world.own_wire:
        beside["stroke_2"] = stroke_mm(device_s) + 0.01 * random.standard_normal(device_s.size)
    recorder.append("acquisition", 0, world.stamp_us(device_s), beside)
    host_zero_s = 5000.0  # of the host's clock at the controller's zero, and it drifts, too
    for stream in ("controller", "acquisition") if readings else ():
        asked_s = np.arange(0.0, world.lasts_s, 1.0)
        there_s, back_s = (
            0.5 * world.trip_s + random.exponential(world.jitter_s, asked_s.size) for _ in "ab"
        )
        shown_s = asked_s + there_s
        device_us = world.stamp_us(shown_s) if stream == "acquisition" else np.rint(shown_s * 1e6)
        host_s = [host_zero_s + (1.0 + 15e-6) * one for one in (asked_s, shown_s + back_s)]
        recorder.event(
            host_zero_s + world.lasts_s,
            CLOCK_EVENT,
            "read",
            stream=stream,
            device_us=[int(one) for one in device_us],
            host_s=(0.5 * (host_s[0] + host_s[1])).tolist(),
            half_trip_s=(0.5 * (host_s[1] - host_s[0])).tolist(),
        )
    recorder.anchor(0, host_zero_s, "2026-03-01T08:00:00+00:00")
    return recorder.close("complete")
