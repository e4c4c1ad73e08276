"""The metadata document of a run that was only recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from bufferstand.daq.campaign_folder import stream_document
from bufferstand.daq.guards import GuardSet
from bufferstand.drivers import RecordingDevices
from bufferstand.drivers.stand_file import RecordingStand
from bufferstand.foundation import Kind
from bufferstand.foundation.specimen import SpecimenFile
from bufferstand.recording.runfile import FORMAT, FORMAT_VERSION, KEY, RECORD_ONLY_KEY


@dataclass(frozen=True)
class RecordingFacts:
    """What a person says of a recording.

    Parameters
    ----------
    run_id : str
    kind : str
        Of the test.
    operator : str
    specimen : SpecimenFile or None
    """

    run_id: str
    kind: Kind
    operator: str = ""
    specimen: SpecimenFile | None = None


def recording_document(
    stand: RecordingStand, devices: RecordingDevices, guards: GuardSet, facts: RecordingFacts
) -> dict[str, Any]:
    """Return the document (docs/run-file.md): no campaign, no step, no arming.

    Parameters
    ----------
    stand : RecordingStand
    devices : RecordingDevices
        Started: they know who answered.
    guards : GuardSet
        That warn.
    facts : RecordingFacts
    """
    specimen: Mapping[str, Any] = {}
    test: dict[str, Any] = {}
    if facts.specimen is not None:
        specimen = facts.specimen.specimen.model_dump(mode="json")
        test = facts.specimen.test.model_dump(mode="json")
    described = {one.facts.name: getattr(one, "described", None) for one in devices.acquisition}
    descriptions = {name: content for name, content in described.items() if content}
    identity = [getattr(one, "identity", "") or one.facts.device for one in devices.all]
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "run": {
            "id": facts.run_id,
            "kind": facts.kind,
            "started_utc": datetime.now(UTC).isoformat(),
            "operator": facts.operator or test.get("operator", ""),
            "campaign": None,
            "step_index": None,
            RECORD_ONLY_KEY: True,
            KEY: any(one.facts.simulated for one in devices.all),
        },
        "software": {"name": "bufferstand", "version": version("bufferstand")},
        "stand": {
            **stand.model_dump(mode="json"),
            "laboratory": stand.stand.laboratory or test.get("laboratory", ""),
            "devices": dict(zip((one.facts.name for one in devices.all), identity, strict=True)),
            **({"descriptions": descriptions} if descriptions else {}),
        },
        "specimen": dict(specimen),
        "test": test,
        "step": {},
        "limits": {"warned_of": stand.limits.model_dump(mode="json"), "guards": guards.as_dict()},
        "streams": {one.facts.name: stream_document(one.facts) for one in devices.all},
    }
