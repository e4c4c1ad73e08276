"""The effect of edits of a campaign's files: on steps that have run, on those to come, and on limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from bufferstand.cli.campaign.preparation import PreparedCampaign
from bufferstand.daq.campaign_folder import CampaignRecord, FileEdit, Inputs, begin_record, same_steps
from bufferstand.daq.guards import UNGUARDED_AT_SPEED, what_is_unguarded
from bufferstand.daq.guards.kinds import DEFAULT_TILT_MM, SPEED_FACTOR
from bufferstand.drivers.register_maps import SHIPPED
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation.channels import recorded_thermometers
from bufferstand.foundation.settings import NotToml, toml_content, toml_document
from bufferstand.protocols.campaign_file import GuardTable, TripAction, ZeroTable
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.steps import PlannedStep

Direction = Literal["stricter", "LOOSER", "another"]
BOUNDS = ("force_max_kN", "stroke_max_mm", "frequency_max_Hz", "speed_max_mm_per_s", "force_trip_kN",
          "stroke_trip_mm")  # fmt: skip
TEST = ("temperature_stop_C", "temperature_resume_C", "temperature_stale_s", "following_error_max_mm",
        "following_error_grace_s")  # fmt: skip
"""Of ``[limits]`` beside the bounds in force; smaller is stricter, as in ``[guards]`` and ``[zero]``."""
OWN = ("temperature_stop_C", "temperature_resume_C")
"""Limits that a step may have of its own."""
SAID_OTHERWISE = (
    "this campaign has no temperature stop", "one thermometer on the specimen",
    "a specimen that heats too fast is only noted", "a frozen channel is only noted",
    "the specimen's own stroke is not stated", "no spring model and no [catalogue]", UNGUARDED_AT_SPEED,
)  # fmt: skip
"""What is not guarded and stands among the limits by its own figures: sensors, actions, strokes; and what a
rehearsal faster than the wall does not see, which is no edit."""
SHOWN = ("kind", "prestress_mm", "amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s", "cycles",
         "compensate")  # fmt: skip
"""Of a step, where no more is known of what was asked for."""


@dataclass(frozen=True)
class LimitEdit:
    """A limit, a threshold of a guard or what its trip leads to, before and now."""

    name: str
    before: float | str | bool | None
    now: float | str | bool | None
    direction: Direction

    def text(self) -> str:
        """Return e.g. ``temperature_stop_C 40 → 38 (stricter)``."""
        return f"{self.name} {_shown(self.before)} → {_shown(self.now)} ({self.direction})"


def means_nothing(edits: Sequence[FileEdit]) -> bool:
    """Return whether only comments, layout or the way to write a number were edited."""
    for edit in edits:
        if edit.before is None or edit.now is None:
            return False
        try:
            if toml_content(edit.before) != toml_content(edit.now):
                return False
        except NotToml:
            return False
    return True


def edits_shown(
    edits: Sequence[FileEdit], record: CampaignRecord, prepared: PreparedCampaign
) -> tuple[FileEdit, ...]:
    """Return edits as they are shown: a file that takes the place of another is compared with that one.

    A register profile may take the place of a shipped one, of which the campaign has no copy, or give its
    own up for that.

    Parameters
    ----------
    edits : sequence of FileEdit
        By the files' places.
    record : CampaignRecord
        With the files as they were taken.
    prepared : Prepared
        Of the edited files.
    """
    gone, new = ([edit for edit in edits if there(edit) is None] for there in (_now, _before))
    if len(gone) > 1 or len(new) > 1 or not (gone or new):
        return tuple(edits)
    was = str(_stand_document(record).get("controller", {}).get("profile"))
    is_now = prepared.stand_file.controller.profile
    old = (
        (gone[0].place, gone[0].before) if gone else (f"profile “{was}”", _shipped(was, new[0].place, is_now))
    )
    now = (new[0].place, new[0].now) if new else (f"profile “{is_now}”", _shipped(is_now, gone[0].place, was))
    if old[1] is None or now[1] is None:
        return tuple(edits)
    others = [edit for edit in edits if edit not in gone and edit not in new]
    return (*others, FileEdit(f"{now[0]} in place of {old[0]}", old[1], now[1]))


def _now(edit: FileEdit) -> str | None:
    return edit.now


def _before(edit: FileEdit) -> str | None:
    return edit.before


def _shipped(name: str, other_place: str, other_name: str) -> str | None:
    """Return the text of a shipped profile whose place another file takes; None where it is none."""
    path = SHIPPED / f"{name}.toml"
    same = Path(other_place).name == Path(other_name).name
    return path.read_text("utf-8") if same and path.is_file() else None


def steps_told(record: CampaignRecord, plan: Plan, folder: Path) -> list[str]:
    """Return what becomes of the steps under a new plan: a line for all, and one for each that is another.

    Parameters
    ----------
    record : CampaignRecord
        How far the campaign came, and by which plan.
    plan : Plan
        Of the edited files.
    folder : Path
        The campaign's folder.
    """
    now = begin_record(plan, record, "", folder)
    done = sum(step.over for step in now.steps)
    lines = [f"steps: {done} of {len(now.steps)} complete and not repeated; {len(now.steps) - done} to do"]
    planned = {step.plan_hash: step for step in plan.steps}
    kept = {run for step in now.steps for run in step.runs}
    was = {step["plan_hash"]: step for step in record.plan.get("steps", ())}
    there = {step.plan_hash for step in record.steps}
    same = same_steps(plan, record.plan)
    gone = [step for step in record.steps if step.plan_hash not in same]
    for step in now.steps:
        if step.plan_hash in same.values() or step.plan_hash in there:
            continue
        before = next((one for one in gone if one.name == step.name), None)
        if before is None:
            lines.append(f"  new: “{step.name}”")
            continue
        gone.remove(before)
        changes = _changes(was.get(before.plan_hash, {}), planned[step.plan_hash].as_dict())
        lines.append(f"  changed: “{step.name}” ({changes}): {_consequence(before.status)}")
    for step in gone:
        stay = "; its runs stay" if set(step.runs) - kept else ""
        lines.append(f"  no longer planned: “{step.name}” (was {step.status}{stay})")
    return lines


def limits_edited(
    record: CampaignRecord, copies: Inputs, prepared: PreparedCampaign
) -> tuple[LimitEdit, ...]:
    """Return the limits, thresholds and actions that were edited, and in which direction."""
    was = record.plan.get("limits", {})
    now = prepared.plan.as_dict()["limits"]
    before = _document(record, copies.campaign)
    campaign = prepared.campaign.content
    found = [*_compared(_bounds(was), _bounds(now)), *_compared(_test(was), _test(now))]
    policy = [one.get("test", {}).get("on_temperature_stop") for one in (was, now)]
    if policy[0] and policy[0] != policy[1]:
        direction: Direction = "another"
        if "stop" in policy:
            direction = "stricter" if policy[1] == "stop" else "LOOSER"
        found.append(LimitEdit("on_temperature_stop", policy[0], policy[1], direction))
    old_guards = GuardTable.model_validate(before.get("guards", {}))
    tilts = (_tilt_mm(_stand_document(record)), prepared.stand_file.stand.tilt_max_mm)
    speeds = [_bounds(one).get("speed_max_mm_per_s") for one in (was, now)]
    found += _compared(
        _guards(old_guards, tilts[0], speeds[0]), _guards(campaign.guards, tilts[1], speeds[1])
    )
    found += _of_stand(_stand_document(record), prepared.stand_file)
    if (unguarded := record.plan.get("not_guarded")) is not None:
        found += _no_longer_guarded(unguarded, prepared.plan.not_guarded)
    found += [*_actions(old_guards, campaign.guards), *_own_tables(old_guards, campaign.guards)]
    found += _zeros(ZeroTable.model_validate(before.get("zero", {})), campaign.zero)
    return (*found, *_own_limits(record, prepared.plan))


def _consequence(status: str) -> str:
    if status in ("complete", "skipped"):
        return f"it was {status}, and is run AGAIN as another step; the runs of the old one stay"
    if status == "pending":
        return "it has not run yet"
    return f"it was {status}, and begins anew as another step; the runs of the old one stay"


def _changes(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    keys: Sequence[str] = SHOWN
    if before.get("asked") and now.get("asked"):
        before, now = before["asked"], now["asked"]
        keys = [*dict.fromkeys([*before, *now])]
    apart = [key for key in keys if before.get(key) != now.get(key)]
    said = [f"{key} {_shown(before.get(key))} → {_shown(now.get(key))}" for key in apart]
    return ", ".join(said) or "its motions"


def _shown(value: object) -> str:
    if value is None:
        return "not given"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _compared(before: Mapping[str, float], now: Mapping[str, float]) -> list[LimitEdit]:
    """Return what differs of figures of which the smaller is the stricter."""
    return [
        LimitEdit(name, before[name], now[name], "stricter" if now[name] < before[name] else "LOOSER")
        for name in sorted(before.keys() & now.keys())
        if before[name] != now[name]
    ]


def _bounds(limits: Mapping[str, Any]) -> dict[str, float]:
    found = {}
    for name in BOUNDS:
        value = limits.get("in_force", {}).get(name)
        value = value["value"] if isinstance(value, dict) else value
        if value is not None:
            found[name] = float(value)
    return found


def _test(limits: Mapping[str, Any]) -> dict[str, float]:
    test = limits.get("test", {})
    return {name: float(test[name]) for name in TEST if test.get(name) is not None}


def _guards(table: GuardTable, stand_tilt_mm: float | None, speed: float | None) -> dict[str, float]:
    content = table.model_dump(exclude={"action"})
    content["tilt_max_mm"] = table.tilt_max_mm or stand_tilt_mm or DEFAULT_TILT_MM
    if table.speed_trip_mm_per_s is None and speed is not None:
        content["speed_trip_mm_per_s"] = SPEED_FACTOR * speed
    return {f"guards.{name}": float(value) for name, value in content.items() if value is not None}


def _actions(before: GuardTable, now: GuardTable) -> list[LimitEdit]:
    severity = get_args(TripAction)
    old, new = before.action.model_dump(), now.action.model_dump()
    return [
        LimitEdit(
            f"guards.action.{name}", old[name], new[name],
            "stricter" if severity.index(new[name]) > severity.index(old[name]) else "LOOSER",
        )
        for name in old
        if old[name] != new[name]
    ]  # fmt: skip


def _own_tables(before: GuardTable, now: GuardTable) -> list[LimitEdit]:
    """Return what differs of guards that bring their settings: which way is stricter only these know."""
    old, new = (
        {f"guards.{kind}.{key}": value for kind, table in one.own.items() for key, value in table.items()}
        for one in (before, now)
    )
    names = sorted(old.keys() | new.keys())
    return [
        LimitEdit(name, old.get(name), new.get(name), "another")
        for name in names
        if old.get(name) != new.get(name)
    ]


def _of_stand(before: Mapping[str, Any], now: StandFile) -> list[LimitEdit]:
    """Return what differs of the guards that the stand file sets: watchdog, thermometers on the specimen."""
    watchdog_s = before.get("controller", {}).get("watchdog_s")
    found = []
    if watchdog_s is not None:
        name = "controller.watchdog_s"
        found += _compared({name: float(watchdog_s)}, {name: now.controller.watchdog_s})
    for role, words in (("specimen", "thermometers on the specimen"), ("ambient", "thermometers in the air")):
        was, there = _thermometers(before, role), _thermometers(now.model_dump(mode="json"), role)
        if there < was:
            found.append(LimitEdit(words, was, there, "LOOSER"))
        elif there > was and role == "specimen":  # more in the air guard nothing of their own
            found.append(LimitEdit(words, was, there, "stricter"))
    return [*found, *_plausible(before, now)]


def _thermometers(stand: Mapping[str, Any], role: str) -> int:
    return sum(sensor.get("role", "specimen") == role for sensor in recorded_thermometers(stand))


def _plausible(before: Mapping[str, Any], now: StandFile) -> list[LimitEdit]:
    """Return the channels of which it is no longer, or is now, stated what they can show."""
    channels = {channel.name: channel for channel in now.controller.channel}
    found = []
    for channel in before.get("controller", {}).get("channel", ()):
        name = str(channel.get("name"))
        if name not in channels:
            continue
        was, there = bool(channel.get("plausible")), channels[name].plausible is not None
        if was != there:
            direction: Direction = "stricter" if there else "LOOSER"
            found.append(LimitEdit(f"controller.channel[{name}].plausible", was, there, direction))
    return found


def _no_longer_guarded(before: Sequence[str], now: Sequence[str]) -> list[LimitEdit]:
    """Return what the stand, as edited, cannot guard any more, and what it guards now."""
    was, there = (
        [what for what in what_is_unguarded(said) if what not in SAID_OTHERWISE] for said in (before, now)
    )
    return [
        *(LimitEdit("not guarded:", "–", what, "LOOSER") for what in there if what not in was),
        *(LimitEdit("not guarded:", what, "–", "stricter") for what in was if what not in there),
    ]


def _zeros(before: ZeroTable, now: ZeroTable) -> list[LimitEdit]:
    """Return what differs of ``[zero]``; not to touch off is looser."""
    found = []
    if before.touch != now.touch:
        found.append(LimitEdit("zero.touch", before.touch, now.touch, "stricter" if now.touch else "LOOSER"))
    figures = [
        {f"zero.{name}": value for name, value in table.model_dump().items() if type(value) is float}
        for table in (before, now)
    ]
    return found + _compared(*figures)


def _own_limits(record: CampaignRecord, plan: Plan) -> list[LimitEdit]:
    """Return what differs of the limits that steps have of their own, of those that are to do."""
    same = same_steps(plan, record.plan)
    over = {step.plan_hash for step in record.steps if step.over}
    was = {same[step["plan_hash"]]: step for step in record.plan.get("steps", ()) if
           step["plan_hash"] in same and step["plan_hash"] not in over}  # fmt: skip
    campaign = {"temperature_stop_C": plan.campaign.limits.temperature_stop_C,
                "temperature_resume_C": plan.campaign.limits.temperature_resume_C}  # fmt: skip
    before = record.plan.get("limits", {}).get("test", {})
    found = []
    for step in plan.steps:
        old = was.get(step.plan_hash)
        if old is None:
            continue
        for name in OWN:
            values = old.get(name), getattr(step, name)
            if values[0] == values[1]:
                continue
            figures = [
                {f"step “{step.name}”: {name}": float(other if own is None else own)}
                for own, other in zip(values, (before.get(name, 0.0), campaign[name]), strict=True)
            ]
            found += _compared(*figures)
        found += _bands(step, old.get("start_band"))
    return found


def _bands(step: PlannedStep, old: Mapping[str, Any] | None) -> list[LimitEdit]:
    """Return what differs of the temperatures at which a step may begin; a part of a band is stricter."""
    was = None if old is None else (float(old["low_C"]), float(old["high_C"]))
    now = None if step.start_band is None else (step.start_band.low_C, step.start_band.high_C)
    if was == now:
        return []
    direction: Direction = "another"
    if was is None or (now is not None and was[0] <= now[0] and now[1] <= was[1]):
        direction = "stricter"
    elif now is None or (now[0] <= was[0] and was[1] <= now[1]):
        direction = "LOOSER"
    texts = ["any" if band is None else f"{band[0]:g} … {band[1]:g}" for band in (was, now)]
    return [LimitEdit(f"step “{step.name}”: start_temperature_C", texts[0], texts[1], direction)]


def _document(record: CampaignRecord, place: str) -> dict[str, Any]:
    return toml_document(record.inputs.get(place, ""), Path(place))


def _stand_document(record: CampaignRecord) -> dict[str, Any]:
    for place, text in record.inputs.items():
        document = toml_document(text, Path(place))
        if "controller" in document:
            return document
    return {}


def _tilt_mm(stand: Mapping[str, Any]) -> float | None:
    found = stand.get("stand", {}).get("tilt_max_mm")
    return None if found is None else float(found)
