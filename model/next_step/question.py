"""A question: a figure of the spring in a state, and to what uncertainty it is to be known."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.identification import (
    LAWS,
    NAMES,
    BandStage,
    LagStage,
    answer,
    curves_at_knots,
    model_of,
)
from bufferstand.model.next_step.knowledge import Knowledge, Spring
from bufferstand.model.next_step.pieces import Candidate, Loops, RunNoise, drive_of
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]

COVERAGE = 2.0
"""Coverage factor of the U that is asked for, as everywhere in an evaluation."""
FIGURES = {"damping": "", "stiffness": "kN/mm", "force": "kN"}
"""Figures of a loop that can be asked for, and their units: absorbed over stored energy, secant stiffness,
force at the upper turning point."""
FORM = "damping at 40 +- 40 mm, 1 Hz, 20 C to 0.002"
_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_CYCLES = 3
_STEP = 1e-4
_MOST = {"mm": 1000.0, "Hz": 50.0, "C": 200.0}


@dataclass(frozen=True)
class Question:
    """A figure of a settled loop, or a parameter, and the expanded uncertainty (k = 2) it is to have.

    Attributes
    ----------
    figure : str
        One of :data:`FIGURES`, or a parameter's name.
    loop : Loops or None
        None for a parameter.
    temperature_C : float
        Of the spring.
    expanded_uncertainty : float
        In the figure's unit.
    text : str
        As it was asked.
    """

    figure: str
    loop: Loops | None
    temperature_C: float
    expanded_uncertainty: float
    text: str

    @property
    def unit(self) -> str:
        """Unit of the figure; empty for a number."""
        if self.loop is not None:
            return FIGURES[self.figure]
        return LAWS[NAMES.index(self.figure)].unit

    @classmethod
    def parsed(cls, text: str) -> Question:
        """Read a question such as :data:`FORM`, or ``beta to 0.002``.

        Raises
        ------
        BadInput
            If it cannot be understood: it says at which character, and what was expected there.
        """
        reader = _Reader(text)
        known = {law.symbol: law.name for law in LAWS} | {name: name for name in NAMES}
        word = reader.word({**dict.fromkeys(FIGURES, ""), **known}, "a figure or a parameter")
        loop, temperature = None, 0.0
        if word in FIGURES:
            reader.literal("at")
            prestress = reader.number("mm", "the prestress [mm]", wanted=False)
            reader.sign()
            amplitude = reader.number("mm", "the amplitude, half the range [mm]", least=0.1)
            if amplitude > prestress:
                raise reader.wrong(
                    f"a loop of {prestress:g} ± {amplitude:g} mm leaves the spring",
                    "an amplitude ≤ prestress",
                )
            reader.literal(",")
            frequency = reader.number("Hz", "the frequency [Hz]", least=1e-3)
            reader.literal(",")
            temperature = reader.number("C", "the spring's temperature [°C]", least=-50.0)
            loop = Loops(prestress, amplitude, frequency, _CYCLES)
        reader.literal("to")
        uncertainty = reader.number(None, "the expanded uncertainty (k = 2)", least=1e-12)
        reader.end()
        return cls(known.get(word, word), loop, temperature, uncertainty, text)

    def value_and_gradient(self, spring: Spring) -> tuple[float, Floats]:
        """Return the figure by the spring as it is known, and its derivatives by the spring's entries.

        Raises
        ------
        BadInput
            If the loop lies beyond what is known of the curves.
        """
        if self.loop is None:
            law, at = LAWS[NAMES.index(self.figure)], spring.frame.place(self.figure)
            entry = float(spring.vector[at])
            value = law.to_value(entry)
            gradient = np.zeros(spring.frame.size)
            gradient[at] = value if law.kind == "log" else 1.0
            return value, gradient
        end = spring.frame.knots_mm[-1]
        if (top := self.loop.prestress_mm + self.loop.amplitude_mm) > end:
            raise BadInput(
                f"the loop goes to {top:g} mm, and the runs end at {end:.4g} mm: beyond no curve is measured",
                place=f"--question “{self.text}”",
                remedy="ask within the runs, or give a run that goes further",
            )
        value = self._loop(spring, spring.vector)
        gradient = np.zeros(spring.frame.size)
        for place in range(spring.frame.size):
            moved, step = spring.vector.copy(), _STEP * float(spring.scale[place])
            moved[place] += step
            gradient[place] = (self._loop(spring, moved) - value) / step
        return value, gradient

    def deviation(self, knowledge: Knowledge, gradient: Floats) -> float:
        """Return the expanded uncertainty (k = 2) of the figure by what is known."""
        return COVERAGE * knowledge.deviation_of(gradient)

    def _loop(self, spring: Spring, vector: Floats) -> float:
        """Return the figure of the last of some cycles from contact, at one temperature."""
        assert self.loop is not None
        pieces: Candidate = (self.loop,)
        drive = drive_of(pieces, RunNoise(1.0, 0.0, 0.0, 0.0, 1.0, spring.noise.spacing), spring.ambient_C)
        loading, unloading = curves_at_knots(spring.frame, vector)
        if np.any(unloading > loading):
            return math.nan
        model = model_of(spring.frame, vector)
        band = BandStage.of(BandTables.of(model.curves, model.temperature.depth_mm), drive.stroke_mm)
        lag = LagStage.of(band, drive.time_s, model.viscous, half=drive.half)
        T = self.temperature_C
        given = answer(
            model, drive.time_s, band, lag, start_C=T, sensor_start_C=T, ambient_C=T, isothermal=True
        )
        # The last cycle: from the low turn before the last but one reversal to that before the way out.
        first = int(np.flatnonzero(drive.half == 2 * _CYCLES - 2)[0])
        high = int(np.flatnonzero(drive.half == 2 * _CYCLES - 1)[0])
        low = self.loop.prestress_mm - self.loop.amplitude_mm
        last = high + int(np.flatnonzero(drive.stroke_mm[high:] <= low + 1e-9)[0])
        x, F = drive.stroke_mm, given.force_kN
        if self.figure == "force":
            return float(F[high])
        if self.figure == "stiffness":
            return float((F[high] - F[first]) / (x[high] - x[first]))
        work = 0.5 * (F[1:] + F[:-1]) * np.diff(x)
        stored = float(np.sum(work[first:high]))
        return (stored + float(np.sum(work[high:last]))) / stored


class _Reader:
    """Reads a question from left to right; what it cannot read it says with its place."""

    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0

    def wrong(self, problem: str, expected: str) -> BadInput:
        rest = self._text[self._at :].strip()
        seen = f"“{rest[:20]}{'…' * (len(rest) > 20)}”" if rest else "its end"
        return BadInput(
            problem,
            file="--question",
            place=f"character {self._at + 1}: {seen}",
            remedy=f"write {expected}, as in “{FORM}”",
        )

    def word(self, known: dict[str, str], expected: str) -> str:
        self._skip()
        found = max((w for w in known if self._text.startswith(w, self._at)), key=len, default=None)
        if found is None:
            said = f"{expected}: {', '.join(FIGURES)} or a parameter ({', '.join(NAMES)})"
            raise self.wrong("there is no such figure", said)
        self._at += len(found)
        return found

    def literal(self, word: str) -> None:
        self._skip()
        if not self._text.startswith(word, self._at):
            raise self.wrong(f"“{word}” is missing", f"“{word}” here")
        self._at += len(word)

    def sign(self) -> None:
        self._skip()
        for sign in ("+-", "+/-", "±"):
            if self._text.startswith(sign, self._at):
                self._at += len(sign)
                return
        raise self.wrong("“+-” is missing", "prestress +- amplitude")

    def number(self, unit: str | None, what: str, *, least: float = 0.0, wanted: bool = True) -> float:
        self._skip()
        found = re.compile(_NUMBER).match(self._text, self._at)
        if found is None:
            raise self.wrong(f"{what} is missing", "a number")
        value = float(found[0])
        if not least <= value <= _MOST.get(unit or "", math.inf):
            raise self.wrong(f"{what} cannot be {value:g}", "a possible number")
        self._at = found.end()
        if unit is not None and wanted:
            self._skip()
            for form in (unit, f"°{unit}"):
                if self._text.startswith(form, self._at):
                    self._at += len(form)
                    return value
            raise self.wrong(f"the unit “{unit}” is missing", f"{unit} after {value:g}")
        return value

    def end(self) -> None:
        self._skip()
        if self._at != len(self._text):
            raise self.wrong("there is more than was understood", "nothing after the uncertainty")

    def _skip(self) -> None:
        while self._at < len(self._text) and self._text[self._at].isspace():
            self._at += 1
