"""Before anything moves: devices fresh, force at zero, room on the disk, the specimen's data complete."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from bufferstand.daq.acquisition import Acquisition
from bufferstand.daq.guards.kinds import TemperatureGuard
from bufferstand.daq.guards.wiring import SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.forces import doubt_at_rest
from bufferstand.daq.scaling import FORCES
from bufferstand.foundation.channels import STROKE_CHANNELS, Zero, farthest_strokes
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.campaign_file import ZeroTable
from bufferstand.protocols.steps import PlannedStep

FIRST_LOOK_S = 0.5
"""So long at least every device is watched before anything moves [s of stand time]."""
LOOK_AGAIN_S = 1.0
"""A wire that seems a little too slow for the samples is looked at for so long besides [s of the wall]."""
LITTLE = 0.8
"""One that carries less than this share of them is: no busy computer explains it."""
ZERO_NOTE_SHARE = 0.2
"""From this share of the refusal on, a force at rest is said."""
DISK_RESERVE_BYTES = 64 * 2**20
"""Room that must be left over: a journal and its run file exist side by side for a moment."""
SEALING_FACTOR = 1.5
"""Room for the plan's samples, and for the largest run twice."""


LOOKED_AT = (*FORCES, "position", *STROKE_CHANNELS)
"""Channels whose mean at rest is looked at."""
ALIKE_MM = 2.0
"""Wires that are off by as much as each other, or as the piston, to within this are so for one reason."""


def first_look(acquisition: Acquisition, pump: Callable[[], object]) -> dict[str, float]:
    """Watch until the controller and every specimen sensor have spoken; return the means at rest [kN, mm].

    What waited in the controller's ring is of before, such as the end of its own release behind a program
    that was killed: the stand at rest is what is sampled once all of that is read, or over a wire that never
    keeps up the newest there is.

    Parameters
    ----------
    acquisition : Acquisition
        Its panel trips by itself when a sensor stays silent.
    pump : callable
        One pass; raises when a guard has tripped.
    """
    clock, panel = acquisition.clock, acquisition.panel
    began_s, was_behind = clock.now_s(), True
    specimen = [guard.stream for guard in panel.guards.of(TemperatureGuard) if guard.stop_C is not None]
    seen: dict[str, list[float]] = {}
    while True:
        pump()
        latest, heard = acquisition.latest, panel.latest_temperatures()
        if was_behind:
            seen.clear()
        was_behind = acquisition.is_behind
        for name in LOOKED_AT:
            if name in latest.values:
                seen.setdefault(name, []).append(latest.values[name])
        spoken = latest.samples > 0 and all(name in heard for name in specimen)
        if spoken and clock.now_s() - began_s >= FIRST_LOOK_S:
            return {name: sum(values) / len(values) for name, values in seen.items()}


def delivery_trouble(acquisition: Acquisition, pump: Callable[[], object]) -> str:
    """Return why the controller's samples cannot all be read over this wire, empty if they can.

    A wire that seems a little too slow is looked at for longer: it may be this computer that was busy.

    Parameters
    ----------
    acquisition : Acquisition
        Has read some blocks already.
    pump : callable
        One pass; raises when a guard has tripped.
    """
    end_s = acquisition.clock.wall_s() + LOOK_AGAIN_S
    while (delivery := acquisition.stand.controller.delivery()) is not None and not delivery.keeps_up:
        if delivery.most_Hz < LITTLE * delivery.rate_Hz or acquisition.clock.wall_s() >= end_s:
            return f"the controller {delivery.text}"
        pump()
    return ""


def delivery_remark(acquisition: Acquisition) -> str:
    """Return what is to be said of a wire that just keeps up; empty where there is nothing to say."""
    delivery = acquisition.stand.controller.delivery()
    return "" if delivery is None else delivery.remark


def zero_trouble(force_kN: float, most_kN: float, *, tared: bool = False) -> tuple[str, bool]:
    """Return what is to be said of the force at rest with the valve off, and whether it refuses the start.

    ``tared``: it will be taken off when first contact is touched off.
    """
    size_kN = abs(force_kN)
    if size_kN <= ZERO_NOTE_SHARE * most_kN:
        return "", False
    text = f"at rest with the valve off the force reads {force_kN:+.2f} kN"
    if not size_kN <= most_kN:  # true for NaN, too
        limit = f"{text}, more than zero_force_max_kN = {most_kN:g} kN"
        return f"{limit}: unload the specimen, or set the zero of transducer or calibration", True
    if tared:
        return f"{text}: it will be taken off when first contact is touched off", False
    return f"{text}: every force of this campaign is off by that; set the zero", False


def forces_doubt(rest: Mapping[str, float], zero: Zero | None, most_kN: float) -> SignalDoubt | None:
    """Return the doubt of two ways to the force that do not agree at rest, None where they do.

    Parameters
    ----------
    rest : mapping of str to float
        Means at rest, without any zero [kN].
    zero : Zero or None
        What is subtracted from them.
    most_kN : float
        A force of more than this refuses the start, which is said.
    """
    own = {name: rest[name] - (0.0 if zero is None else zero.value(name)) for name in FORCES if name in rest}
    if "force" not in own:
        return None
    over = abs(own["force"]) > most_kN
    more = " at rest with the valve off" + (
        f", more than zero_force_max_kN = {most_kN:g} kN," if over else ""
    )
    counted = zero is not None and all(zero.of(name) is not None for name in FORCES)
    return doubt_at_rest(own["force"], own.get("force_2"), counted=counted, more=more)


def stroke_trouble(rest: Mapping[str, float], zero: Zero | None, table: ZeroTable, *, touched: bool) -> str:
    """Return why the draw wires read too much at rest for a campaign to begin, empty if they do not.

    Parameters
    ----------
    rest : mapping of str to float
        Means at rest, without any zero [mm].
    zero : Zero or None
        What is subtracted from them.
    table : ZeroTable
        The limits.
    touched : bool
        Whether first contact will be touched off.
    """
    most_mm, key = table.stroke_untouched_max_mm, "stroke_untouched_max_mm"
    if touched:
        most_mm, key = table.stroke_max_mm, "stroke_max_mm"
    far = _beyond(rest, zero, most_mm)
    if not far:
        return ""
    what = "" if zero is None else " from the zero that was taken over"
    do = "hook the wire in anew, or correct the zero or the scale of its calibration"
    if not touched:
        do = "let the campaign touch off ([zero] touch = true), or run “bufferstand stand zero”"
    reads = " and ".join(
        f"{name} reads {value:+.2f} mm" if n == 0 else f"{name} {value:+.2f} mm"
        for n, (name, value) in enumerate(far.items())
    )
    return f"{reads} at rest{what}, more than [zero] {key} = {most_mm:g} mm: {do}"


def wires_doubt(rest: Mapping[str, float], zero: Zero | None, table: ZeroTable) -> SignalDoubt | None:
    """Return the doubt of draw wires that read more at rest than a touch takes for zero, None if none does.

    Parameters
    ----------
    rest, zero, table
        As of :func:`stroke_trouble`, whose sentence it begins with.
    """
    far = _beyond(rest, zero, table.stroke_max_mm)
    if not far:
        return None
    names, setting = ", ".join(far), channel_setting(", ".join(far), "calibration")
    text, value = stroke_trouble(rest, zero, table, touched=True), max(far.values(), key=abs)
    if (
        len(far) == _wires_among(rest) > 1
        and max(far.values()) - min(far.values()) < ALIKE_MM
        and "position" in rest
    ):
        setting += f", or {channel_setting('position', 'calibration')}"
        own_mm = rest["position"]
        text += (
            f"; {'both' if len(far) == 2 else 'all'} wires are off alike, and the piston reads "
            f"{own_mm:+.2f} mm"
            + (": it stands out there, or its own zero is off, too" if abs(own_mm - value) < ALIKE_MM else "")
        )
    return SignalDoubt("zero", names, "controller", setting, text, value, table.stroke_max_mm, "mm")


def _wires_among(rest: Mapping[str, float]) -> int:
    return sum(name in rest for name in STROKE_CHANNELS)


def _beyond(rest: Mapping[str, float], zero: Zero | None, most_mm: float) -> dict[str, float]:
    """Return the draw wires that read more than so much at rest, or no number, and what they read [mm]."""
    reads = {
        name: rest.get(name, 0.0) - (0.0 if zero is None else zero.value(name)) for name in STROKE_CHANNELS
    }
    return {name: value for name, value in reads.items() if not abs(value) <= most_mm}  # true for NaN, too


def apart_trouble(rest: Mapping[str, float], most_mm: float) -> str:
    """Return why draw wires differ too much at rest for first contact to be touched off, else empty.

    They hang on the specimen: what they differ by at rest they differ by at first contact.

    Parameters
    ----------
    rest : mapping of str to float
        Means at rest, without any zero [mm].
    most_mm : float
        The limit at first contact [mm].
    """
    farthest = farthest_strokes(rest)
    if farthest is None or abs(farthest[2]) <= most_mm:
        return ""
    one, two, apart_mm = farthest
    return (
        f"at rest the draw wires differ by {apart_mm:+.2f} mm ({one} − {two}), more than "
        f"{most_mm:g} mm ([zero] wires_apart_max_mm, else the tilt in force): align the specimen, or hook "
        "the wires in anew"
    )


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
