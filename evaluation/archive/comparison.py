"""Compares two evaluations: what changed, by how much, and whether by more than its uncertainty.

Of one and the same recording both evaluations share the errors of the channels, and only the way they were
read has changed: the larger of both expanded uncertainties is what the difference is compared with. Two
recordings have errors of their own: there it is that of their difference (E_n of ISO 13528), in which the
errors that both name as the same (``shared_errors``) cancel as far as they act alike. Of single cycles that
is not known, and it is the root of the sum of squares: an upper bound.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from bufferstand.evaluation.across_runs import UncertainValue, difference
from bufferstand.evaluation.document import SCHEMA, version_text
from bufferstand.evaluation.facts import SharedContributions, SharedErrors, shared_of
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import json_object
from bufferstand.foundation.settings import read_text

ROUNDING = 1e-12
"""Figures that differ by a smaller share have not moved."""
_NOT_FIGURES = ("cycles_used",)

LONGEST_EVALUATION = 1 << 30
"""Bytes of an evaluation document: of ten thousand runs it has some 300 million."""


class _Part(BaseModel):
    """A part of an evaluation document (docs/evaluation-document.md), as far as a comparison reads it."""

    model_config = ConfigDict(strict=True, extra="ignore")


class _Figure(_Part):
    value: float | None
    expanded_uncertainty: float | None


class _Run(_Part):
    id: str
    sha256: str | None = None
    path: str = ""


class _Cycle(_Part):
    index: int
    expanded_uncertainty: dict[str, float | None] | None = None
    temperature_C: dict[str, float | None] | None = None


class _Requirement(_Part):
    id: str
    cycle: int | None
    verdict: str | None


def _known_shared(entry: dict[str, Any] | None) -> dict[str, Any] | None:
    shared_of(entry)
    return entry


_Shared = Annotated[dict[str, Any] | None, AfterValidator(_known_shared)]


class _Step(_Part):
    index: int
    summary: dict[str, _Figure | list[int] | None]
    shared_errors: _Shared = None


class _Entry(_Part):
    run: _Run
    summary: dict[str, _Figure | list[int] | None]
    cycles: list[_Cycle]
    requirements: list[_Requirement]
    verdict: str | None
    steps: list[_Step] | None = None
    shared_errors: _Shared = None
    extremes: dict[str, _Figure] | None = None


class _Software(_Part):
    version: str | None = None
    libraries: dict[str, Any] = Field(default_factory=dict)


class _Evaluation(_Part):
    runs: list[_Entry]
    software: _Software = _Software()
    settings: dict[str, Any] = Field(default_factory=dict)


@dataclass(frozen=True)
class Move:
    """A figure that is not what it was.

    Attributes
    ----------
    run, quantity : str
    cycle : int or None
        None: the mean of the run.
    old, new : float or None
        None where there was, or is, none.
    expanded_uncertainty : float or None
        Of their difference (k = 2), by which it is judged; None where either has none.
    """

    run: str
    quantity: str
    cycle: int | None
    old: float | None
    new: float | None
    expanded_uncertainty: float | None

    @property
    def difference(self) -> float | None:
        """New less old."""
        return None if self.old is None or self.new is None else self.new - self.old

    @property
    def relative(self) -> float | None:
        """Difference as a share of the old figure; None where that is 0."""
        return None if self.difference is None or not self.old else self.difference / abs(self.old)

    @property
    def share_of_uncertainty(self) -> float | None:
        """Size of the difference over its expanded uncertainty."""
        if self.difference is None or not self.expanded_uncertainty:
            return None
        return abs(self.difference) / self.expanded_uncertainty

    @property
    def beyond(self) -> bool | None:
        """Whether it moved by more than its uncertainty; None where that is not known."""
        share = self.share_of_uncertainty
        return None if share is None else share > 1.0

    def row(self) -> dict[str, Any]:
        """Return it as a row of a table."""
        return {
            "run": self.run,
            "cycle": self.cycle,
            "quantity": self.quantity,
            "old": self.old,
            "new": self.new,
            "difference": self.difference,
            "relative_difference": self.relative,
            "expanded_uncertainty": self.expanded_uncertainty,
            "beyond_uncertainty": self.beyond,
        }


@dataclass(frozen=True)
class VerdictChange:
    """A verdict that is not what it was; ``requirement`` is empty for that of the run."""

    run: str
    requirement: str
    cycle: int | None
    old: str | None
    new: str | None


@dataclass(frozen=True)
class EvaluationComparison:
    """Two evaluations, run by run.

    Attributes
    ----------
    changed : mapping of str to (old, new)
        What they were made with, where it differs: software, and settings by name.
    compared : int
        Runs that are in both.
    other_recordings : tuple of str
        Those of them whose recording is another one of the same id.
    moves : tuple of Move
        In the order of the new evaluation.
    verdicts : tuple of VerdictChange
    only_old, only_new : tuple of str
        Runs that are in one of both.
    """

    changed: Mapping[str, tuple[Any, Any]]
    compared: int
    other_recordings: tuple[str, ...]
    moves: tuple[Move, ...]
    verdicts: tuple[VerdictChange, ...]
    only_old: tuple[str, ...]
    only_new: tuple[str, ...]


def load_evaluation(path: Path) -> dict[str, Any]:
    """Read an evaluation document.

    Raises
    ------
    BadInput
        If it is none.
    """
    remedy = "name what “bufferstand evaluate --json FILE” wrote"
    text = read_text(path, LONGEST_EVALUATION)
    document = json_object(text, path, remedy=remedy, most_values=LONGEST_EVALUATION)
    check_evaluation(document, path, remedy)
    return document


def check_evaluation(document: Mapping[str, Any], path: Path, remedy: str = "") -> None:
    """Refuse what is no evaluation document.

    Parameters
    ----------
    document : mapping
        What was read.
    path : Path
        The file that it is from, and ``remedy``: what to do, both for the message.

    Raises
    ------
    BadInput
        If it lacks a part that a comparison reads, or that is of another kind.
    """
    if document.get("schema") != SCHEMA:
        raise BadInput(
            f"no evaluation of bufferstand (schema {SCHEMA})", file=path, place="schema", remedy=remedy
        )
    try:
        _Evaluation.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise BadInput(first["msg"], file=path, place=place, remedy=remedy) from None


def compare_evaluations(
    old: Mapping[str, Any], new: Mapping[str, Any], *, cycles: bool = False
) -> EvaluationComparison:
    """Compare two evaluation documents.

    Parameters
    ----------
    old, new : mapping
        Runs are the same that have the same content, else those that alone have the same id in both.
    cycles : bool
        Compare the figures of every cycle too, not only the means of the runs.
    """
    pairs, only_old = _paired(old["runs"], new["runs"])
    both = [(a, b) for a, b in pairs if a is not None]
    moves = [move for a, b in both for move in _moves(a, b, cycles=cycles)]
    return EvaluationComparison(
        changed=_made_with(old, new),
        compared=len(both),
        other_recordings=tuple(_id(b) for a, b in both if not _same_content(a, b)),
        moves=tuple(moves),
        verdicts=tuple(change for a, b in both for change in _verdicts(a, b)),
        only_old=tuple(_id(entry) for entry in only_old),
        only_new=tuple(_id(b) for a, b in pairs if a is None),
    )


Entry = Mapping[str, Any]


def _id(entry: Entry) -> str:
    return str(entry["run"]["id"])


def _same_content(a: Entry, b: Entry) -> bool:
    return a["run"].get("sha256") is not None and a["run"]["sha256"] == b["run"].get("sha256")


def _paired(
    old: Sequence[Entry], new: Sequence[Entry]
) -> tuple[list[tuple[Entry | None, Entry]], list[Entry]]:
    """Return each new run with its old one, and the old ones that are left.

    Copies (one content twice) are distinguished by their paths, then taken in order.
    """
    found: dict[int, Entry] = {}
    left = list(old)
    for key, alone in ((_content_and_path, False), (_content, False), (_id, True)):
        waiting = _grouped(left, key)
        asking = Counter(key(entry) for position, entry in enumerate(new) if position not in found)
        for position, entry in enumerate(new):
            own = waiting.get(key(entry), [])
            fits = asking[key(entry)] == len(own) == 1 if alone else bool(own)
            if position not in found and key(entry) is not None and fits:
                found[position] = own.pop(0)
        used = {id(entry) for entry in found.values()}
        left = [entry for entry in left if id(entry) not in used]
    return [(found.get(position), entry) for position, entry in enumerate(new)], left


def _content(entry: Entry) -> str | None:
    content: str | None = entry["run"].get("sha256")
    return content


def _content_and_path(entry: Entry) -> tuple[str, str | None] | None:
    content = _content(entry)
    return None if content is None else (content, entry["run"].get("path"))


def _grouped(entries: Iterable[Entry], key: Callable[[Entry], Any]) -> dict[Any, list[Entry]]:
    groups: dict[Any, list[Entry]] = {}
    for entry in entries:
        groups.setdefault(key(entry), []).append(entry)
    return groups


def _made_with(old: Entry, new: Entry) -> dict[str, tuple[Any, Any]]:
    changed = {}
    versions = version_text(old.get("software", {})), version_text(new.get("software", {}))
    if versions[0] != versions[1]:
        changed["software"] = versions
    libraries = [document.get("software", {}).get("libraries", {}) for document in (old, new)]
    settings = [document.get("settings", {}) for document in (old, new)]
    for one, other in (libraries, settings):
        for name in dict.fromkeys((*one, *other)):
            if name != "sha256" and one.get(name) != other.get(name):
                changed[name] = (one.get(name), other.get(name))
    return changed


def _moves(old: Entry, new: Entry, *, cycles: bool) -> Iterator[Move]:
    same = _same_content(old, new)
    summaries = [_summaries(entry) for entry in (old, new)]
    for part in dict.fromkeys((*summaries[0], *summaries[1])):
        before, after = (known.get(part) or {} for known in summaries)
        errors = [None if same else _shared(entry, part) for entry in (old, new)]
        for name in dict.fromkeys((*before, *after)):
            if name not in _NOT_FIGURES:
                one, other = (
                    _value(summary.get(name), own, name)
                    for summary, own in zip((before, after), errors, strict=True)
                )
                yield from _moved(f"{_id(new)}{part}", name, None, one, other, same_content=same)
    extremes = [known for entry in (old, new) if (known := entry.get("extremes")) is not None]
    if len(extremes) == 2:  # earlier versions wrote none
        for name in dict.fromkeys((*extremes[0], *extremes[1])):
            one, other = (_value(known.get(name), None, name) for known in extremes)
            yield from _moved(_id(new), f"extreme_{name}", None, one, other, same_content=same)
    used = [
        {index for summary in known.values() for index in summary.get("cycles_used") or ()}
        for known in summaries
    ]
    for index in sorted(used[0] ^ used[1]):
        yield Move(_id(new), "used", index, float(index in used[0]), float(index in used[1]), None)
    if cycles:
        yield from _cycle_moves(old, new, same_content=same)


def _summaries(entry: Entry) -> dict[str, Mapping[str, Any]]:
    """Return the summaries of a run by what is added to its id: nothing, or #1, #2 … of its steps."""
    steps = entry.get("steps") or ()
    return {f"#{step['index']}": step["summary"] for step in steps} or {"": entry["summary"] or {}}


def _shared(entry: Entry, part: str) -> SharedErrors | None:
    """Return the shared errors of a run, or of one of its steps."""
    steps = {f"#{step['index']}": step for step in entry.get("steps") or ()}
    return shared_of(steps.get(part, entry).get("shared_errors"))


def _cycle_moves(old: Entry, new: Entry, *, same_content: bool) -> Iterator[Move]:
    """Yield what moved in each cycle, also in those that only one evaluation has."""
    before, after = ({cycle["index"]: cycle for cycle in entry["cycles"]} for entry in (old, new))
    for index in sorted({*before, *after}):
        two = [known.get(index, {}) for known in (before, after)]
        figures = [_figures(cycle) for cycle in two]
        limits = [cycle.get("expanded_uncertainty") or {} for cycle in two]
        for name in dict.fromkeys((*figures[0], *figures[1])):
            one, other = (
                None if (value := own.get(name)) is None else UncertainValue(value, U.get(name))
                for own, U in zip(figures, limits, strict=True)
            )
            yield from _moved(_id(new), name, index, one, other, same_content=same_content)


def _value(figure: Mapping[str, Any] | None, errors: SharedErrors | None, name: str) -> UncertainValue | None:
    """Return a mean with its uncertainty and what of it is shared; None where there is none."""
    if figure is None or figure.get("value") is None:
        return None
    shared = SharedContributions() if errors is None else errors.of(name)
    return UncertainValue(figure["value"], figure.get("expanded_uncertainty"), shared)


def _figures(cycle: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the figures of a cycle by name; its flags count as 0 and 1."""
    temperatures = cycle.get("temperature_C") or {}
    found = {f"temperature_{name}_C": value for name, value in temperatures.items()}
    for name, value in cycle.items():
        if name != "index" and (value is None or isinstance(value, int | float)):
            found[name] = None if value is None else float(value)
    return found


def _moved(
    run: str,
    quantity: str,
    cycle: int | None,
    old: UncertainValue | None,
    new: UncertainValue | None,
    *,
    same_content: bool,
) -> Iterator[Move]:
    if old is None or new is None:
        if old is not new:
            values = [None if one is None else one.value for one in (old, new)]
            yield Move(run, quantity, cycle, values[0], values[1], None)
        return
    if abs(new.value - old.value) <= ROUNDING * max(abs(old.value), abs(new.value)):
        return
    U = difference(new, old).expanded_uncertainty
    if same_content and old.expanded_uncertainty is not None and new.expanded_uncertainty is not None:
        U = max(old.expanded_uncertainty, new.expanded_uncertainty)
    yield Move(run, quantity, cycle, old.value, new.value, U)


def _verdicts(old: Entry, new: Entry) -> Iterator[VerdictChange]:
    run = _id(new)
    if old["verdict"] != new["verdict"]:
        yield VerdictChange(run, "", None, old["verdict"], new["verdict"])
    before, after = (
        {(row["id"], row["cycle"]): row["verdict"] for row in entry["requirements"]} for entry in (old, new)
    )
    for name, cycle in dict.fromkeys((*before, *after)):
        a, b = before.get((name, cycle)), after.get((name, cycle))
        if a != b:
            yield VerdictChange(run, name, cycle, a, b)
