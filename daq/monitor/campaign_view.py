"""What a campaign's folder says: title, specimen, steps with their states, notes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from bufferstand.daq.monitor.time_zone import laboratory_zone
from bufferstand.daq.operator import NOTES_NAME, read_notes
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from bufferstand.daq.campaign_folder import CampaignRecord

NOTES_SHOWN = 100
TWIN_NAME = "twin.json"
"""What the twin beside a campaign writes into its folder (:mod:`bufferstand.daq.twin`)."""
TWIN_SCHEMA = "bufferstand/twin/1"
ASKED = ("prestress_mm", "amplitude_mm", "frequency_Hz")
"""What a step asks for, that its cycles are compared with."""
_FROM_A_TERMINAL = {
    "bufferstand stop": "somebody in a terminal or at the desk",
    "Ctrl-C (SIGINT)": "Ctrl-C in its terminal",
    "key c": "a key in its terminal",
    "key s": "a key in its terminal",
    "SIGTERM": "the computer (it shut down, or ended the program)",
    "SIGHUP": "its terminal, which was closed",
}
_ASKED_BY = re.compile(r"(?P<who>[^:()]+?) \((?:now|cycle|step)\)")
_BY_A_PAGE = re.compile(
    r"monitor: (?P<who>.{1,60}? at (?:this computer|(?=\S*[.:])[0-9A-Fa-f.:]+(?:%\w+)?(?<!:)))"
    r"(?: \((?:now|cycle|step)\))?"
)
"""What :func:`~bufferstand.daq.monitor.actions.who_asks` makes, and how soon a stop was asked for."""
_WRITTEN_BY = ("operator", "note")
"""Kinds of lines that may hold what somebody wrote …"""
_STOP = re.compile(r"asked to stop |stopped ")
"""… unless they say who ends a campaign."""


@dataclass(frozen=True)
class FolderNews:
    """What has changed in a folder: None where nothing has."""

    record: CampaignRecord | None = None
    zone: dict[str, Any] | None = None
    notes: list[dict[str, Any]] | None = None
    problem: str = ""
    twin: dict[str, Any] | None = None


class FolderWatch:
    """Looks at ``campaign.json`` and the notes, and reads them again when they have changed; may block.

    Parameters
    ----------
    folder : Path
        The campaign's folder; it need not be there yet.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._seen: dict[str, tuple[int, int, int]] = {}

    def look(self) -> FolderNews:
        """Return what has changed since the last look."""
        # Takes seconds on a busy machine, for the planner's libraries: the page is served before.
        from bufferstand.daq.campaign_folder import RECORD_NAME, load_record  # noqa: PLC0415

        record, notes, problem, zone = None, None, "", None
        if self._changed(RECORD_NAME):
            try:
                record = load_record(self._folder)
                if record is not None:
                    zone = laboratory_zone(filter(None, (self._folder, self._originals(record))))
            except (BadInput, OSError) as error:
                problem = str(error)
        if self._changed(NOTES_NAME):
            try:
                kept = read_notes(self._folder)[-NOTES_SHOWN:]
            except (BadInput, OSError) as error:
                kept, problem = (), problem or str(error)
            notes = [{"utc": n.utc, "text": note_words(n.text), "step": n.step, "run": n.run} for n in kept]
        return FolderNews(record, zone, notes, problem, self._twin())

    def _twin(self) -> dict[str, Any] | None:
        """Return what the twin beside the campaign last wrote, if that is new."""
        if not self._changed(TWIN_NAME):
            return None
        try:
            content = json.loads((self._folder / TWIN_NAME).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None  # it is being written anew
        return content if isinstance(content, dict) and content.get("schema") == TWIN_SCHEMA else None

    def _originals(self, record: CampaignRecord) -> Path | None:
        """Return where the campaign's files lay when it was begun, None where that is not on record."""
        return self._folder / record.originals if record.originals else None

    def _changed(self, name: str) -> bool:
        try:
            state = (self._folder / name).stat()
        except OSError:
            return False
        stamp = (state.st_mtime_ns, state.st_size, state.st_ino)
        if self._seen.get(name) == stamp:
            return False
        self._seen[name] = stamp
        return True


_Given = ParamSpec("_Given")
_Shown = TypeVar("_Shown")


def _reading_plan(section: Callable[_Given, _Shown]) -> Callable[_Given, _Shown]:
    """Let a section of a plan that is not as bufferstand writes it end in one message."""

    @wraps(section)
    def read(*given: _Given.args, **named: _Given.kwargs) -> _Shown:
        try:
            return section(*given, **named)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            raise BadInput(
                "campaign.json: its plan is not as bufferstand writes it; put back a copy of the file"
            ) from None

    return read


@_reading_plan
def campaign_section(record: CampaignRecord, folder: Path) -> dict[str, Any]:
    """Return what stands at the head of the page."""
    plan = record.plan
    head, specimen = plan["campaign"], plan["specimen"]
    return {
        "title": head.get("title") or head.get("id") or folder.name,
        "id": head.get("id", ""),
        "folder": folder.name,
        "operator": head.get("operator", ""),
        "customer": head.get("customer", ""),
        "simulated": record.simulated,
        "specimen": {name: specimen.get(name) for name in ("id", "kind", "category", "elastic_system")},
        "status": record.status,
        "reason": page_words(record.reason),
        "stopped_by": record.stopped_by,
        "started_utc": record.started_utc,
        "updated_utc": record.updated_utc,
        "temperature_stop_C": plan["limits"]["test"].get("temperature_stop_C"),
        "temperature_resume_C": plan["limits"]["test"].get("temperature_resume_C"),
        "force_max_kN": _limit(plan, "force_max_kN"),
        "stroke_max_mm": _limit(plan, "stroke_max_mm"),
    }


@_reading_plan
def windows_section(record: CampaignRecord) -> list[dict[str, Any]]:
    """Return the force windows that a static test of this specimen is judged by, at their strokes.

    Those of the limit set that is the default of the evaluation, where it is for such a specimen.
    """
    from bufferstand.evaluation.requirements import shipped_limit_set  # noqa: PLC0415 - as above

    limits = shipped_limit_set()
    if limits.why_not_for(record.plan["specimen"]):
        return []
    numbers = [(one.id, one.stroke_mm, one.lower_kN, one.upper_kN) for one in limits.force]
    steps = [step["index"] for step in record.plan["steps"] if step["run_kind"] == "static"]
    return [
        {
            "id": name,
            "standard": limits.standard,
            "stroke_mm": stroke_mm,
            "lower_kN": lower if isinstance(lower, float) else None,
            "upper_kN": upper if isinstance(upper, float) else None,
            "steps": steps,
        }
        for name, stroke_mm, lower, upper in numbers
        if isinstance(stroke_mm, float)
    ]


def page_words(text: str) -> str:
    """Return what a campaign says of a stop in words of the page: who asked, not by which command."""
    text = _ASKED_BY.sub(r"\g<who>", _BY_A_PAGE.sub(r"\g<who>", text))
    for said, shown in _FROM_A_TERMINAL.items():
        text = text.replace(said, shown)
    return text


def note_words(text: str) -> str:
    """Return a note with who wrote it, not by which way: what was written stays as it is."""
    signed = _BY_A_PAGE.match(text)
    return text if signed is None else signed["who"] + text[signed.end() :]


def line_words(text: str) -> str:
    """Return a line that a campaign told, in words of the page: of a stop, or a note."""
    by, _, said = text.partition(": ")
    if by not in _WRITTEN_BY or _STOP.match(said):
        return page_words(text)
    return f"{by}: {note_words(said)}"


def event_line(kind: str, text: str) -> str:
    """Return an event in words of the page, with its kind once."""
    return line_words(text if text.startswith(f"{kind}: ") else f"{kind}: {text}")


def _limit(plan: dict[str, Any], name: str) -> float | None:
    bound = plan["limits"]["in_force"].get(name) or {}
    value = bound.get("value") if isinstance(bound, dict) else None
    return float(value) if value is not None else None


@_reading_plan
def steps_section(record: CampaignRecord) -> list[dict[str, Any]]:
    """Return the list of steps with their states."""
    shown = []
    for planned, state in zip(record.plan["steps"], record.steps, strict=False):
        shown.append(
            {
                "index": state.index,
                "name": state.name,
                "kind": planned["kind"],
                "status": state.status,
                "cycles": planned["cycles"],
                "cycles_done": state.cycles_done,
                "reason": page_words(state.reason),
                "runs": list(state.runs),
                "expected_s": round(planned["expected_duration_s"], 1),
                "asked": {name: planned[name] for name in ASKED},
                "peak_force_kN": planned["expected_peak_force_kN"],
                "stop_expected": bool(planned["stops"]),
            }
        )
    return shown
