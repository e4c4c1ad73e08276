"""How the forces at the turns of a cyclic motion change: as the specimen warms, and as a sine settles.

A spring loses about 1 % of its force per kelvin, and the first cycles of a small sine still run on the branch
of the loading before them. What is learned of the specimen from a cycle is learned against the forces of that
cycle, or else warming and settling would be taken for a softer or a stiffer spring.
"""

from __future__ import annotations

from bufferstand.foundation import Harmonic, StaticCycles
from bufferstand.protocols.prediction.machine_stroke import Sine, piston_mm
from bufferstand.protocols.prediction.predictor import Predictor
from bufferstand.protocols.prediction.sine_start import first_turns
from bufferstand.protocols.steps import ExpectedTurns, Motion, TurnChanges

WARMER_K = 10.0
"""The second temperature, so much above that of the beginning [K]."""
SHORT_SHARE = 0.1
"""The stiffness at the upper turn is told by a sine whose range is so much shorter there."""
SETTLING_CYCLES = 8
"""After so many cycles a sine counts as settled as it will be: what is left goes on for long."""


def turn_changes(
    predictor: Predictor,
    motion: Motion,
    turns: ExpectedTurns | None,
    begin_C: float,
    ramp_speed_mm_per_s: float,
    give_mm_per_kN: float,
    *,
    compensate: bool,
) -> TurnChanges | None:
    """Return how the turns of a motion change; None if it is not cyclic or no forces are known.

    Parameters
    ----------
    predictor : Predictor
        The specimen.
    motion : Motion
        As it is asked for.
    turns : Turns or None
        Those at its beginning.
    begin_C : float
        Temperature of the specimen's mass then [°C].
    ramp_speed_mm_per_s : float
        Of the ramp to a sine's mean.
    give_mm_per_kN : float
        1 / k of the machine.
    compensate : bool
        Whether the stroke that is asked for is the specimen's; else it is the piston's.
    """
    if turns is None:
        return None
    taken, warmer_C = 0.0 if compensate else give_mm_per_kN, begin_C + WARMER_K
    if isinstance(motion, StaticCycles):
        slow = predictor.static(
            motion.force_limit_kN, motion.stroke_limit_mm, motion.speed_mm_per_s, warmer_C, taken
        )
        return TurnChanges(
            begin_C,
            warmer_C,
            _turns(Sine.between(0.0, slow.end_stroke_mm), 0.0, slow.peak_force_kN, give_mm_per_kN),
        )
    if not isinstance(motion, Harmonic):
        return None
    warm = predictor.harmonic(motion.mean_mm, motion.amplitude_mm, motion.frequency_Hz, warmer_C, taken)
    piston = Sine.between(turns.piston_lower_mm, turns.piston_upper_mm)
    first = first_turns(
        predictor, piston, motion.frequency_Hz, ramp_speed_mm_per_s, begin_C,
        min(SETTLING_CYCLES, motion.cycles), give_mm_per_kN,
    )  # fmt: skip
    short_mm = SHORT_SHARE * 2.0 * motion.amplitude_mm
    short = predictor.harmonic(
        motion.mean_mm - 0.5 * short_mm,
        motion.amplitude_mm - 0.5 * short_mm,
        motion.frequency_Hz,
        begin_C,
        taken,
    )
    moved_mm = turns.upper_mm - short.stroke.upper_mm
    top = (turns.upper_kN - short.peak_force_kN) / moved_mm if moved_mm > 0.0 else None
    warmer = _turns(warm.stroke, warm.lower_force_kN, warm.peak_force_kN, give_mm_per_kN)
    return TurnChanges(begin_C, warmer_C, warmer, tuple(first), top)


def _turns(stroke: Sine, lower_kN: float, upper_kN: float, give_mm_per_kN: float) -> ExpectedTurns:
    low_mm, high_mm = stroke.lower_mm, stroke.upper_mm
    return ExpectedTurns(
        low_mm, high_mm, lower_kN, upper_kN,
        piston_mm(low_mm, lower_kN, give_mm_per_kN), piston_mm(high_mm, upper_kN, give_mm_per_kN),
    )  # fmt: skip
