"""How a campaign was begun: on which kind of stand, with which controller, by which software.

It stands in ``starts`` of ``campaign.json``, start by start, so that earlier versions still read the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bufferstand.daq.campaign_folder.folder import CampaignRecord
from bufferstand.daq.campaign_folder.stand_origin import StandOrigin
from bufferstand.drivers import Identity
from bufferstand.foundation import BadInput
from bufferstand.recording.runfile import HOW_KEY, KEY, read_metadata, simulated_of

SIMULATE, SPEED, SOFTWARE, CONTROLLER, CHANGES = "simulate", "speed", "software", "controller", "changes"
TRIP = "trip"
"""Keys of a start."""


@dataclass(frozen=True)
class CampaignStart:
    """What a campaign goes on with.

    Parameters
    ----------
    simulate : bool or None
        Whether the program itself started the stand (``--simulate``); None where nobody knows.
    speed : float
        Stand time in multiples of real time, of a stand that it started.
    simulated : bool or None
        Whether the campaign was begun on a simulated stand; None where nobody knows.
    controller : mapping
        The controller of the last start that came to one: ``device``, ``serial``, ``profile`` …
    software : str
        Version of the software of the last start; empty where none is on record.
    """

    simulate: bool | None = None
    speed: float = 1.0
    simulated: bool | None = None
    controller: Mapping[str, Any] = field(default_factory=dict)
    software: str = ""


def software_version() -> str:
    """Return the version of this software."""
    return version("bufferstand")


def begun(record: CampaignRecord | None, folder: Path) -> CampaignStart:
    """Return how a campaign was begun, by its folder.

    The kind of stand is that of the first start, also where nothing was recorded; which controller it was
    binds nobody then. A folder of before 2026-11-24 does not say it: who was asked for consent was about to
    move what its stand file leads to, and who was not had the stand started by the program.

    Parameters
    ----------
    record : CampaignRecord or None
        ``campaign.json``.
    folder : Path
        The campaign's folder.
    """
    if record is None:
        return CampaignStart()
    # Every start of a campaign is made on the same kind of stand.
    simulate = record.last(SIMULATE)
    if simulate is None and record.starts:
        simulate = not any(start.get("arming") for start in record.starts)
    known = CampaignStart(
        simulate,
        float(record.last(SPEED) or 1.0),
        None,
        record.last(CONTROLLER) or {},
        record.last(SOFTWARE) or "",
    )
    simulated = record.last(KEY)
    if simulated is None and simulate:
        simulated = True
    if record.recorded_nothing(folder):
        return replace(known, controller={}, simulated=simulated)
    if known.controller and known.software:
        return replace(known, simulated=simulated)
    return _with_runs(replace(known, simulated=simulated), record, folder)


def _with_runs(known: CampaignStart, record: CampaignRecord, folder: Path) -> CampaignStart:
    """Return the same with what the newest run file adds: the folder is one of an earlier version."""
    for run in reversed([run for step in record.steps for run in step.runs]):
        try:
            document = read_metadata(folder / run)
        except (BadInput, OSError):
            continue
        identity = (document.get("stand") or {}).get("identity")
        software = (document.get("software") or {}).get("version")
        stated = simulated_of(document) if KEY in document["run"] else None
        return replace(
            known,
            simulated=stated if known.simulated is None else known.simulated,
            controller=known.controller or (identity if isinstance(identity, Mapping) else {}),
            software=known.software or str(software or ""),
        )
    return known


def start_facts(*, simulate: bool, speed: float) -> dict[str, Any]:
    """Return what a start says of itself before it has come to any device."""
    found: dict[str, Any] = {SIMULATE: simulate, SOFTWARE: software_version()}
    return found | ({SPEED: speed, KEY: True} if simulate else {})


def with_stand(record: CampaignRecord, reached: StandOrigin, identity: Identity) -> CampaignRecord:
    """Return the record with what its last start has come to: the kind of stand, and its controller."""
    if not record.starts:
        return record
    *before, last = record.starts
    found = {KEY: reached.simulated, HOW_KEY: reached.by, CONTROLLER: asdict(identity)}
    return replace(record, starts=(*before, last | found))


def with_doubt(record: CampaignRecord, trip: Mapping[str, Any]) -> CampaignRecord:
    """Return the record with what ended its last start before a run was begun: a doubt, or another guard.

    Parameters
    ----------
    record : CampaignRecord
    trip : mapping
        What an event of a run would hold, with its ``reason``.
    """
    if not record.starts:
        return record
    *before, last = record.starts
    return replace(record, starts=(*before, last | {TRIP: dict(trip)}))
