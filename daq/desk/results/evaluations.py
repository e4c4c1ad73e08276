"""What ``bufferstand evaluate`` says of runs, as the page of results shows it."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import orjson

from bufferstand.daq.desk.chosen import Chosen
from bufferstand.daq.desk.commands import Commands
from bufferstand.foundation import BadInput
from bufferstand.recording.finding import facts_of

PATIENCE_S = 900.0
"""Longest wait for an evaluation: a campaign of hours takes minutes [s]."""
BESIDE = ("prestress_mm", "amplitude_mm", "frequency_Hz")
"""What a run was made with stands before what came of it."""
EXTREMES = ("force_max_kN", "stroke_max_mm", "temperature_max_C")
OF_REQUIREMENT = (
    "standard", "clause", "id", "cycle", "condition", "requirement", "measured", "expanded_uncertainty",
    "lower_limit", "upper_limit", "unit", "conformance_probability", "verdict", "why",
)  # fmt: skip
OF_TREND = (
    "quantity", "prestress_mm", "amplitude_mm", "runs", "frequency_Hz", "values", "expanded_uncertainty",
    "slope_per_Hz", "slope_expanded_uncertainty_per_Hz", "intercept", "warnings",
)  # fmt: skip


@dataclass(frozen=True)
class OtherSettings:
    """With what else runs are evaluated: options of ``evaluate``, empty ones as they are by default.

    Parameters
    ----------
    limits : str
        Name or file of a limit set.
    decision_rule : str
        ``simple`` or ``guard-band``.
    moving_mass_kg : float or None
    force_cell : str
        ``moving-side`` or ``fixed-side``.
    """

    limits: str = ""
    decision_rule: str = ""
    moving_mass_kg: float | None = None
    force_cell: str = ""

    @property
    def words(self) -> tuple[str, ...]:
        """Return them as words of a command line."""
        words: list[str] = []
        for option, value in (
            ("--limits", self.limits),
            ("--decision-rule", self.decision_rule),
            ("--moving-mass", "" if self.moving_mass_kg is None else f"{self.moving_mass_kg:g}"),
            ("--force-cell", self.force_cell),
        ):
            if value:
                words += [option, value]
        return tuple(words)


def settings_of(content: Mapping[str, Any]) -> OtherSettings:
    """Return the settings that a page has sent.

    Raises
    ------
    BadInput
        If one of them is none.
    """
    rule, cell = str(content.get("decision_rule") or ""), str(content.get("force_cell") or "")
    if rule not in ("", "simple", "guard-band"):
        raise BadInput("the decision rule is “simple” or “guard-band”")
    if cell not in ("", "moving-side", "fixed-side"):
        raise BadInput("the load cell is on the “moving-side” or on the “fixed-side”")
    mass = content.get("moving_mass_kg")
    if mass in (None, ""):
        mass_kg = None
    else:
        try:
            mass_kg = float(str(mass).replace(",", "."))
        except ValueError:
            mass_kg = float("nan")
        if not 0.0 <= mass_kg <= 1e5:
            raise BadInput("the moving mass is a number of kilograms, from 0 to 100000")
    limits = str(content.get("limits") or "").strip()[:400]
    return OtherSettings(f"./{limits}" if limits.startswith("-") else limits, rule, mass_kg, cell)


async def evaluated(commands: Commands, chosen: Chosen, settings: OtherSettings) -> dict[str, Any]:
    """Return the evaluation of runs in short.

    Raises
    ------
    BadInput
        If nothing of it could be evaluated; with the command's own message.
    """
    facts = await asyncio.to_thread(_facts, chosen, commands.folder)
    document, command = await _document(commands, chosen, settings)
    return {**_shown(document, facts, commands.folder), "command": command}


async def evaluated_beside(commands: Commands, chosen: Chosen, settings: OtherSettings) -> dict[str, Any]:
    """Return the evaluation with other settings, and what has moved against the one by default.

    Raises
    ------
    BadInput
        As :func:`evaluated`.
    """
    facts = await asyncio.to_thread(_facts, chosen, commands.folder)
    old, _ = await _document(commands, chosen, OtherSettings())
    new, command = await _document(commands, chosen, settings)
    with tempfile.TemporaryDirectory(prefix="bufferstand-desk-") as folder:
        files = [Path(folder) / name for name in ("old.json", "new.json")]
        for file, document in zip(files, (old, new), strict=True):
            file.write_bytes(orjson.dumps(document))
        answer = await commands.ask("compare", *map(str, files), "--json", "-")
    moved = answer.json()
    if moved is None:
        raise BadInput(answer.problem or "the two evaluations cannot be compared")
    return {
        **_shown(new, facts, commands.folder),
        "moves": [
            {**one, "words": in_words(one["quantity"])}
            for one in sorted(moved["moves"], key=lambda one: not one["beyond_uncertainty"])
            if one["cycle"] is None
        ],
        "changed": moved["changed"],
        "verdicts": _verdicts(old, new),
        "command": command,
        "compared_by": commands.shown("compare", "old.json", "new.json"),
    }


async def _document(
    commands: Commands, chosen: Chosen, settings: OtherSettings
) -> tuple[dict[str, Any], str]:
    words = ("evaluate", *chosen.words, *settings.words)
    answer = await commands.ask(*words, "--json", "-", patience_s=PATIENCE_S)
    document = answer.json()
    if not isinstance(document, dict):
        raise BadInput(answer.problem or f"the evaluation ended with status {answer.status}")
    return document, commands.shown(*words)


def _facts(chosen: Chosen, root: Path) -> dict[str, dict[str, Any]]:
    """Return what is on record of each run, by its resolved path."""
    found = {}
    for path in chosen.runs():
        facts = facts_of(path)
        found[str(path.resolve())] = {
            "path": path.resolve().relative_to(root).as_posix(),
            "step": facts.step,
            "status": facts.status,
            "started_utc": facts.started_utc,
            "campaign": facts.campaign,
            "simulated": facts.simulated,
        }
    return found


def columns() -> list[dict[str, Any]]:
    """Return the quantities that the table of runs has a column of, in the catalogue's order."""
    from bufferstand.evaluation.catalogue import QUANTITIES  # noqa: PLC0415 - takes a moment to load

    shown = []
    for entry in QUANTITIES:
        own = entry.shown.monitor or entry.shown.archive
        if own is None and entry.name not in BESIDE:
            continue
        heading = own.heading if own is not None else entry.label.lower()
        shown.append(
            {
                "name": entry.name,
                "heading": heading.split("\n")[0].removesuffix(f" {entry.unit}"),
                "unit": "" if entry.unit == "1" else entry.unit,
                "decimals": own.decimals if own is not None else 3 if entry.name == "frequency_Hz" else 1,
            }
        )
    return sorted(shown, key=lambda one: one["name"] not in BESIDE)


def in_words(quantity: str) -> str:
    """Return a figure's name of ``compare`` as one reads it, with its unit.

    Parameters
    ----------
    quantity : str
        Such as ``damping``, or ``extreme_force_max_kN`` for that of the whole record.
    """
    from bufferstand.evaluation.catalogue import QUANTITIES  # noqa: PLC0415 - takes a moment to load

    whole = quantity.startswith("extreme_")
    name = quantity.removeprefix("extreme_")
    entry = next((one for one in QUANTITIES if one.name == name), None)
    if entry is None:
        said = name.replace("_", " ")
    else:
        said = entry.label[:1].lower() + entry.label[1:] + ("" if entry.unit == "1" else f" in {entry.unit}")
    return f"{said}, of the whole record" if whole else said


def _shown(document: Mapping[str, Any], facts: Mapping[str, Mapping[str, Any]], root: Path) -> dict[str, Any]:
    return {
        "columns": columns(),
        "runs": [_run(entry, facts, root) for entry in document["runs"]],
        "trends": [{name: trend.get(name) for name in OF_TREND} for trend in document["trends"]],
        "failures": document["failures"],
        "warnings": document["warnings"],
        "limit_set": sorted({_limit_set(entry) for entry in document["runs"]} - {""}),
    }


def _limit_set(entry: Mapping[str, Any]) -> str:
    return str((entry.get("limit_set") or {}).get("id") or "")


def _run(entry: Mapping[str, Any], facts: Mapping[str, Mapping[str, Any]], root: Path) -> dict[str, Any]:
    run, summary, extremes = entry["run"], entry["summary"] or {}, entry["extremes"]
    known = facts.get(str((root / run["path"]).resolve()), {})
    used = summary.get("cycles_used") or []
    cycles = [one for one in entry["cycles"] if one["complete"]]
    shown = [one for one in cycles if one["index"] in used] or cycles
    wanted = [one["name"] for one in columns()]
    return {
        "id": run["id"],
        "path": run["path"],
        "kind": run["kind"],
        "specimen": run["specimen"].get("id"),
        "simulated": run.get("simulated"),
        **known,
        "values": {name: _pair(summary.get(name)) for name in wanted},
        "extremes": {name: _pair(extremes.get(name)) for name in EXTREMES},
        "loop": [shown[-1]["start_s"], shown[-1]["end_s"], shown[-1]["index"]] if shown else None,
        "verdict": entry["verdict"],
        "requirements": [{name: one.get(name) for name in OF_REQUIREMENT} for one in entry["requirements"]],
        "warnings": entry["warnings"],
    }


def _pair(figure: Mapping[str, Any] | None) -> list[float | None]:
    """Return a figure and its expanded uncertainty."""
    return [None, None] if figure is None else [figure.get("value"), figure.get("expanded_uncertainty")]


def _verdicts(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the requirements whose verdict is another one with the new settings."""
    before = {
        (entry["run"]["id"], one["id"], one["cycle"]): one["verdict"]
        for entry in old["runs"]
        for one in entry["requirements"]
    }
    return [
        {
            "run": entry["run"]["id"],
            "id": one["id"],
            "cycle": one["cycle"],
            "old": before.get((entry["run"]["id"], one["id"], one["cycle"])),
            "new": one["verdict"],
            "why": one["why"],
        }
        for entry in new["runs"]
        for one in entry["requirements"]
        if before.get((entry["run"]["id"], one["id"], one["cycle"])) != one["verdict"]
    ]
