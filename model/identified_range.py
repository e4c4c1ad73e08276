"""Where a model was identified, what stands beyond, and how figures from there are told from the others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves

Floats = NDArray[np.float64]
Ends = tuple[float, float]

Continuation = Literal["own-shape", "catalogue"]
"""What the curves beyond the largest recorded stroke rest on."""
StopSource = Literal["assumed", "given"]
"""Where the stiffness of the stop comes from: the default, or the user."""


@dataclass(frozen=True)
class IdentifiedRange:
    """The runs that a model was identified from, and what the curves beyond them rest on.

    The temperatures belong to :class:`bufferstand.model.spring.TemperatureLaw` (``valid_C``).

    Parameters
    ----------
    stroke_mm : tuple of float
        Least and largest stroke at which force was measured [mm].
    speed_mm_per_s : tuple of float
        Mean speed of the slowest half stroke, and largest speed [mm/s].
    frequency_Hz : tuple of float
        One over twice the time of the slowest and of the fastest half stroke [Hz]. Stated, not watched: a
        stroke history has a speed at every instant, and in general no frequency.
    continuation : str, optional
        What the curves from ``stroke_mm[1]`` to their end rest on; None if they end with the runs.
    loading_at_end_kN : tuple of float, optional
        Between which forces F_l at the end of the curves lies [kN].
    stop : str
        Where the stiffness of the stop beyond the curves comes from.

    Raises
    ------
    BadInput
        If a lower end lies above its upper one, or a continuation has no bounds.
    """

    stroke_mm: Ends
    speed_mm_per_s: Ends
    frequency_Hz: Ends
    continuation: Continuation | None = None
    loading_at_end_kN: Ends | None = None
    stop: StopSource = "assumed"

    def __post_init__(self) -> None:
        for name in ("stroke_mm", "speed_mm_per_s", "frequency_Hz", "loading_at_end_kN"):
            ends = getattr(self, name)
            if ends is not None and not ends[0] <= ends[1]:
                raise BadInput("the first figure must not exceed the second", place=f"identified.{name}")
        if (self.continuation is None) != (self.loading_at_end_kN is None):
            raise BadInput(
                "a continuation and its bounds belong together",
                place="identified.continuation",
                remedy="give continuation and loading_at_end_kN, or neither",
            )

    def check(self, curves: Curves) -> None:
        """Refuse curves that end before the stroke at which force was measured.

        Raises
        ------
        BadInput
            If they do.
        """
        if self.stroke_mm[1] > curves.end_mm:
            raise BadInput(
                f"the curves end at {curves.end_mm:.4g} mm, before the identified {self.stroke_mm[1]:g} mm",
                place="identified.stroke_mm",
                remedy="give the stroke that the runs reached",
            )

    def statements(self, curves: Curves) -> tuple[str, ...]:
        """Return in words what was identified, and what stands beyond."""
        speed, frequency = self.speed_mm_per_s, self.frequency_Hz
        said = [
            (
                f"identified at strokes up to {self.stroke_mm[1]:.1f} mm, speeds of {speed[0]:g} … "
                f"{speed[1]:g} mm/s, half strokes as of {frequency[0]:g} … {frequency[1]:g} Hz"
            )
        ]
        if self.continuation is not None and self.loading_at_end_kN is not None:
            low, high = self.loading_at_end_kN
            by = "their own shape" if self.continuation == "own-shape" else "the maker's catalogue"
            said.append(
                f"from {self.stroke_mm[1]:.1f} to {curves.end_mm:.4g} mm the curves are continued by {by}, "
                f"not measured: the loading curve ends at {curves.loading_kN[-1]:.4g} kN, which may be "
                f"{low:.4g} … {high:.4g} kN"
            )
        said.append(
            f"beyond {curves.end_mm:.4g} mm stands a stop of {curves.stop_stiffness_kN_per_mm:g} kN/mm "
            + ("(assumed, not measured)" if self.stop == "assumed" else "(given by the user)")
        )
        return tuple(said)

    def warnings(self, curves: Curves, time_s: Floats, stroke_mm: Floats) -> tuple[str, ...]:
        """Return a sentence for everything about a stroke history that leaves what was identified.

        Only the upper ends are watched: every stroke begins at rest and at contact.

        Parameters
        ----------
        curves : Curves
            Of the model.
        time_s, stroke_mm : array, shape (n,)
            The history.
        """
        top, known, end = float(np.max(stroke_mm)), self.stroke_mm[1], curves.end_mm
        found = []
        if top > known and known < end:
            found.append(
                f"strokes up to {top:.1f} mm leave the {known:.1f} mm up to which the model was identified: "
                "the curves are continued there, not measured"
            )
        if top > end:
            source = "an assumed one" if self.stop == "assumed" else "as given by the user"
            found.append(
                f"strokes up to {top:.1f} mm go beyond the curves' end at {end:.4g} mm into the stop of "
                f"{curves.stop_stiffness_kN_per_mm:g} kN/mm, {source}"
            )
        dt, pressed = np.diff(time_s), np.clip(stroke_mm, 0.0, None)
        speeds = np.abs(np.diff(pressed))[dt > 0.0] / dt[dt > 0.0]
        fastest = float(np.max(speeds, initial=0.0))
        if fastest > self.speed_mm_per_s[1]:
            found.append(
                f"speeds up to {fastest:.3g} mm/s leave the {self.speed_mm_per_s[1]:g} mm/s up to which the "
                "model was identified"
            )
        return tuple(found)
