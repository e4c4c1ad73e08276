"""Which run is the conformity test: what the option says, else the campaign, else the first that can be one.

Of a campaign that ran a specimen through several static steps, one is the test by the standard; the others
state characteristics: warm, faster, further. Their rows are judged all the same and stay in the document, but
no statement of conformity rests on them. Without a word of the laboratory it is the first static run that
meets the conditions; where more than one could be it, that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Literal

from bufferstand.evaluation.facts import PurposeEntry, StatementEntry, Verdict
from bufferstand.foundation import BadInput, Kind
from bufferstand.foundation import Purpose as PurposeName

Standing = Literal["met", "open", "broken"]
CONFORMITY: PurposeName = "conformity"
CHARACTERISATION: PurposeName = "characterisation"
_NO_TEST = ("hold", "motion")
"""Kinds of step that are recorded as static runs and are no test by a standard."""
_REMEDY = 'say purpose = "conformity" at its step of the campaign, or --conformity RUN'
_ORDER = ("invalid", "fail", "conditional-fail", "inconclusive", "not-tested", "conditional-pass", "pass")


@dataclass(frozen=True)
class Candidate:
    """What decides of a run.

    Attributes
    ----------
    id, path : str
    kind : str
        ``static``, ``harmonic``, ``impact`` or ``proof``.
    specimen, campaign : str or None
        Their ids.
    started : str or None
        ISO 8601.
    step_kind : str or None
        Kind of the planned step; None for an imported record.
    stated : str or None
        What the campaign, or ``[test]`` of an import, says that the run is for.
    standing : str or None
        How its conditions stand; None where nothing is required of it.
    verdict : str or None
    """

    id: str
    path: str
    kind: Kind
    specimen: str | None
    campaign: str | None
    started: str | None
    step_kind: str | None
    stated: PurposeName | None
    standing: Standing | None
    verdict: Verdict | None

    def group(self) -> tuple[str, ...]:
        """Return what runs share of which one is the test: specimen, campaign, folder, kind of test."""
        of = ("by itself", self.path, self.id) if self.specimen is None else ("specimen", self.specimen)
        return (*of, self.campaign or "", str(PurePath(self.path).parent), self.kind)


@dataclass(frozen=True)
class Purpose:
    """What a run is for, and who says so; None of a run of which nothing is required."""

    purpose: PurposeName | None
    why: str

    def entry(self) -> PurposeEntry:
        """Return the keys of a run's entry in the document."""
        return {"purpose": self.purpose, "purpose_why": self.why}


@dataclass(frozen=True)
class Statement:
    """On which runs the statement of conformity of a specimen rests, for one kind of test.

    ``by`` is ``option``, ``campaign`` or ``default``; ``verdict`` the gravest of the runs; ``warnings`` say
    what else could have been meant.
    """

    specimen: str | None
    campaign: str | None
    kind: Kind
    runs: tuple[str, ...]
    characterisation: tuple[str, ...]
    by: Literal["option", "campaign", "default"]
    why: str
    verdict: Verdict | None
    warnings: tuple[str, ...] = ()

    def entry(self) -> StatementEntry:
        """Return it as the document holds it."""
        return {
            "specimen": self.specimen,
            "campaign": self.campaign,
            "kind": self.kind,
            "runs": list(self.runs),
            "characterisation": list(self.characterisation),
            "by": self.by,
            "why": self.why,
            "verdict": self.verdict,
            "warnings": list(self.warnings),
        }


@dataclass(frozen=True)
class Decided:
    """The purpose of each run, in their order, and the statements that follow.

    ``named``: ids of the runs that the user named, whether by id or by path, each once.
    """

    purposes: tuple[Purpose, ...]
    statements: tuple[Statement, ...]
    named: tuple[str, ...] = ()


def decide_purposes(candidates: Sequence[Candidate], chosen: Sequence[str] = ()) -> Decided:
    """Return what each run is for.

    Parameters
    ----------
    candidates : sequence of Candidate
        All runs that are looked at together.
    chosen : sequence of str
        Ids or paths of runs that the user says are the conformity test of their specimen.

    Returns
    -------
    Decided

    Raises
    ------
    BadInput
        If one of ``chosen`` is none of the runs, is several, or nothing is required of it.
    """
    picked = {_find(candidates, name) for name in chosen}
    groups: dict[tuple[str, ...], list[int]] = {}
    for place, candidate in enumerate(candidates):
        if candidate.standing is not None:
            groups.setdefault(candidate.group(), []).append(place)
    purposes = [Purpose(None, "nothing is required of the run")] * len(candidates)
    statements = []
    for places in groups.values():
        ordered = sorted(places, key=lambda place: (candidates[place].started or "9999", place))
        own = [candidates[place] for place in ordered]
        statement, taken = _decide(own, [place in picked for place in ordered])
        statements.append(statement)
        for place, candidate, is_test in zip(ordered, own, taken, strict=True):
            why = statement.why if is_test else _why_not(candidate, statement)
            purposes[place] = Purpose(CONFORMITY if is_test else CHARACTERISATION, why)
    named = sorted({candidates[place].id for place in picked})
    return Decided(tuple(purposes), tuple(statements), tuple(named))


def _find(candidates: Sequence[Candidate], name: str) -> int:
    found = [place for place, one in enumerate(candidates) if one.path == name]
    found = found or [place for place, one in enumerate(candidates) if one.id == name]
    file = "--conformity"
    if not found:
        near = ", ".join(one.id for one in candidates if one.standing is not None) or "none"
        raise BadInput(
            f"no run “{name}” is evaluated here", file=file, remedy=f"name one that is judged: {near}"
        )
    if len(found) > 1:
        paths = ", ".join(candidates[place].path for place in found)
        raise BadInput(f"{len(found)} runs have the id “{name}”", file=file, remedy=f"name the file: {paths}")
    if candidates[found[0]].standing is None:
        raise BadInput(
            f"nothing is required of run “{name}”, so that it can be no conformity test",
            file=file,
            remedy="name a run that the limit set requires something of",
        )
    return found[0]


def _decide(own: Sequence[Candidate], picked: Sequence[bool]) -> tuple[Statement, list[bool]]:
    """Return the statement of a group in the order of its start, and which of its runs it rests on."""
    stated = [one.stated == CONFORMITY for one in own]
    warnings: list[str] = []
    by: Literal["option", "campaign", "default"]
    if any(picked):
        by, taken, why = "option", list(picked), "named by --conformity"
        contrary = [
            one for one, is_test in zip(own, taken, strict=True) if is_test and one.stated == CHARACTERISATION
        ]
        warnings += [
            f"{one.id} is characterisation by its campaign, and the test by --conformity" for one in contrary
        ]
    elif any(stated):
        by, taken, why = "campaign", stated, "the campaign says so (purpose)"
    else:
        by = "default"
        taken, why, warnings = _by_default(own)
    tests = [one for one, is_test in zip(own, taken, strict=True) if is_test]
    if by != "default" and len(tests) > 1 and tests[0].kind == "static":
        warnings.append(
            f"{len(tests)} runs are said to be the conformity test, and all of them count: {_ids(tests)}"
        )
    verdicts = [one.verdict for one in tests if one.verdict is not None]
    first = own[0]
    statement = Statement(
        specimen=first.specimen,
        campaign=first.campaign,
        kind=first.kind,
        runs=tuple(one.id for one in tests),
        characterisation=tuple(one.id for one, is_test in zip(own, taken, strict=True) if not is_test),
        by=by,
        why=why,
        verdict=min(verdicts, key=_ORDER.index, default=None),
        warnings=tuple(warnings),
    )
    return statement, taken


def _by_default(own: Sequence[Candidate]) -> tuple[list[bool], str, list[str]]:
    """Return which run is the test where nobody says, why, and what else it could have been."""
    free = [one for one in own if one.stated is None and one.step_kind not in _NO_TEST]
    if own[0].kind != "static":
        return [one in free for one in own], f"every {own[0].kind} run counts", []
    if not free:
        return [False] * len(own), "no static run is a conformity test", []
    met = [one for one in free if one.standing == "met"]
    whole = [one for one in free if one.standing == "open"]
    if len(free) == 1:
        return [one is free[0] for one in own], "the only eligible static run", []
    warnings = []
    if met:
        test, why = met[0], "the first static run that meets the conditions"
        if len(met) > 1:
            warnings.append(_several("meet the conditions of the test", met))
    elif whole:
        test, why = (
            whole[0],
            "the first static run of which no condition is broken; none is shown to meet them all",
        )
        if len(whole) > 1:
            warnings.append(_several("have no broken condition", whole))
    else:
        test, why = free[0], "the first static run; the conditions are broken in every one"
        warnings.append(f"no static run keeps the conditions of the test: {_ids(free)}; {_REMEDY}")
    return [one is test for one in own], why, warnings


def _several(what: str, runs: Sequence[Candidate]) -> str:
    verdicts = [str(one.verdict) for one in runs]
    differ = f"; their verdicts differ: {', '.join(verdicts)}" if len(set(verdicts)) > 1 else ""
    taken = f"the first is taken{differ}; if another is meant, {_REMEDY}"
    return f"{len(runs)} static runs {what}: {_ids(runs)}; {taken}"


def _why_not(candidate: Candidate, statement: Statement) -> str:
    if candidate.stated == CHARACTERISATION and statement.by != "option":
        return "the campaign says so (purpose)"
    if not statement.runs:
        return f"a step of kind {candidate.step_kind}" if candidate.step_kind in _NO_TEST else statement.why
    return f"the conformity test is {', '.join(statement.runs)}: {statement.why}"


def _ids(runs: Sequence[Candidate]) -> str:
    return ", ".join(one.id for one in runs)
