"""The metadata document of a run: all that evaluating and reporting it will need."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from bufferstand.daq.campaign_folder.stand_origin import StandOrigin
from bufferstand.daq.guards import GuardSet
from bufferstand.daq.scaling import zeroed
from bufferstand.drivers import Identity, Stand, StreamFacts
from bufferstand.drivers.instruments import stream_name
from bufferstand.foundation.channels import Zero, recorded_thermometers
from bufferstand.protocols.planning import Plan, limits_of
from bufferstand.protocols.steps import PlannedStep
from bufferstand.recording.runfile import SPEED_KEY


@dataclass(frozen=True)
class CampaignMetadata:
    """What the runner cannot know by itself.

    Parameters
    ----------
    stand : mapping
        The stand file as data (its original, without this machine's wires).
    watchdog_s : float
        Time that the controller's watchdog is set to [s of the wall].
    operator : str
        Who runs it.
    test : mapping
        ``[test]`` of the specimen file, if it has one.
    arming : mapping
        Who said that the real stand may move, when and how; empty for a simulated one.
    edits : mapping
        Who took edited files and how, for ``campaign.json``; empty if nobody was asked.
    """

    stand: Mapping[str, Any]
    watchdog_s: float
    operator: str = ""
    test: Mapping[str, Any] = field(default_factory=dict)
    stored_zero: Zero | None = None
    """What ``bufferstand stand zero`` or ``tare`` has left for this stand, if anything."""
    arming: Mapping[str, Any] = field(default_factory=dict)
    edits: Mapping[str, Any] = field(default_factory=dict)
    started_here: bool = False
    """Whether this program has started the stand for the campaign: a simulated one then."""
    speed: float = 1.0
    """Stand time in multiples of real time, of a stand that this program has started."""
    began_simulated: bool | None = None
    """What the campaign's runs so far were made on; None where there is none, or nobody knows."""
    began_controller: Mapping[str, Any] = field(default_factory=dict)
    """The controller of the start before; empty where there is none, or nobody knows."""
    accepted_serial: str = ""
    """Serial number of another controller with which somebody has agreed to go on."""
    changes: tuple[Mapping[str, Any], ...] = ()
    """What differs from what the campaign began with (:mod:`bufferstand.daq.campaign_folder.changes`),
    as it was accepted.
    """
    doubted: tuple[Mapping[str, Any], ...] = ()
    """What ended earlier starts that recorded nothing
    (:func:`bufferstand.daq.campaign_folder.start_records.doubts_before`), for the runs."""
    edited: tuple[Mapping[str, Any], ...] = ()
    """Every edit of the campaign's files that was taken so far, with its diff, for the runs."""

    def ambient(self) -> frozenset[str]:
        """Return the streams that may be temperatures and do not touch the specimen."""
        sensors = recorded_thermometers(self.stand)
        ambient = {sensor["name"] for sensor in sensors if sensor.get("role") == "ambient"}
        others = self.stand.get("sensor") or ()
        return frozenset(ambient | {stream_name("sensor", number) for number in range(len(others))})


def stream_document(facts: StreamFacts) -> dict[str, Any]:
    """Return a stream's part of the document."""
    document = {
        "clock": facts.clock,
        "rate_Hz": facts.rate_Hz or None,
        "device": facts.device,
        "channels": [channel.model_dump(mode="json") for channel in facts.channels],
    }
    # Only where it is not counts: the file of a stand that delivers counts stays what it was.
    return {**document, "raw_units": dict(facts.raw_units)} if facts.raw_units else document


def run_document(
    run_id: str,
    step: PlannedStep,
    plan: Plan,
    stand: Stand,
    identity: Identity,
    reached: StandOrigin,
    guards: GuardSet,
    facts: CampaignMetadata,
    zero: Zero | None = None,
) -> dict[str, Any]:
    """Return the metadata document of the run of one step (docs/run-file.md).

    ``zero``, where one is in force, is part of every channel's tare, and stands there with how it was found.

    Raises
    ------
    ValueError
        If the step is of a kind that is not recorded.
    """
    if step.run_kind is None:
        raise ValueError(f"step {step.index} ({step.kind}) is not recorded")
    streams = (stand.controller.facts, *(sensor.facts for sensor in stand.sensors))
    return {
        "format": "bufferstand/run",
        "format_version": 1,
        "run": {
            "id": run_id,
            "kind": step.run_kind,
            "started_utc": datetime.now(UTC).isoformat(),
            "operator": facts.operator or plan.campaign.content.campaign.operator,
            "campaign": plan.campaign.id,
            "step_index": step.index,
            **({SPEED_KEY: facts.speed} if facts.speed != 1.0 else {}),
            **reached.document(),
        },
        "software": {"name": "bufferstand", "version": version("bufferstand")},
        "stand": {**facts.stand, "identity": asdict(identity)},
        "specimen": plan.specimen.model_dump(mode="json"),
        "test": dict(facts.test),
        "arming": dict(facts.arming),
        "edits": [dict(edit) for edit in facts.edited],
        "campaign": plan.campaign.as_dict(),
        "step": step.as_dict(),
        "limits": {
            "stand": plan.stand_limits.as_dict(),
            "test": limits_of(step, plan.campaign.limits).model_dump(mode="json"),
            "in_force": plan.limits.as_dict(),
            "guards": guards.as_dict(),
            "not_guarded": list(plan.not_guarded),
        },
        "streams": {stream.name: stream_document(zeroed(stream, zero)) for stream in streams},
    } | ({} if zero is None else {"zero": zero.document()})
