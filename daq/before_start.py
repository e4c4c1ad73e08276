"""Before anything moves: devices fresh, force at zero, room on the disk, the specimen's data complete."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from daq.acquisition import Acquisition
from foundation.specimen import Specimen
from protocols.steps import PlannedStep

FIRST_LOOK_S = 0.5
"""So long at least every device is watched before anything moves [s of stand time]."""
ZERO_NOTE_SHARE = 0.2
"""From this share of the refusal on, a force at rest is said."""
DISK_RESERVE_BYTES = 64 * 2**20
"""Room that must be left over: a journal and its run file exist side by side for a moment."""
SEALING_FACTOR = 1.5
"""Room for the plan's samples, and for the largest run twice."""


def first_look(acquisition: Acquisition, pump: Callable[[], object]) -> float:
    """Watch until the controller and every specimen sensor have spoken; return the mean force [kN].

    Parameters
    ----------
    acquisition : Acquisition
        Its panel trips by itself when a sensor stays silent.
    pump : callable
        One pass; raises when a guard has tripped.
    """
    clock, panel = acquisition.clock, acquisition.panel
    began_s = clock.now_s()
    specimen = [guard.stream for guard in panel.guards.temperatures if guard.stop_C is not None]
    force_kN: list[float] = []
    while True:
        pump()
        latest, heard = acquisition.latest, panel.latest_temperatures()
        if "force" in latest.values:
            force_kN.append(latest.values["force"])
        spoken = latest.samples > 0 and all(name in heard for name in specimen)
        if spoken and clock.now_s() - began_s >= FIRST_LOOK_S:
            return sum(force_kN) / len(force_kN) if force_kN else 0.0


def zero_trouble(force_kN: float, most_kN: float) -> tuple[str, bool]:
    """Return what is to be said of the force at rest with the valve off, and whether it refuses the start."""
    size_kN = abs(force_kN)
    if size_kN <= ZERO_NOTE_SHARE * most_kN:
        return "", False
    text = f"at rest with the valve off the force reads {force_kN:+.2f} kN"
    if size_kN > most_kN:
        limit = f"{text}, more than zero_force_max_kN = {most_kN:g} kN"
        return f"{limit}: unload the specimen, or set the zero of transducer or calibration", True
    return f"{text}: every force of this campaign is off by that; set the zero", False


def disk_trouble(folder: Path, steps: Sequence[PlannedStep]) -> str:
    """Return why the disk cannot take what is planned, empty if it can."""
    sizes = [step.disk_bytes for step in steps]
    need = int(SEALING_FACTOR * (sum(sizes) + max(sizes, default=0))) + DISK_RESERVE_BYTES
    free = shutil.disk_usage(folder).free
    if free >= need:
        return ""
    return (
        f"the disk of {folder} has {free / 1e6:.0f} MB free, the plan needs {need / 1e6:.0f} MB: make room, "
        "or choose a folder on another disk with --out"
    )


def specimen_gaps(specimen: Specimen) -> str:
    """Return which data of the specimen a report will lack, empty if none."""
    wanted = {
        "category": specimen.category,
        "max_stroke_mm": specimen.max_stroke_mm,
        "elastic_system": specimen.elastic_system,
        "maker": specimen.maker,
        "serial": specimen.serial,
    }
    if specimen.kind != "buffer":
        del wanted["category"]
    missing = [name for name, value in wanted.items() if not value]
    if not missing:
        return ""
    return (
        f"the specimen file lacks {', '.join(missing)}: what depends on them will not be judged, and the "
        "report will show gaps; fill them in before the runs are recorded"
    )
