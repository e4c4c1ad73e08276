"""The piston's sine with which a specimen does what was asked, by what was learned of machine and valve."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.daq.strokes.correction_steps import StrokeBounds, within_force
from bufferstand.daq.strokes.cycle_checks import CLOSE_PERCENT
from bufferstand.daq.strokes.knowledge import StrokeKnowledge
from bufferstand.foundation import Harmonic
from bufferstand.protocols.prediction import Sine, piston_sine
from bufferstand.protocols.steps import ExpectedTurns, MotionEstimate, PlannedStep


@dataclass(frozen=True)
class CommandedSine:
    """What is commanded for a sine that is asked for.

    Parameters
    ----------
    piston : Sine
        The command, from first contact.
    specimen : Sine
        What the specimen should make of it.
    said : tuple of str
        Why it is not all that was asked for.
    """

    piston: Sine
    specimen: Sine
    said: tuple[str, ...] = ()


@dataclass(frozen=True)
class FirstLoading:
    """What the first loading of a sine brings.

    Parameters
    ----------
    share : float
        So many times the force of the cycles that it is commanded by.
    top_kN_per_mm : float or None
        By how much that changes with the stroke of the upper turn; None where it is not known.
    """

    share: float = 1.0
    top_kN_per_mm: float | None = None


def commanded_sine(
    motion: Harmonic,
    expected: ExpectedTurns | None,
    loading: FirstLoading,
    known: StrokeKnowledge,
    bounds: StrokeBounds,
) -> CommandedSine:
    """Return the piston's sine for a specimen's.

    Parameters
    ----------
    motion : Harmonic
        As it is asked of the specimen.
    expected : Turns or None
        The model's forces at its turns, in the cycles it is commanded by.
    loading : Loading
        What the first loading brings beyond these.
    known : StrokeKnowledge
        Machine, actuator and specimen, as learned.
    bounds : Bounds
        That no command leaves.
    """
    asked, said = Sine(motion.mean_mm, motion.amplitude_mm), []
    name = f"{motion.mean_mm:g} ± {motion.amplitude_mm:g} mm"
    lower_kN, upper_kN = known.forces(asked.lower_mm, asked.upper_mm, expected)
    peak_kN = upper_kN * loading.share * (1.0 + known.u_force(asked.upper_mm))
    top = loading.top_kN_per_mm
    if top is not None and expected is not None and expected.upper_kN > 0.0:
        top *= peak_kN / expected.upper_kN
    allowed = within_force(asked, lower_kN, peak_kN, bounds.force_max_kN, top)
    if allowed is not asked:
        said.append(
            f"{name} would bring up to {peak_kN:.0f} kN by what was learned: only "
            f"{allowed.mean_mm:.2f} ± {allowed.amplitude_mm:.2f} mm is made"
        )
        upper_kN *= bounds.force_max_kN / peak_kN
    piston = piston_sine(allowed, lower_kN, upper_kN, known.give_mm_per_kN)
    piston = Sine(piston.mean_mm + known.offset_mm, piston.amplitude_mm / known.gain(motion.frequency_Hz))
    kept = bounds.kept(piston, motion.frequency_Hz)
    if kept.amplitude_mm < (1.0 - CLOSE_PERCENT / 100.0) * piston.amplitude_mm:
        said.append(
            f"{name} would need ± {piston.amplitude_mm:.2f} mm of the piston, and "
            f"± {kept.amplitude_mm:.2f} mm are left by {bounds.holding(piston, motion.frequency_Hz)}"
        )
        allowed = Sine(allowed.mean_mm, allowed.amplitude_mm * kept.amplitude_mm / piston.amplitude_mm)
    return CommandedSine(kept, allowed, tuple(said))


def uncompensated_sine(
    motion: Harmonic, expected: ExpectedTurns | None, known: StrokeKnowledge
) -> CommandedSine:
    """Return what a sine that is asked of the piston makes the specimen do, by what was learned.

    The forces are the model's at the turns that the plan expects, by the factors that were learned.
    """
    piston = Sine(motion.mean_mm, motion.amplitude_mm)
    made = Sine(piston.mean_mm - known.offset_mm, piston.amplitude_mm * known.gain(motion.frequency_Hz))
    lower_kN, upper_kN = known.forces(made.lower_mm, made.upper_mm, expected)
    give = known.give_mm_per_kN
    lower_mm = max(0.0, made.lower_mm - give * lower_kN)
    return CommandedSine(piston, Sine.between(lower_mm, made.upper_mm - give * upper_kN))


def first_loading(
    step: PlannedStep | None, motion: Harmonic, estimate: MotionEstimate | None
) -> FirstLoading:
    """Return how much more force the first loading brings than the cycles it is commanded by, by the plan."""
    expected = None if estimate is None else estimate.usual_turns(motion.cycles)
    if step is None or estimate is None or expected is None or step.expected_peak_force_kN is None:
        return FirstLoading()
    top = None if estimate.changes is None else estimate.changes.top_kN_per_mm
    furthest_mm = max(one.turns.upper_mm for one in step.estimates if one.turns is not None)
    if estimate.turns is None or estimate.turns.upper_mm < furthest_mm or expected.upper_kN <= 0.0:
        return FirstLoading(1.0, top)  # the step's peak is that of another motion
    return FirstLoading(max(1.0, step.expected_peak_force_kN / expected.upper_kN), top)
