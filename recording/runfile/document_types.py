"""The types of the facts in a metadata document and in the data of events, as docs/run-file.md states them.

Whoever reads a fact relies on its type. A document that was written by a stranger may have a text for a
number, or a table for a list; so it is checked once, when the file is opened, and named with its key.
Keys that are not listed may hold anything but for the unit in their name.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

_KINDS: Mapping[str, tuple[type, ...]] = {
    "table": (dict,),
    "list": (list,),
    "text": (str,),
    "name": (str, int, float),  # a foreign writer may have written a number for a name
    "number": (int, float),
    "flag": (bool,),
    "table or text": (dict, str),
}
_LISTED: Mapping[str, str] = {
    "table": "run software specimen step test stand campaign limits arming recorder sealed_from original "
    "stand.stand stand.limits stand.controller stand.temperature stand.temperature.sensor[] limits.stand "
    "limits.test limits.in_force limits.guards limits.guards.channels[] limits.guards.temperatures[] "
    "step.estimates[] step.estimates[].turns step.motions[] step.start_band zero zero.channel[] zero.touch "
    "edits[] original.columns original.time_from",
    "list": "step.estimates step.motions zero.channel edits original.findings limits.not_guarded "
    "stand.temperature.sensor limits.guards.channels limits.guards.temperatures",
    "text": "run.reason run.started_utc run.ended_utc run.kind_source run.simulated_by specimen.assembled "
    "step.kind step.run_kind step.plan_hash test.kind zero.how zero.found original.file original.sha256 "
    "content_sha256 limits.not_guarded[] original.findings[] zero.channel[].name zero.channel[].unit "
    "event.motion event.guard event.sensor event.stream event.unit",
    "name": "specimen.id specimen.kind specimen.category specimen.elastic_system step.name step.purpose "
    "step.proof_load test.purpose test.proof_load campaign.id run.campaign run.operator stand.stand.id "
    "stand.stand.name stand.id stand.name software.name software.version stand.stand.force_cell",
    "number": "run.step_index run.speed step.cycles step.index zero.channel[].value zero.channel[].u "
    "event.value event.limit event.sequence event.lost original.rows",
    "flag": "run.simulated step.compensate step.pause zero.taken_over event.compensated event.by_force "
    "event.not_reached",
    "table or text": "stand.identity",
}
_KIND_OF = {path: kind for kind, paths in _LISTED.items() for path in paths.split()}
_UNITS = ("_mm", "_kN", "_s", "_Hz", "_J", "_C", "_K", "_percent", "_kg", "_us", "_min", "_t", "_km_h")
_WITH_UNITS = ("run", "specimen", "step", "test", "limits", "zero", "event")
"""Tables whose keys are ours: in them, a unit at the end of a name is one."""
_NOT_CHECKED_HERE = ("streams", "datasets")
"""Each has a check of its own."""
_NEEDED: Mapping[str, tuple[str, ...]] = {
    "zero": ("how", "found", "channel"),
    "zero.channel[]": ("name", "unit", "value", "u"),
}
_HOW = ("touch", "tare")
_SHOWN_STROKE = "reached_mean_mm"
_SHOWN_FORCE = "reached_max_kN"
_NEEDED_OF_EVENT = {
    _SHOWN_STROKE: (
        "motion", "compensated", "by_force", "asked_mean_mm", "last_commanded_mean_mm", "reached_mean_mm",
    ),
    _SHOWN_FORCE: ("asked_min_kN", "asked_max_kN", "reached_min_kN", "reached_max_kN", "cycles"),
}  # fmt: skip
"""What an event holds that says what a motion reached: the report shows it as a row."""
_KEYS_OF_EVENT = {
    _SHOWN_STROKE: (
        "asked_amplitude_mm", "last_commanded_amplitude_mm", "reached_amplitude_mm", "off_mm", "off_percent",
    ),
    _SHOWN_FORCE: ("tolerance_kN", "stroke_limit_mm", "cycles_off"),
}  # fmt: skip
_DEEPEST = 32
_GREATEST = 1e18
"""Of the numbers in a document; time stamps in microseconds are the largest."""


def wrong_fact(document: Mapping[str, Any]) -> tuple[str, str] | None:
    """Return the key of the first fact of a document that is of another type, and what is wrong with it."""
    for key, value in document.items():
        if key not in _NOT_CHECKED_HERE:
            for wrong in _wrong(value, key, key, 1):
                return wrong
    zero = document.get("zero")
    if zero and zero["how"] not in _HOW:
        return "zero.how", f"“{zero['how']}” is none of {', '.join(_HOW)}"
    return None


def wrong_event(data: Any) -> str | None:
    """Return what is wrong with the data of an event; None if nothing is."""
    if not isinstance(data, dict):
        return "is no table"
    for path, what in _wrong(data, "event", "event", 0):
        return f"{path.removeprefix('event.')} {what}"
    for shown, needed in _NEEDED_OF_EVENT.items():
        if data.get(shown) is not None:
            missing = [key for key in needed if data.get(key) is None]
            missing += [key for key in _KEYS_OF_EVENT[shown] if key not in data]
            if missing:
                return f"lacks {', '.join(missing)}"
    if data.get(_SHOWN_STROKE) is not None and data["compensated"] and not data["by_force"]:
        return "lacks off_mm" if data["off_mm"] is None else None
    return None


def _wrong(value: Any, path: str, key: str, depth: int) -> Iterator[tuple[str, str]]:
    """Yield what is of another type in a value and all below it."""
    if depth > _DEEPEST:
        yield path, "is nested too deeply"
        return
    if value is None:
        return
    kind = _KIND_OF.get(path)
    flag = isinstance(value, bool)
    if kind is not None and (not isinstance(value, _KINDS[kind]) or (flag and kind != "flag")):
        yield path, f"is no {kind}"
    elif kind is None and _has_unit(path, key) and (flag or isinstance(value, str)):
        yield path, "has a unit in its name and is no number"
    if isinstance(value, dict):
        if missing := [needed for needed in _NEEDED.get(path, ()) if value and value.get(needed) is None]:
            yield path, f"lacks {', '.join(missing)}"
        for name, one in value.items():
            yield from _wrong(one, f"{path}.{name}", name, depth + 1)
    elif isinstance(value, list):
        for one in value:
            yield from _wrong(one, f"{path}[]", key, depth + 1)
    elif isinstance(value, float | int) and not (math.isfinite(value) and abs(value) <= _GREATEST):
        yield path, "is no number of this world"


def _has_unit(path: str, key: str) -> bool:
    return key.endswith(_UNITS) and path.partition(".")[0] in _WITH_UNITS
