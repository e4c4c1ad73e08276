"""The announcement of what a start of a campaign is about to move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bufferstand.cli.arming import Movement
from bufferstand.cli.campaign.preparation import PreparedCampaign
from bufferstand.daq.zero import met_peak_kN, turned_peak_kN
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import duration_text
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.campaign_file import ZeroTable
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.steps import Hold, Motion, PlannedStep, WaitUntilCool, motion_dict

_UNITS = {
    "_mm_per_s": "mm/s", "_kN_per_s": "kN/s", "_mm": "mm", "_kN": "kN", "_Hz": "Hz", "_s": "s", "_C": "°C",
}  # fmt: skip
"""Endings of names and the units they stand for, the longer ones first."""


def campaign_movement(
    prepared: PreparedCampaign, left: Sequence[tuple[PlannedStep, Sequence[Motion]]]
) -> Movement:
    """Return what is about to be moved by a campaign.

    Parameters
    ----------
    prepared : Prepared
        The campaign, its stand and its specimen.
    left : sequence of (PlannedStep, motions)
        What is still to be done, in order (:func:`bufferstand.daq.campaign_folder.start_records.left_to_do`).
    """
    specimen = prepared.specimen_file.specimen
    return Movement(
        "specimen",
        specimen.id,
        (
            ("stand", stand_text(prepared.wired)),
            ("specimen", _specimen_text(specimen)),
            ("limits", _limits_text(prepared.plan, prepared.stand_file)),
            *(("not guarded", text) for text in prepared.plan.not_guarded),
            *_touch_rows(prepared.plan),
            ("first motion", _first_text(left, len(prepared.plan.steps))),
            ("in all", _all_text([step for step, _ in left])),
        ),
    )


def stand_text(stand_file: StandFile) -> str:
    """Return a stand's id, name and where its controller is reached, e.g. for an announcement."""
    facts, controller = stand_file.stand, stand_file.controller
    wire = (
        f"Modbus RTU {controller.serial}, {controller.baud} baud"
        if controller.serial
        else f"Modbus TCP {controller.host}:{controller.port}"
    )
    name = f" “{facts.name}”" if facts.name else ""
    return f"{facts.id}{name}, {wire}, unit {controller.device_id}"


def motion_text(motion: Motion) -> str:
    """Return a motion in words with its units, e.g. ``ramp (target 20 mm, speed 20 mm/s)``."""
    content = motion_dict(motion)
    name = content.pop("motion")
    return f"{name} ({', '.join(_parameter(key, value) for key, value in content.items())})"


def _parameter(key: str, value: Any) -> str:
    ending = next((ending for ending in _UNITS if key.endswith(ending)), "")
    words = key.removesuffix(ending).replace("_", " ")
    figure = f"{value:.4g}" if isinstance(value, float) else str(value)
    return f"{words} {figure} {_UNITS[ending]}" if ending else f"{words} {figure}"


def _specimen_text(specimen: Specimen) -> str:
    category = f"category {specimen.category}" if specimen.category else ""
    serial = f"serial {specimen.serial}" if specimen.serial else ""
    parts = (specimen.id, specimen.kind, category, specimen.maker, serial)
    return ", ".join(part for part in parts if part)


def _limits_text(plan: Plan, stand_file: StandFile) -> str:
    limits, test = plan.limits, plan.campaign.limits
    watched = any(sensor.role == "specimen" for sensor in stand_file.temperature_sensors)
    heat = f"{test.temperature_stop_C:g} °C" if watched else "none for heat: no thermometer on the specimen"
    return (
        f"{limits.force.value:g} kN, {limits.stroke.value:g} mm, {limits.speed.value:g} mm/s, "
        f"{limits.frequency.value:g} Hz; guards stop it at {limits.force_trip_kN:g} kN, "
        f"{limits.stroke_trip_mm:g} mm, {heat}"
    )


def touch_rows(
    table: ZeroTable, back_mm_per_s: float, stiffness_kN_per_mm: float
) -> tuple[tuple[str, str], ...]:
    """Return what a touch moves: first to the piston's own zero from wherever it stands, then the creep.

    Parameters
    ----------
    table : ZeroTable
        Travel, speed and force.
    back_mm_per_s : float
        Speed of the release that brings a piston back to its zero.
    stiffness_kN_per_mm : float
        Of the machine; 0 where it is not known.
    """
    forward = f"{table.speed_mm_per_s:g} mm/s"
    peak_kN, met_kN = turned_peak_kN(table, stiffness_kN_per_mm), met_peak_kN(table, stiffness_kN_per_mm)
    way = (
        f"first of all, to the piston's zero from wherever it stands: back at {back_mm_per_s:g} mm/s, "
        f"forward at {forward}"
    )
    creep = (
        f"up to {table.travel_max_mm:g} mm at {forward}, to {peak_kN:.1f} kN at most, and back "
        f"({met_kN:.1f} kN at most where the specimen is met before the piston's zero)"
    )
    return (("way to zero", way), ("touch-off", creep))


def _touch_rows(plan: Plan) -> tuple[tuple[str, str], ...]:
    """Return what comes before the first stroke: touching off, unless the campaign says otherwise."""
    content = plan.campaign.content
    if not content.zero.touch:
        return ()
    give = plan.limits.machine.give_mm_per_kN
    stiffness = 1.0 / give if give > 0.0 else 0.0
    return touch_rows(content.zero, content.motion.release_speed_mm_per_s, stiffness)


def _first_text(left: Sequence[tuple[PlannedStep, Sequence[Motion]]], steps: int) -> str:
    """Return the first step that moves something, with its motions from the first that does."""
    for step, motions in left:
        still = [isinstance(motion, Hold | WaitUntilCool) for motion in motions]
        if all(still):
            continue
        moving = motions[still.index(False) :]
        return f"step {step.index} of {steps} “{step.name}”: {', then '.join(motion_text(m) for m in moving)}"
    return "none is left to do"


def _all_text(steps: Sequence[PlannedStep]) -> str:
    forces = [step.expected_peak_force_kN for step in steps if step.expected_peak_force_kN is not None]
    speeds = [step.peak_speed_mm_per_s for step in steps if step.peak_speed_mm_per_s is not None]
    parts = [f"{len(steps)} step{'' if len(steps) == 1 else 's'}"]
    parts += [f"{max(forces):.0f} kN expected"] if forces else []
    parts += [f"{max(speeds):.4g} mm/s"] if speeds else []
    return f"{', '.join(parts)}, {duration_text(sum(step.duration_s for step in steps))}"
