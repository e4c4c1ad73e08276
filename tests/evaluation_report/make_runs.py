"""Synthetic runs of an elastomer buffer with known loops, and an evaluation document of them made by hand."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from bufferstand.recording.content import Anchor, Event, StreamContent
from bufferstand.recording.runfile.file import write_run

START = datetime(2026, 3, 5, 9, 0, tzinfo=UTC)
FORCE_KN_PER_COUNT = 1e-3
STROKE_MM_PER_COUNT = 1e-3
KELVIN_PER_COUNT = 0.0625
REASON = "specimen temperature 40.1 °C reached the stop at 40 °C"


@dataclass(frozen=True)
class Made:
    """One synthetic run: ``prestress`` None means static."""

    id: str
    prestress_mm: float | None = None
    amplitude_mm: float | None = None
    frequency_Hz: float | None = None
    cycles: int = 3
    status: str = "complete"

    @property
    def kind(self) -> str:
        return "static" if self.prestress_mm is None else "harmonic"


PAPER_LIKE = (
    Made("static-1"),
    Made("h-20-20-a", 20.0, 20.0, 0.16),
    Made("h-20-20-b", 20.0, 20.0, 0.32),
    Made("h-20-20-c", 20.0, 20.0, 0.64),
    Made("h-20-20-d", 20.0, 20.0, 1.27),
    Made("h-50-05", 50.0, 5.0, 2.55, 6),
    Made("h-50-10", 50.0, 10.0, 1.27, 5),
    Made("h-50-15", 50.0, 15.0, 0.85, 4),
    Made("h-50-30", 50.0, 30.0, 0.42, 4),
    Made("h-80-05", 80.0, 5.0, 2.55, 14),
    Made("h-80-10", 80.0, 10.0, 1.27, 4, "stopped"),
)


def backbone(stroke_mm: np.ndarray) -> np.ndarray:
    """Return the loading force [kN] at strokes [mm]: 20 kN preload, 560 kN at 95 mm."""
    return 20.0 + 1.2 * stroke_mm + 0.0473 * stroke_mm**2


def motion(made: Made, rate_Hz: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return time [s], stroke [mm] and whether it is loading."""
    if made.prestress_mm is None:
        half = int(95.0 / 5.0 * rate_Hz)
        up = np.linspace(0.0, 95.0, half, endpoint=False)
        stroke = np.tile(np.concatenate([up, 95.0 - up]), made.cycles)
        loading = np.tile(np.repeat([True, False], half), made.cycles)
        return np.arange(stroke.size) / rate_Hz, stroke, loading
    assert made.amplitude_mm is not None
    assert made.frequency_Hz is not None
    time = np.arange(int(made.cycles / made.frequency_Hz * rate_Hz) + 1) / rate_Hz
    phase = 2.0 * np.pi * made.frequency_Hz * time
    return time, made.prestress_mm - made.amplitude_mm * np.cos(phase), np.sin(phase) >= 0.0


def samples(made: Made, rate_Hz: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return time [s], stroke [mm] and force [kN] with measuring noise."""
    time, stroke, loading = motion(made, rate_Hz)
    noise = np.random.default_rng(seed)
    if made.prestress_mm is None:
        force = backbone(stroke) * np.where(loading, 1.0, 0.55)
    else:
        assert made.amplitude_mm is not None
        assert made.frequency_Hz is not None
        soft = 0.75 if made.prestress_mm > 60.0 else 0.9
        width = (
            0.17
            * backbone(stroke)
            * np.sqrt(np.maximum(0.0, 1.0 - ((stroke - made.prestress_mm) / made.amplitude_mm) ** 2))
        )
        force = soft * (1.0 + 0.03 * made.frequency_Hz) * backbone(stroke) * 0.85
        force = force + np.where(loading, width, -width) * min(1.0, made.amplitude_mm / 20.0)
    stroke = stroke + noise.normal(0.0, 0.01, stroke.size)
    return time, stroke, force + noise.normal(0.0, 0.15, force.size)


def channels() -> dict[str, list[dict[str, Any]]]:
    force = Channel(
        name="force",
        quantity="force",
        unit="kN",
        place="head of the actuator",
        delay_s=0.0008,
        calibration=Calibration(
            id="GTM-K-630-0001",
            coefficients=(0.0, FORCE_KN_PER_COUNT),
            certificate="D-K-15019 2026-01",
            date="2026-01-15",  # type: ignore[arg-type]
            valid_until="2027-01-15",  # type: ignore[arg-type]
        ),
        uncertainty=ChannelUncertainty(accuracy_percent=0.5, reversibility_percent=0.5, zero=0.3),
    )
    strokes = [
        Channel(
            name=f"stroke_{n}",
            quantity="stroke",
            unit="mm",
            place=f"{side} of the buffer",
            calibration=Calibration(
                id=f"WDS-500-{n}",
                coefficients=(0.0, STROKE_MM_PER_COUNT),
                certificate="works certificate",
                date="2025-02-01",  # type: ignore[arg-type]
                valid_until="2026-02-01" if n == 2 else "2027-02-01",  # type: ignore[arg-type]
            ),
            uncertainty=ChannelUncertainty(accuracy_percent=0.1),
        )
        for n, side in ((1, "left"), (2, "right"))
    ]
    temperatures = [
        Channel(
            name=f"temperature_{n}",
            quantity="temperature",
            unit="°C",
            place=place,
            calibration=Calibration(id="DS18B20 nominal", coefficients=(0.0, KELVIN_PER_COUNT)),
        )
        for n, place in ((1, "spring plate 3"), (2, "air beside the stand"))
    ]
    dumped = [c.model_dump(mode="json") for c in (force, *strokes)]
    return {"controller": dumped} | {t.name: [t.model_dump(mode="json")] for t in temperatures}


def metadata(made: Made, index: int, started: datetime, ended: datetime, specimen: str) -> dict[str, Any]:
    named = channels()
    streams = {
        "controller": {
            "clock": "device",
            "rate_Hz": 1000.0,
            "device": "ring",
            "channels": named["controller"],
        }
    }
    for name in ("temperature_1", "temperature_2"):
        streams[name] = {"clock": "host", "rate_Hz": 1.0, "device": f"28-{name}", "channels": named[name]}
    return {
        "format": "bufferstand/run",
        "format_version": 1,
        "run": {
            "id": made.id,
            "kind": made.kind,
            "started_utc": started.isoformat(),
            "ended_utc": ended.isoformat(),
            "status": made.status,
            "reason": REASON if made.status == "stopped" else "",
            "operator": "J. Novák",
            "campaign": "category A, prestress and amplitude sweep",
            "step_index": index,
        },
        "software": {"name": "bufferstand", "version": "0.1.0"},
        "stand": {
            "stand": {"id": "inova-630", "name": "INOVA dynamic test stand", "laboratory": "Test hall 2"},
            "limits": {
                "force_max_kN": 600.0,
                "stroke_max_mm": 250.0,
                "frequency_max_Hz": 2.55,
                "speed_max_mm_per_s": 800.0,
            },
            "identity": "ring controller, firmware 1.0",
        },
        "specimen": {
            "id": specimen,
            "kind": "buffer",
            "category": "A",
            "max_stroke_mm": 105.0,
            "elastic_system": "elastomer",
            "maker": "AXTONE",
            "serial": "0815",
        },
        "step": {
            "name": "static" if made.prestress_mm is None else f"{made.frequency_Hz:g} Hz",
            "prestress_mm": made.prestress_mm,
            "amplitude_mm": made.amplitude_mm,
            "frequency_Hz": made.frequency_Hz,
        },
        "limits": {"temperature_stop_C": 40.0, "force_max_kN": 600.0},
        "streams": streams,
    }


def write_campaign(
    folder: Path, runs: tuple[Made, ...] = PAPER_LIKE, *, rate_Hz: float = 200.0, specimen: str = "KX-0815"
) -> Path:
    """Write the run files of a campaign below ``folder`` and return it."""
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    started, warmth = START, 21.0
    for index, made in enumerate(runs, start=1):
        time, stroke, force = samples(made, rate_Hz, seed=index)
        ended = started + timedelta(seconds=float(time[-1]))
        device_us = np.round(time * 1e6).astype(np.int64) + 5_000_000
        counts = {
            "force": np.round(force / FORCE_KN_PER_COUNT).astype(np.int32),
            "stroke_1": np.round(stroke / STROKE_MM_PER_COUNT).astype(np.int32),
            "stroke_2": np.round(stroke / STROKE_MM_PER_COUNT).astype(np.int32),
        }
        seconds = np.arange(0.0, time[-1] + 1.0, 1.0)
        spring = (
            warmth + (41.0 - warmth) * (1.0 - np.exp(-seconds / 150.0)) if index > 1 else warmth + 0 * seconds
        )
        if made.status == "stopped":
            spring = np.linspace(warmth, 40.1, seconds.size)
        warmth = float(spring[-1])
        host_us = np.round(seconds * 1e6).astype(np.int64)
        streams = {"controller": StreamContent(device_us, counts)}
        for name, value in (("temperature_1", spring), ("temperature_2", np.full_like(spring, 21.0))):
            raw = np.round(value / KELVIN_PER_COUNT).astype(np.int32)
            streams[name] = StreamContent(host_us, {name: raw})
        anchors = [
            Anchor(5_000_000, 0.0, started.isoformat()),
            Anchor(5_000_000 + int(1e6 * time[-1]), float(time[-1]), ended.isoformat()),
        ]
        events = [Event(float(time[-1]), "guard", REASON)] if made.status == "stopped" else []
        document = metadata(made, index, started, ended, specimen)
        write_run(folder / "runs" / f"{index:02d}-{made.id}.h5", document, streams, events, anchors)
        started = ended + timedelta(seconds=8.0)
    return folder


def cycles_of(made: Made) -> list[dict[str, Any]]:
    period = 38.0 if made.frequency_Hz is None else 1.0 / made.frequency_Hz
    mean, half = made.prestress_mm or 47.5, made.amplitude_mm or 47.5
    cycles = []
    for n in range(made.cycles):
        last_of_stopped = made.status == "stopped" and n == made.cycles - 1
        damping = 0.386 if made.frequency_Hz is None else 0.232 - 0.006 * made.frequency_Hz
        cycles.append(
            {
                "index": n + 1,
                "start_s": n * period,
                "end_s": (n + 1) * period,
                "complete": not last_of_stopped,
                "steady": n > 0,
                "stroke_min_mm": mean - half,
                "stroke_max_mm": mean + half,
                "prestress_mm": mean,
                "amplitude_mm": half,
                "frequency_Hz": made.frequency_Hz,
                "force_min_kN": 12.3,
                "force_max_kN": float(backbone(np.array(mean + half))),
                "speed_loading_max_mm_per_s": 5.0,
                "speed_unloading_max_mm_per_s": 5.0,
                "stored_energy_J": 20_150.0,
                "absorbed_energy_J": 20_150.0 * damping,
                "damping": None if last_of_stopped else damping,
                "missing": {"damping": "the cycle was cut off by the stop"} if last_of_stopped else {},
                "tangent_stiffness_kN_per_mm": 5.7 + 0.1 * (made.frequency_Hz or 0.0),
                "secant_stiffness_kN_per_mm": 5.6,
                "dynamic_stiffness_kN_per_mm": None if made.frequency_Hz is None else 5.9,
                "storage_stiffness_kN_per_mm": None if made.frequency_Hz is None else 5.8,
                "loss_stiffness_kN_per_mm": None if made.frequency_Hz is None else 0.9,
                "loss_factor": None if made.frequency_Hz is None else 0.155,
                "stroke_distortion": None if made.frequency_Hz is None else 0.002,
                "temperature_C": {"start": 21.0 + n, "max": 21.5 + n},
            }
        )
    return cycles


def requirement(identifier: str, cycle: int | None, verdict: str, **facts: Any) -> dict[str, Any]:
    empty = {
        "requirement": identifier.replace("-", " "),
        "measured": None,
        "expanded_uncertainty": None,
        "lower_limit": None,
        "upper_limit": None,
        "unit": "",
        "conformance_probability": None,
        "why": "",
        "clause": "99.4",
    }
    return (
        {"standard": "EN 15551", "edition": "2022", "id": identifier, "cycle": cycle, "verdict": verdict}
        | empty
        | facts
    )


def static_requirements() -> list[dict[str, Any]]:
    out = []
    for cycle in (1, 2, 3):
        for at, low, high in ((25, 30.0, 130.0), (60, 100.0, 400.0)):
            value = float(backbone(np.array(float(at))))
            out.append(
                requirement(
                    f"force-at-{at}mm",
                    cycle,
                    "pass",
                    clause="99.3",
                    stroke_mm=float(at),
                    measured=value,
                    expanded_uncertainty=1.3,
                    lower_limit=low,
                    upper_limit=high,
                    unit="kN",
                    conformance_probability=0.99995,
                    why=f"{value:.1f} kN lies within",
                )
            )
        out += [
            requirement(
                "preload",
                cycle,
                "pass",
                clause="99.3",
                stroke_mm=0.0,
                measured=20.1,
                expanded_uncertainty=0.7,
                lower_limit=10.0,
                upper_limit=50.0,
                unit="kN",
                conformance_probability=0.9999,
                why="20.1 kN lies within 10 … 50 kN",
            ),
            requirement(
                "force-at-100mm",
                cycle,
                "not-tested",
                clause="99.3",
                stroke_mm=100.0,
                lower_limit=350.0,
                upper_limit=1000.0,
                unit="kN",
                why="the record ends at 95.0 mm",
            ),
            requirement(
                "stored-energy",
                cycle,
                "pass",
                measured=20_150.0,
                expanded_uncertainty=180.0,
                lower_limit=12_500.0,
                unit="J",
                conformance_probability=1.0,
                why="12.5 kJ were reached before full stroke",
            ),
            requirement(
                "absorbed-energy-ratio",
                cycle,
                "inconclusive",
                measured=0.386,
                expanded_uncertainty=0.007,
                lower_limit=0.5 if cycle == 1 else 0.42,
                unit="1",
                why="the loop is cut short of full stroke",
            ),
        ]
    out += [
        requirement(
            "full-stroke",
            None,
            "inconclusive",
            measured=95.0,
            lower_limit=105.0,
            unit="mm",
            why="the stand ended at 560 kN and 95.0 mm, before full stroke",
        ),
        requirement(
            "rest-after-assembly",
            None,
            "inconclusive",
            lower_limit=72.0,
            unit="h",
            why="no date of assembly is on record",
        ),
        requirement(
            "speed-limit", None, "pass", measured=5.0, upper_limit=50.0, unit="mm/s", why="5.0 mm/s at most"
        ),
    ]
    return out


def hand_made_document(runs: tuple[Made, ...] = PAPER_LIKE) -> dict[str, Any]:
    """Return an evaluation document (docs/evaluation-document.md) of the runs, with figures set by hand."""
    entries = []
    for made in runs:
        cycles = cycles_of(made)
        used = [c["index"] for c in cycles if c["complete"] and (made.kind == "static" or c["steady"])]
        shown = cycles[used[-1] - 1]
        static = made.kind == "static"
        entries.append(
            {
                "run": {
                    "path": f"{made.id}.h5",
                    "id": made.id,
                    "sha256": None,
                    "kind": made.kind,
                    "specimen": {},
                },
                "cycles": cycles,
                "summary": {
                    "cycles_used": used,
                    "damping": {
                        "value": shown["damping"],
                        "expanded_uncertainty": 0.0071,
                        "coverage_factor": 2,
                    },
                    "stored_energy_J": {
                        "value": shown["stored_energy_J"],
                        "expanded_uncertainty": 183.0,
                        "coverage_factor": 2,
                    },
                    "tangent_stiffness_kN_per_mm": {
                        "value": shown["tangent_stiffness_kN_per_mm"],
                        "expanded_uncertainty": 0.11,
                        "coverage_factor": 2,
                    },
                },
                "requirements": static_requirements() if static else [],
                "verdict": "inconclusive" if static else None,
                "warnings": ["cycle 4: damping: the cycle was cut off by the stop"]
                if made.status == "stopped"
                else [],
            }
        )
    return {
        "schema": "bufferstand/evaluation/1",
        "software": {"version": "0.1.0"},
        "decision_rule": "simple",
        "runs": entries,
        "trends": [
            trend("damping", 20.0, 20.0, [m for m in runs if m.prestress_mm == 20.0], 0.232, -0.006),
            trend("tangent_stiffness", 50.0, None, [m for m in runs if m.prestress_mm == 50.0], 5.7, 0.1),
        ],
    }


def trend(
    quantity: str, prestress: float, amplitude: float | None, runs: list[Made], intercept: float, slope: float
) -> dict[str, Any]:
    frequency = [m.frequency_Hz or 0.0 for m in runs]
    return {
        "quantity": quantity,
        "prestress_mm": prestress,
        "amplitude_mm": amplitude,
        "runs": [m.id for m in runs],
        "frequency_Hz": frequency,
        "values": [intercept + slope * f for f in frequency],
        "expanded_uncertainty": [0.02 * intercept for _ in runs],
        "temperature_C": [None if n == 0 else 22.0 + n for n, _ in enumerate(runs)],
        "slope_per_Hz": slope,
        "intercept": intercept,
        "slope_standard_uncertainty_per_Hz": 0.001,
        "confidence_band": [0.01 * intercept for _ in runs],
        "warnings": ["the amplitude varies among the runs"] if amplitude is None else [],
    }
