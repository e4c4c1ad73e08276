"""Learns from the cycles how much of a stroke frame and actuator take.

Three things lie between the command and the specimen's stroke, and each is kept as what it is, so that what
one step teaches holds for the next, whatever its stroke and frequency:

* the machine gives way: position − stroke = offset + F / k;
* the actuator follows the command with a gain and a lag (:mod:`bufferstand.daq.strokes.position_loop`);
* the specimen's forces are not those of its model: a factor at either turn.

Slow strokes show the machine, how late the piston follows an even command (as ramps do), and the specimen's
force at their top. A slow stroke goes on for a moment when the controller turns it: that is learned, too.

Old cycles are forgotten, because a specimen changes; what cannot be true is said and not used.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.strokes.position_loop import fitted_loop
from bufferstand.daq.strokes.sine_watch import CycleSeen
from bufferstand.daq.strokes.static_watch import LEAST_KN, SlowStroke
from bufferstand.protocols.steps import ExpectedTurns

Floats = NDArray[np.float64]

FORGET = 0.9
"""Weight of what was known, at each new cycle: the last ten cycles decide."""
U_TAKEN_MM = 0.03
"""Standard uncertainty of position − stroke at one force: linearity of the draw wires [mm]."""
CYCLE_WEIGHT = 2.0
"""A cycle counts as so many independent readings: its errors are those of the wires, alike in each sample."""
U_OFFSET_MM = 0.1
"""Standard uncertainty of the offset before anything was measured: how well a zero is set [mm]."""
U_GIVE_SHARE, U_GIVE = 0.5, 0.01
"""Of what the stand file states, relative; and where it states nothing [mm/kN]."""
MOST_GIVE_TIMES, MOST_GIVE = 5.0, 0.05
"""More than so many times what is stated, or (where nothing is) than this [mm/kN], is no machine."""
LEAST_GIVE = -0.0005
"""A rigid machine may seem to give way by as little as this [mm/kN]: linearity of draw wires, 0.03 mm over
60 kN."""
MOST_OFFSET_MM = 1.0
MOST_TURN_S = 0.1
GAIN_RANGE = (0.5, 1.5)
FACTOR_RANGE = (0.3, 3.0)
TELLING_KN = 30.0
"""Of such a force at a lower turn as much is believed of its factor as of the upper turn's [kN]."""
LEARN = 0.5
"""Share of a new cycle in a factor and in a response."""
SAME_FREQUENCY = 0.02
FADE = 0.5
"""What a response departs from the loop fades with the logarithm of the frequency's ratio."""
U_FACTOR, U_SHAPE = 0.003, 0.05
"""Relative standard uncertainties of a force by what was learned: where such a stroke was seen, and, times
the logarithm of the strokes' ratio, beyond the furthest that was: no spring has the shape of its model."""
REMEMBERED = 40
"""Turns that are kept, for a specimen without a model."""
LEAST_MM = 1.0
"""No stroke that was seen counts for less [mm]."""
SLOW_POINTS = 10
"""Points of a slow stroke's loading branch among them."""


@dataclass
class StrokeKnowledge:
    """Everything learned; :meth:`as_dict` and :meth:`restore` carry it to a later start.

    Parameters
    ----------
    stated_mm_per_kN : float or None
        1 / k as the stand file states it; None where it does not.
    """

    stated_mm_per_kN: float | None = None
    cycles: int = 0
    """Sines' cycles and slow strokes it was learned from."""
    turn_s: float = 0.0
    """For so long the piston goes on after a slow stroke was to turn [s]."""
    slow_lag_s: float = 0.0
    """How late the piston follows a command that moves evenly [s]; 0 before it was seen."""
    _sums: list[float] = field(default_factory=lambda: [0.0] * 5)
    _servo_mm: float = 0.0
    _responses: dict[float, complex] = field(default_factory=dict)
    _factors: list[float] = field(default_factory=lambda: [1.0, 1.0])
    _seen: list[bool] = field(default_factory=lambda: [False, False])
    _turns: list[tuple[float, float]] = field(default_factory=list)

    # --- learning -----------------------------------------------------------------------------------

    def take(self, cycle: CycleSeen, expected: ExpectedTurns | None) -> list[str]:
        """Learn from a cycle.

        Parameters
        ----------
        cycle : CycleSeen
            What it did.
        expected : Turns or None
            The model's forces for it.

        Returns
        -------
        list of str
            What could not be true and is not used.
        """
        self.cycles += 1
        self._take_machine(cycle.force_kN, cycle.taken_mm)
        self._servo_mm += LEARN * (cycle.command.mean_mm - cycle.position.mean_mm - self._servo_mm)
        self._take_response(cycle)
        if expected is not None:
            # The model's forces are those at the turns that it expects: what was seen is carried there.
            lower_mm = expected.lower_mm - cycle.stroke.lower_mm
            upper_mm = expected.upper_mm - cycle.stroke.upper_mm
            lower_kN = cycle.lower_kN + cycle.bottom_kN_per_mm * lower_mm
            self._take_factor(1, cycle.upper_kN + cycle.top_kN_per_mm * upper_mm, expected.upper_kN)
            # A small force says little of a factor: there, that of the upper turn is believed.
            part = expected.lower_kN**2 / (expected.lower_kN**2 + TELLING_KN**2)
            believed_kN = self._factors[1] * expected.lower_kN
            self._take_factor(0, part * lower_kN + (1.0 - part) * believed_kN, expected.lower_kN)
        self._turns += [(cycle.stroke.lower_mm, cycle.lower_kN), (cycle.stroke.upper_mm, cycle.upper_kN)]
        self._turns = self._turns[-REMEMBERED:]
        return self._doubts(cycle.frequency_Hz)

    def take_slow(self, slow: SlowStroke, expected: ExpectedTurns | None) -> list[str]:
        """Learn from slow strokes: the machine, how late the piston follows, and the force at their top.

        Of a specimen that nobody has seen unload to a turn, the force there is taken to have changed as that
        of the loading branch.

        Parameters
        ----------
        slow : SlowStroke
            What they showed.
        expected : Turns or None
            The model's force at their top.

        Returns
        -------
        list of str
            What could not be true and is not used.
        """
        self.cycles += 1
        self._take_machine(slow.force_kN, slow.taken_mm)
        self.take_lag(slow.lag_s)
        if expected is not None and expected.upper_kN >= LEAST_KN:
            self._take_factor(1, slow.loading_force_kN(expected.upper_mm), expected.upper_kN)
            if not self._seen[0]:
                self._factors[0] = self._factors[1]
        places = np.linspace(0.0, float(slow.loading_mm[-1]), SLOW_POINTS + 1)[1:]
        self._turns += [(float(one), slow.loading_force_kN(float(one))) for one in places]
        self._turns = self._turns[-REMEMBERED:]
        return self._doubts(None)

    def take_lag(self, lag_s: float) -> None:
        """Learn how late the piston follows a command that moves evenly [s]; 0 where that was not seen."""
        if lag_s > 0.0:
            self.slow_lag_s += (LEARN if self.slow_lag_s else 1.0) * (lag_s - self.slow_lag_s)

    def take_turn(self, turn_s: float) -> None:
        """Learn how long the piston went on after a slow stroke was to turn [s]."""
        turn_s = min(max(turn_s, 0.0), MOST_TURN_S)
        self.turn_s += (LEARN if self.turn_s else 1.0) * (turn_s - self.turn_s)

    def _take_machine(self, force: Floats, taken: Floats) -> None:
        means = (1.0, force.mean(), (force**2).mean(), taken.mean(), (force * taken).mean())
        self._sums = [
            FORGET * kept + CYCLE_WEIGHT * float(new) for kept, new in zip(self._sums, means, strict=True)
        ]

    def _take_response(self, cycle: CycleSeen) -> None:
        near = self._nearest(cycle.frequency_Hz)
        inverse = 1.0 / cycle.response
        if near is not None and abs(math.log(near / cycle.frequency_Hz)) < SAME_FREQUENCY:
            self._responses[near] += LEARN * (inverse - self._responses[near])
        else:
            self._responses[cycle.frequency_Hz] = inverse

    def _take_factor(self, which: int, seen_kN: float, expected_kN: float) -> None:
        if expected_kN < LEAST_KN or seen_kN < LEAST_KN:
            return
        factor = min(max(seen_kN / expected_kN, FACTOR_RANGE[0]), FACTOR_RANGE[1])
        share = LEARN if self._seen[which] else 1.0
        self._factors[which] += share * (factor - self._factors[which])
        self._seen[which] = True

    def _doubts(self, frequency_Hz: float | None) -> list[str]:
        """Return what was found that cannot be."""
        found = []
        offset_mm, give = self._machine()
        if not self._give_is_possible(give):
            instead = (
                "what the stand file states is used" if self.stated_mm_per_kN else "it is taken for rigid"
            )
            found.append(
                f"piston and draw wires make the machine give way by {1e3 * give:.2f} mm per 1000 kN, which "
                f"cannot be; {instead}: look at the draw wires and at the zero"
            )
        if abs(offset_mm) > MOST_OFFSET_MM:
            found.append(
                f"piston and draw wires are {offset_mm:+.2f} mm apart without force, which is not made up "
                "for: touch off (“bufferstand stand zero”, or [zero] touch = true; a tare cannot tell)"
            )
        if frequency_Hz is None:
            return found
        gain = 1.0 / abs(self._inverse(frequency_Hz))
        if not GAIN_RANGE[0] <= gain <= GAIN_RANGE[1]:
            found.append(
                f"the piston makes {100.0 * gain:.0f} % of its command at {frequency_Hz:g} Hz, which is not "
                "made up for: look at the controller"
            )
        return found

    # --- what is known ------------------------------------------------------------------------------

    @property
    def give_mm_per_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """By how much the machine gives way under 1 kN [mm/kN]; as stated until it was measured."""
        give = self._machine()[1]
        return max(give, 0.0) if self._give_is_possible(give) else self.stated_mm_per_kN or 0.0

    @property
    def offset_mm(self) -> float:
        """How much further the command is than the specimen's stroke without force [mm]."""
        offset_mm = self._machine()[0] + self._servo_mm
        return offset_mm if abs(offset_mm) <= MOST_OFFSET_MM else 0.0

    def gain(self, frequency_Hz: float) -> float:
        """Return the piston's amplitude over that of its command; 1 until it was measured."""
        gain = 1.0 / abs(self._inverse(frequency_Hz))
        return gain if GAIN_RANGE[0] <= gain <= GAIN_RANGE[1] else 1.0

    def forces(self, lower_mm: float, upper_mm: float, expected: ExpectedTurns | None) -> tuple[float, float]:
        """Return the forces [kN] at the turns of a sine: the model's by the factors, or as remembered."""
        if expected is not None:
            return self._factors[0] * expected.lower_kN, self._factors[1] * expected.upper_kN
        return self._remembered(lower_mm), self._remembered(upper_mm)

    def u_force(self, stroke_mm: float) -> float:
        """Return the relative standard uncertainty of a force that is expected; 0 before one was seen."""
        if not self._turns or stroke_mm <= 0.0:
            return 0.0
        furthest_mm = max(LEAST_MM, *(stroke for stroke, _ in self._turns))
        return U_FACTOR + U_SHAPE * max(0.0, math.log(stroke_mm / furthest_mm))

    def change_kN(self, now: ExpectedTurns | None, then: ExpectedTurns | None) -> tuple[float, float]:  # noqa: N802
        """Return by how much the forces at the turns change from one cycle to another [kN]."""
        if now is None or then is None:
            return 0.0, 0.0
        lower, upper = self._factors
        return lower * (then.lower_kN - now.lower_kN), upper * (then.upper_kN - now.upper_kN)

    def force(self, stroke_mm: float, expected: ExpectedTurns | None) -> float:
        """Return the force [kN] of a compression to a stroke."""
        return self.forces(0.0, stroke_mm, expected)[1]

    def _remembered(self, stroke_mm: float) -> float:
        if not self._turns or stroke_mm <= 0.0:
            return 0.0
        strokes, forces = zip(*sorted(self._turns), strict=True)
        return float(np.interp(stroke_mm, (0.0, *strokes), (0.0, *forces)))

    def _machine(self) -> tuple[float, float]:
        """Return offset [mm] and give [mm/kN]: least squares with what was known before as observations."""
        stated = self.stated_mm_per_kN or 0.0
        u_give = U_GIVE_SHARE * stated if stated else U_GIVE
        weight = 1.0 / U_TAKEN_MM**2
        n, f, ff, y, fy = (weight * value for value in self._sums)
        left = np.array([[n + U_OFFSET_MM**-2, f], [f, ff + u_give**-2]])
        offset_mm, give = np.linalg.solve(left, np.array([y, fy + stated * u_give**-2]))
        return float(offset_mm), float(give)

    def _give_is_possible(self, give: float) -> bool:
        stated = self.stated_mm_per_kN
        return LEAST_GIVE <= give <= (MOST_GIVE if not stated else MOST_GIVE_TIMES * stated)

    def _nearest(self, frequency_Hz: float) -> float | None:
        """Return the frequency nearest to one at which a response was measured."""
        return min(self._responses, key=lambda known: abs(math.log(known / frequency_Hz)), default=None)

    def _inverse(self, frequency_Hz: float) -> complex:
        """Return 1/H at a frequency: the loop, and what its nearest measured neighbour departs from it."""
        near = self._nearest(frequency_Hz)
        loop = fitted_loop(self._responses, self.slow_lag_s)
        if near is None:
            return loop(frequency_Hz)
        departs = self._responses[near] / loop(near) - 1.0
        return loop(frequency_Hz) * (1.0 + departs * math.exp(-abs(math.log(near / frequency_Hz)) / FADE))

    # --- to a later start ---------------------------------------------------------------------------

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data."""
        return {
            "cycles": self.cycles,
            "give_mm_per_kN": self.give_mm_per_kN,
            "offset_mm": self.offset_mm,
            "force_factors": list(self._factors) if any(self._seen) else None,
            "seen": list(self._seen),
            "sums": list(self._sums),
            "servo_mm": self._servo_mm,
            "turn_s": self.turn_s,
            "slow_lag_s": self.slow_lag_s,
            "responses": [[f, one.real, one.imag] for f, one in self._responses.items()],
            "turns": [list(pair) for pair in self._turns],
        }

    def restore(self, kept: Mapping[str, Any]) -> None:
        """Go on with what an earlier start learned."""
        self.cycles = int(kept["cycles"])
        self._sums = [float(one) for one in kept["sums"]]
        self._servo_mm, self.turn_s = float(kept["servo_mm"]), float(kept["turn_s"])
        self.slow_lag_s = float(kept["slow_lag_s"])
        self._responses = {float(f): complex(re, im) for f, re, im in kept["responses"]}
        if kept["force_factors"] is not None:
            self._factors = [float(one) for one in kept["force_factors"]]
            self._seen = [bool(one) for one in kept["seen"]]
        self._turns = [(float(stroke), float(force)) for stroke, force in kept["turns"]]


def is_knowledge(kept: object) -> TypeGuard[Mapping[str, Any]]:
    """Return whether something is what :meth:`StrokeKnowledge.as_dict` makes, so that it can be restored."""
    if not isinstance(kept, Mapping):
        return False
    try:
        StrokeKnowledge().restore(kept)
    except (LookupError, TypeError, ValueError, OverflowError):
        return False
    return True
