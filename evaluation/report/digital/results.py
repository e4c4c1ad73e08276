"""What was measured, in groups of runs that were made in one way (``dcc:measurementResults``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts import Extreme
from bufferstand.evaluation.report.digital.elements import add, add_software, add_text
from bufferstand.evaluation.report.digital.equipment import add_equipment, channels_of
from bufferstand.evaluation.report.digital.quantities import add_quantity
from bufferstand.evaluation.report.digital.statements import add_conformity, norm_of
from bufferstand.evaluation.report.sections import name_of, reference_text, rule_section
from bufferstand.evaluation.report.source import ReportRun, ReportSource, runs_text
from bufferstand.foundation.files import content_hash

_EXTREMES = (
    ("force_min_kN", "Least force of all samples", "kN"),
    ("force_max_kN", "Greatest force of all samples", "kN"),
    ("stroke_max_mm", "Greatest stroke of all samples", "mm"),
    ("speed_max_mm_per_s", "Greatest speed of all samples", "mm/s"),
)
_TEMPERATURES = (
    ("temperature_min_C", "Least temperature of the specimen", "basic_temperatureMin", min),
    ("temperature_max_C", "Greatest temperature of the specimen", "basic_temperatureMax", max),
)
_UNCERTAINTY = (
    "Expanded uncertainty U = k u with coverage factor k = 2 (about 95 % coverage), by Monte Carlo from the "
    "error limits of the channels, the scatter over cycles, and what lies between two samples. Where a "
    "channel states no accuracy, no uncertainty is given."
)
_NO_METHOD = "The laboratory has not named its method."


def add_results(parent: ET.Element, source: ReportSource) -> None:
    """Add the results of all runs; those that share method and equipment stand in one measurement result."""
    groups: dict[str, list[ReportRun]] = {}
    for run in source.runs:
        groups.setdefault(_way(run), []).append(run)
    results = add(parent, "measurementResults")
    for runs in groups.values():
        _add_group(results, source, runs)


def _way(run: ReportRun) -> str:
    """Return a hash of how a run was made and what it is for."""
    limits: Mapping[str, Any] = run.evaluated.get("limit_set") or {}
    return content_hash(
        [
            [run.fact("software"), limits.get("sha256"), bool(run.stated), run.kind, run.simulated],
            [[device, dict(channel)] for device, channel in channels_of(run)],
        ]
    )


def _add_group(parent: ET.Element, source: ReportSource, runs: Sequence[ReportRun]) -> None:
    first = runs[0]
    purpose = "conformity test" if any(run.stated for run in runs) else "characteristics"
    group = add(parent, "measurementResult")
    add_text(group, "name", f"{first.kind} test, {purpose}: {runs_text(run.number for run in runs)}")
    _add_methods(group, source, runs)
    if first.fact("software", "name"):
        used, version = first.fact("software", "name"), first.fact("software", "version")
        add_software(add(group, "usedSoftware"), used, version, "Recorded the runs.")
    add_equipment(group, first)
    _add_temperature(group, runs)
    results = add(group, "results")
    for run in runs:
        for part in run.parts:
            _add_characteristics(results, part)
        if run.stated:
            _add_requirements(results, run, source)


def _add_methods(parent: ET.Element, source: ReportSource, runs: Sequence[ReportRun]) -> None:
    methods = add(parent, "usedMethods")
    _add_method(methods, "Test method", (source.fields.method or _NO_METHOD,))
    _add_method(methods, "Expanded uncertainty", (_UNCERTAINTY,), kind="basic_uncertainty")
    requirements = [requirement for run in runs for requirement in run.stated]
    for norm in dict.fromkeys(norm_of(one) for one in requirements):
        of = [one for one in requirements if norm_of(one) == norm]
        limits: Mapping[str, Any] = runs[0].evaluated.get("limit_set") or {}
        method = _add_method(
            methods,
            f"Requirements of {of[0]['standard']}",
            (f"Limit set {limits.get('id')}, SHA-256 {limits.get('sha256')}",),
        )
        add(method, "norm", norm)
        for reference in dict.fromkeys(reference_text(one) for one in of):
            add(method, "reference", reference)
    if requirements:
        (rule,) = rule_section(source).blocks
        _add_method(methods, "Decision rule", (getattr(rule, "items", ("",))[0],))


def _add_method(parent: ET.Element, name: str, texts: Sequence[str], *, kind: str = "") -> ET.Element:
    method = add(parent, "usedMethod", kind=kind)
    add_text(method, "name", name)
    add_text(method, "description", *texts)
    return method


def _add_characteristics(parent: ET.Element, run: ReportRun) -> None:
    """Add the means over the cycles used, and of a whole run the extremes of all its samples."""
    cycles = ", ".join(map(str, run.cycles_used))
    described = [f"Means over the cycles {cycles}." if cycles else "No cycle could be used."]
    if run.ended_early:
        described.append(f"The run ended early: {run.reason}.")
    held = _start(parent, run, "characteristics", described)
    missing: Mapping[str, Any] = run.evaluated.get("missing") or {}
    values = add(held, "list")
    add_text(values, "name", f"Run {run.label}")
    if run.started is not None:
        add(values, "dateTime", run.started.isoformat())
    for entry in QUANTITIES:
        if run.kind in entry.kinds and (entry.name in run.summary or entry.name in missing):
            given = run.summary.get(entry.name)
            found: Mapping[str, Any] = given if isinstance(given, Mapping) else {"value": given}
            add_quantity(
                values,
                entry.label,
                found.get("value"),
                entry.unit,
                expanded=found.get("expanded_uncertainty"),
                why=str(missing.get(entry.name) or "no cycle could be used"),
            )
    if run.part is None:
        for name, words, unit in _EXTREMES:
            _add_extreme(values, run.extreme(name), words, unit)
    if len(values) <= 1 + (run.started is not None):
        add_quantity(values, "Results", None, "", why=run.problem or "the evaluation has none of this run")
    if run.extreme("temperature_max_C") is not None:
        _add_temperature(values, [run])


def _add_extreme(parent: ET.Element, extreme: Extreme | None, words: str, unit: str, kind: str = "") -> None:
    if extreme is not None and extreme.value is not None:
        doubted = f", in doubt: {extreme.doubt}" if extreme.doubt else ""
        add_quantity(
            parent,
            words + doubted,
            extreme.value,
            unit,
            expanded=extreme.expanded_uncertainty,
            kind=kind,
        )


def _add_temperature(parent: ET.Element, runs: Sequence[ReportRun]) -> None:
    """Add the specimen's temperature in some runs: force and damping of rubber change with it."""
    condition = add(add(parent, "influenceConditions"), "influenceCondition", kind="basic_temperature")
    add_text(condition, "name", f"Temperature of the specimen in {runs_text(run.number for run in runs)}")
    data = add(condition, "data")
    for name, words, kind, pick in _TEMPERATURES:
        found = [one for run in runs if (one := run.extreme(name)) is not None and one.value is not None]
        if found:
            _add_extreme(data, pick(found, key=lambda one: float(one.value or 0.0)), words, "°C", kind)
        else:
            add_quantity(data, words, None, "°C", why="the runs have no reading of it", kind=kind)


def _add_requirements(parent: ET.Element, run: ReportRun, source: ReportSource) -> None:
    """Add what was required of a run, each with what was measured of it and the statement of conformity."""
    held = _start(parent, run, "requirements and conditions", ())
    judged = add(held, "list")
    add_text(judged, "name", f"Run {run.label}: as required")
    for requirement in run.stated:
        cycle = requirement.get("cycle")
        quantity = add_quantity(
            judged,
            name_of(requirement) + ("" if cycle is None else f", cycle {cycle}"),
            requirement.get("measured"),
            str(requirement.get("unit") or ""),
            expanded=requirement.get("expanded_uncertainty"),
            why=str(requirement.get("why") or "nothing was measured of it"),
            kind="basic_measuredValue",
        )
        add_conformity(quantity, requirement, source)


def _start(parent: ET.Element, run: ReportRun, what: str, described: Sequence[str]) -> ET.Element:
    """Add a result with its name, and return its data."""
    result = add(parent, "result")
    add_text(result, "name", f"Run {run.label} ({run.id}): {what}")
    if described:
        add_text(result, "description", *described)
    return add(result, "data")
