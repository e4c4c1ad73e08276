"""The sample stand, guards that do not trip on it, and a recorder of what it delivers."""

from __future__ import annotations

from pathlib import Path

from benchmarks.common.measuring import ROOT
from bufferstand.daq.campaign_folder.run_metadata import stream_document
from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardSet
from bufferstand.drivers.interfaces import Stand
from bufferstand.recording.recorder import RunRecorder

SAMPLE_STAND = ROOT / "sample_runs" / "stand.toml"
PATIENCE_S = 60.0
"""A controller may be silent so long [s]: a machine that stands still for seconds ends no benchmark."""


def wide_guards(stroke: str, rate_Hz: float) -> GuardSet:
    """Return guards of force, of a stroke by its name, and of the controller, far beyond what comes."""
    return GuardSet(
        (
            ChannelGuard("force", "force", 600.0, -60.0, "kN", "force"),
            ChannelGuard(stroke, stroke, 250.0, -60.0, "mm", "stroke"),
        ),
        (),
        ControllerGuard(PATIENCE_S, PATIENCE_S, rate_Hz),
    )


def record(stand: Stand, folder: Path) -> RunRecorder:
    """Return a recorder of all that a connected stand delivers."""
    streams = (stand.controller.facts, *(sensor.facts for sensor in stand.sensors))
    document = {
        "format": "bufferstand/run",
        "format_version": 1,
        "run": {"id": "benchmark", "kind": "harmonic", "started_utc": "2026-01-01T00:00:00+00:00"},
        "software": {"name": "bufferstand", "version": "0"},
        "stand": {},
        "specimen": {},
        "streams": {stream.name: stream_document(stream) for stream in streams},
    }
    return RunRecorder(folder, "benchmark", document)
