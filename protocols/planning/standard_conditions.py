"""Where a planned static test would miss a condition of EN 15551 (105 mm buffers, paper § 2.1): in time.

What is judged afterwards from the record (``bufferstand evaluate --limits``) is another matter: this is a
warning in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from bufferstand.foundation import StaticCycles, duration_text
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.steps import PlannedStep

SPEED_MAX_MM_PER_S = 50.0
PAUSE_MAX_S = 600.0
CYCLES = 3
TEMPERATURES_C = (15.0, 25.0)
REST_AFTER_ASSEMBLY = timedelta(hours=72)


def missed_conditions(
    steps: Sequence[PlannedStep], specimen: Specimen, begins: datetime | None = None
) -> list[str]:
    """Return a sentence for every static step that will not be a test by EN 15551, and why.

    Parameters
    ----------
    steps : sequence of PlannedStep
        Of the plan; only its static ones are looked at (proof loads are other tests), and of these not those
        that the campaign calls characterisation.
    specimen : Specimen
        Only buffers of 105 mm stroke, or of a stroke that is not known, are looked at.
    begins : datetime, optional
        When the campaign begins, for the 72 h after assembly; None leaves that out.
    """
    if specimen.kind != "buffer" or specimen.max_stroke_mm not in (None, 105.0):
        return []
    notes = []
    statics = [step for step in steps if _is_test(step)]
    elapsed_s = {
        step.index: sum(other.expected_duration_s for other in steps[:n]) for n, step in enumerate(steps)
    }
    for step in statics:
        missed = [*_of_motion(step), *_of_temperature(step)]
        if begins is not None:
            missed += _of_age(specimen, begins + timedelta(seconds=elapsed_s[step.index]))
        if missed:
            notes.append(f"step {step.index} “{step.name}” is no test by EN 15551: {'; '.join(missed)}")
    return notes


def _is_test(step: PlannedStep) -> bool:
    return step.kind == "static" and step.proof_load is None and step.purpose != "characterisation"


def _of_motion(step: PlannedStep) -> list[str]:
    missed = []
    for motion in step.motions:
        if not isinstance(motion, StaticCycles):
            continue
        if motion.speed_mm_per_s > SPEED_MAX_MM_PER_S:
            missed.append(f"{motion.speed_mm_per_s:g} mm/s (at most {SPEED_MAX_MM_PER_S:g})")
        if motion.pause_s > PAUSE_MAX_S:
            pause, most = duration_text(motion.pause_s), duration_text(PAUSE_MAX_S)
            missed.append(f"pauses of {pause} (at most {most})")
        if motion.cycles < CYCLES:
            missed.append(f"{motion.cycles} {'cycle' if motion.cycles == 1 else 'cycles'} ({CYCLES} needed)")
    return missed


def _of_temperature(step: PlannedStep) -> list[str]:
    low_C, high_C = TEMPERATURES_C
    coolest_C = min(step.start_temperature_C, step.end_temperature_C)
    missed = []
    if coolest_C < low_C:
        missed.append(f"{coolest_C:.1f} °C expected (at least {low_C:g})")
    if step.max_temperature_C > high_C:
        missed.append(f"{step.max_temperature_C:.1f} °C expected (at most {high_C:g})")
    return missed


def _of_age(specimen: Specimen, begins: datetime) -> list[str]:
    if specimen.assembled is None:
        return ["the specimen file does not say when it was assembled (72 h before)"]
    age = begins.astimezone(UTC) - specimen.assembled.astimezone(UTC)
    if age >= REST_AFTER_ASSEMBLY:
        return []
    hours = age.total_seconds() / 3600.0
    return [f"{hours:.0f} h after assembly (at least 72 h)"]
