"""What was asked for, what was commanded and what was reached: one row a cyclic motion.

``strokes.jsonl`` in the campaign's folder has one line a step, with what was learned by then: appended and
brought to the disk, so that ``resume`` goes on with it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from bufferstand.daq.strokes.cycle_checks import CLOSE_MM, CLOSE_PERCENT, CycleChecks
from bufferstand.foundation.files import append_line, json_lines
from bufferstand.protocols.campaign_file import StrokeTable
from bufferstand.protocols.prediction import Sine

STROKES_NAME = "strokes.jsonl"
MOST_SPANS = 12


@dataclass(frozen=True)
class StrokeRow:
    """One cyclic motion; strokes are the specimen's, commanded ones the piston's, from first contact [mm].

    Parameters
    ----------
    motion : str
        ``harmonic`` (means and amplitudes) or ``static`` (the stroke at which it turns, as the mean).
    frequency_Hz : float or None
        Of a sine.
    asked_mean_mm, asked_amplitude_mm : float, float or None
        As the step asks.
    commanded_mean_mm, commanded_amplitude_mm : float, float or None
        At its beginning.
    last_commanded_mean_mm, last_commanded_amplitude_mm : float, float or None
        At its end: other ones where it was corrected meanwhile.
    first_mean_mm, first_amplitude_mm : float, float or None
        Reached in the first full cycle.
    reached_mean_mm, reached_amplitude_mm : float, float or None
        Reached in the last one.
    by_force : bool
        A static cycle that turned at its force limit: its stroke was not asked for.
    compensated : bool
        Whether the specimen's stroke was asked for; else the piston's.
    cycles : int
        Full cycles of a sine that are over.
    cycles_off : str
        Those of them that were off by more than the campaign states, as ``1-3, 6``.
    cycles_changed : str
        Those of ``cycles_off`` in which the command went over to another one.
    cycles_not_close : str
        Those that were off by less than that, but by more than compensation is to reach.
    cycles_unseen : str
        Those whose turns are not whole on record.
    not_reached : bool
        Whether what was asked of the specimen was missed, in the end, by more than the campaign states.
    """

    motion: Literal["harmonic", "static"]
    frequency_Hz: float | None
    asked_mean_mm: float
    asked_amplitude_mm: float | None
    commanded_mean_mm: float
    commanded_amplitude_mm: float | None
    last_commanded_mean_mm: float
    last_commanded_amplitude_mm: float | None
    first_mean_mm: float
    first_amplitude_mm: float | None
    reached_mean_mm: float
    reached_amplitude_mm: float | None
    by_force: bool = False
    compensated: bool = True
    cycles: int = 0
    cycles_off: str = ""
    cycles_changed: str = ""
    cycles_not_close: str = ""
    cycles_unseen: str = ""
    not_reached: bool = False

    @property
    def off_mm(self) -> float:
        """Reached less asked mean, or turning stroke [mm]."""
        return self.reached_mean_mm - self.asked_mean_mm

    @property
    def off_percent(self) -> float | None:
        """Reached less asked amplitude, in per cent of what is asked; None for a static motion."""
        if self.asked_amplitude_mm is None or self.reached_amplitude_mm is None:
            return None
        return 100.0 * (self.reached_amplitude_mm / self.asked_amplitude_mm - 1.0)

    @property
    def is_not_close(self) -> bool:
        """Return whether a sine is off by more than compensation is to reach."""
        percent = self.off_percent
        return percent is not None and (abs(percent) > CLOSE_PERCENT or abs(self.off_mm) > CLOSE_MM)

    @property
    def has_note(self) -> bool:
        """Return whether a step that is right at its end is worth a word all the same."""
        cycles = self.cycles_off or self.cycles_not_close or self.cycles_unseen
        return self.is_not_close or bool(cycles)

    def is_off(self, table: StrokeTable) -> bool:
        """Return whether it is off by more than the campaign states."""
        if self.by_force:
            return False
        percent = self.off_percent
        return abs(self.off_mm) > table.warn_mm or (percent is not None and abs(percent) > table.warn_percent)

    def sentence(self) -> str:
        """Return it as a person says it."""

        def pair(mean: float, amplitude: float | None) -> str:
            return f"{mean:.2f} mm" if amplitude is None else f"{mean:.2f} ± {amplitude:.2f} mm"

        text = (
            f"asked {pair(self.asked_mean_mm, self.asked_amplitude_mm)}, "
            f"commanded {pair(self.last_commanded_mean_mm, self.last_commanded_amplitude_mm)}, "
            f"reached {pair(self.reached_mean_mm, self.reached_amplitude_mm)}"
        )
        if self.by_force:
            return f"{text} (turned at its force limit)"
        percent = self.off_percent
        amplitude = "" if percent is None else f", amplitude {percent:+.2f} %"
        return f"{text}: {self.off_mm:+.2f} mm{amplitude}{self._which()}"

    def _which(self) -> str:
        said = ""
        if self.cycles_off:
            said += f"; off in cycles {self.cycles_off} of {self.cycles}"
            said += f" ({self.cycles_changed} being corrected)" if self.cycles_changed else ""
        if self.cycles_not_close:
            limits = f"{CLOSE_PERCENT:g} % or {CLOSE_MM:g} mm"
            said += f"; by more than {limits} in {self.cycles_not_close} of {self.cycles}"
        if self.cycles_unseen:
            said += f"; not on record: {self.cycles_unseen} of {self.cycles}"
        return said

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data, with what it is off."""
        return {**asdict(self), "off_mm": self.off_mm, "off_percent": self.off_percent}


def spans(numbers: Sequence[int]) -> str:
    """Return rising numbers as a person writes them: ``1-3, 6``; of many spans the first ones."""
    found: list[list[int]] = []
    for number in numbers:
        if found and number == found[-1][1] + 1:
            found[-1][1] = number
        else:
            found.append([number, number])
    words = [f"{first}" if first == last else f"{first}-{last}" for first, last in found]
    return ", ".join(words[:MOST_SPANS] + ["…"] * (len(words) > MOST_SPANS))


def harmonic_row(
    frequency_Hz: float, commanded: tuple[Sine, Sine], judged: CycleChecks, *, compensated: bool
) -> StrokeRow:
    """Return the row of a sine.

    Parameters
    ----------
    frequency_Hz : float
    commanded : (Sine, Sine)
        The first and the last.
    judged : CyclesJudged
        What its cycles reached, of what was asked; one at least.
    compensated : bool
        Whether the specimen's stroke was asked for.
    """
    asked, (first, last) = judged.asked, commanded
    assert judged.first is not None
    assert judged.last is not None
    return StrokeRow(
        "harmonic",
        frequency_Hz,
        *(asked.mean_mm, asked.amplitude_mm),
        *(first.mean_mm, first.amplitude_mm),
        *(last.mean_mm, last.amplitude_mm),
        *(judged.first.mean_mm, judged.first.amplitude_mm),
        *(judged.last.mean_mm, judged.last.amplitude_mm),
        compensated=compensated,
        cycles=judged.done,
        cycles_off=spans(judged.off) if compensated else "",
        cycles_changed=spans(judged.changed) if compensated else "",
        cycles_not_close=spans(judged.not_close) if compensated else "",
        cycles_unseen=spans(judged.unseen),
    )


def static_row(
    asked_mm: float, commanded_mm: float, reached_mm: float, by_force: bool, *, compensated: bool
) -> StrokeRow:
    """Return the row of static cycles."""
    return StrokeRow(
        "static",
        None,
        *(asked_mm, None),
        *(commanded_mm, None),
        *(commanded_mm, None),
        *(reached_mm, None),
        *(reached_mm, None),
        by_force=by_force,
        compensated=compensated,
    )


def add_strokes(
    folder: Path, step: int, name: str, rows: Sequence[StrokeRow], learned: Mapping[str, Any]
) -> None:
    """Append a step to the folder's ``strokes.jsonl`` and bring it to the disk.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    content = {"step": step, "name": name, "motions": [row.as_dict() for row in rows], "learned": learned}
    append_line(folder / STROKES_NAME, json.dumps(content, ensure_ascii=False))


def read_strokes(folder: Path) -> list[dict[str, Any]]:
    """Return the lines of a campaign's folder; one that is cut off is left out.

    Raises
    ------
    BadInput
        If the file cannot be read.
    """
    return [content for _, content in json_lines(folder / STROKES_NAME) if isinstance(content, dict)]
