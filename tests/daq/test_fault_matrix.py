"""Every fault of the injector in every phase: a safe end in time, whole files, a named reason."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.drivers.simulated.faults.schedule import FAULTS as INJECTED
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify
from tests.daq.fault_matrix import CHANNELS, PHASES, Cell, every_fault, run_cell

WIRE = r"controller or its wire failed|controller at in process"
SENSOR = r"temperature_1 \(spring plate 3\) has given no true reading for"
UNHEARD = "amplifier has delivered nothing"
FAULTS: Mapping[str, tuple[set[int], str]] = {
    **{
        f"controller={kind}": ({4}, WIRE)
        for kind in ("lost", "drop", "delay", "corrupt", "reorder", "request-drop", "request-corrupt")
    },
    "controller=exception": ({4}, WIRE),
    "controller=duplicate": ({0}, ""),
    "controller=stuck": ({4}, "does not count its heartbeat"),
    "controller=nan": ({0}, "register force of the controller holds nan"),
    "controller=trip": ({4}, r"it reports fault \d"),
    "controller=watchdog": ({4}, "watchdog"),
    "controller=clock-jump": ({4}, r"the tick steps by|clock jumped"),
    "controller=overrun": ({0}, ""),
    "force=broken": ({3}, r"force \(transducer of the controller\)"),
    "stroke_1=broken": ({3}, r"stroke|tilt"),
    "stroke_2=broken": ({3}, r"stroke|tilt"),
    "position=broken": ({3}, "following error"),
    "force=stuck": ({4}, "force has shown exactly"),
    "stroke_1=stuck": ({3, 4}, r"stroke_1 has shown exactly|tilt"),
    "stroke_2=stuck": ({3, 4}, r"stroke_2 has shown exactly|tilt"),
    "position=stuck": ({4}, "position has shown exactly"),
    **{f"amplifier={kind}": ({0}, UNHEARD) for kind in ("silent", "drop", "corrupt")},
    "amplifier=overload": ({0}, r"amplifier \(simulated\): .*(end of its converter|overload)"),
    "amplifier=resync": ({0}, "the spacing of its frames was lost"),
    "amplifier=delay": ({0}, ""),
    "amplifier=duplicate": ({0}, ""),
    "temperature_1=frozen": ({0}, ""),
    **{
        f"temperature_1={kind}": ({4}, SENSOR)
        for kind in (
            "silent", "crc", "crc-mismatch", "all-zero", "power-on", "no-power", "out-of-range", "unreadable",
            "garbled", "missing", "stale", "shorted", "unfinished", "unpowered",
        )
    },
}  # fmt: skip
"""By fault: exit statuses (docs/commands.md), and the words that name it; empty where it harms nothing."""

BLIND_S = 7.0
"""A fault is seen within this time: 5 s of a silent sensor, its period of 1 s, and a pass."""
UNLOAD_S = 7.0
"""From the trip to zero force: 25 mm at 20 mm/s, the hold, or 2 s of the watchdog and its own ramp."""
MOVES_AGAIN_S = 10.0
"""A transducer that stands still is seen once the piston moves again: after the hold, or in the next step."""


def name_of(fault: tuple[str, str, Mapping[str, Any]]) -> str:
    return f"{fault[0]}={fault[1]}" + "".join(f",{key}={value}" for key, value in fault[2].items())


def expected(fault: tuple[str, str, Mapping[str, Any]], phase: str) -> tuple[set[int], str]:
    """Return the exit statuses and the words of a cell."""
    target, kind, settings = fault
    statuses, words = FAULTS[f"{target}={kind}"]
    if settings.get("register") == "force":
        # A register that figures and guards do not use; but the safe stop sees no zero force in it.
        statuses, words = {0, 4}, r"\A(?!.)|NOT SAFE|safe stop: force -?[01]\.\d kN"
    if phase == "before start":
        if kind == "clock-jump":
            statuses, words = {0}, ""  # before the first sample there is nothing that it could jump from
        if kind == "nan":
            statuses, words = {4}, "not switched on: its own force reads nan"
        if kind == "watchdog":
            statuses, words = {0}, ""  # nothing is switched on that it could switch off
    if phase == "cool-down":
        at_rest = kind == "stuck" and target != "controller"
        if 0 in statuses or at_rest or kind == "nan":
            statuses = {3}  # at rest a steady value is true; the wait for cooling has its own end
            words = words if words and not at_rest else "not cool after 8 s"
    return statuses, words


def told(cell: Cell) -> str:
    """Return all that was said: the reason, lines, and events of the runs."""
    events = (event.text for path in cell.outcome.runs for event in open_run(path).events)
    return "\n".join((cell.outcome.reason, *cell.lines, *events))


def assert_cell(cell: Cell, fault: tuple[str, str, Mapping[str, Any]], phase: str) -> None:
    assert cell.injected_s is not None, "the phase was never reached"
    statuses, words = expected(fault, phase)
    outcome = cell.outcome
    assert int(outcome.exit_status) in statuses, outcome.reason
    assert re.search(words, outcome.reason if outcome.exit_status and 3 not in statuses else told(cell))
    assert outcome.error is None, "a bug of ours is no safe end"
    if outcome.exit_status:
        assert outcome.reason, "a stop without a reason"
    # The stand: what really happened, not what anybody says.
    assert not cell.opened.device.controller.valve_on
    truth_kN = cell.opened.truth.arrays()["force_kN"]
    assert not truth_kN.size or abs(truth_kN[-1]) < 0.5
    if outcome.exit_status:
        resting_s = MOVES_AGAIN_S if fault[1] == "stuck" or phase == "recording close" else 0.0
        assert cell.unloaded_after_s(cell.injected_s) < BLIND_S + UNLOAD_S + resting_s
    # The files: every one opens, is whole, and holds every sample that was handed over.
    assert len(outcome.runs) == len(cell.appended)
    for path, kept in zip(outcome.runs, cell.appended, strict=True):
        assert [f for f in verify(path) if f.level not in ("ok", "note")] == []
        run = open_run(path)
        assert run.status in ("complete", "stopped", "failed")
        if run.status != "complete":
            assert run.reason == outcome.reason
        if not kept.sequence:
            continue
        stream = run.streams["controller"]
        assert len(stream.sequence) >= kept.durable
        assert np.array_equal(stream.sequence, np.concatenate(kept.sequence))
        assert np.array_equal(stream.counts["force"], np.concatenate(kept.force))


ALWAYS = [
    ("before start", "controller=lost"),
    ("ramp", "controller=trip"),
    ("harmonic", "force=stuck"),
    ("harmonic", "controller=lost"),
    ("hold", "temperature_1=crc"),
    ("cool-down", "controller=watchdog"),
    ("recording close", "controller=drop"),
]


def cells() -> list[Any]:
    found = []
    for phase in PHASES:
        for fault in every_fault():
            often = (phase, name_of(fault)) in ALWAYS
            marks = [] if often else [pytest.mark.long]
            found.append(pytest.param(phase, fault, marks=marks, id=f"{phase}-{name_of(fault)}"))
    return found


@pytest.mark.parametrize(("phase", "fault"), cells())
def test_no_cell_of_the_fault_matrix_fails(
    tmp_path: Path, phase: str, fault: tuple[str, str, Mapping[str, Any]]
) -> None:
    assert_cell(run_cell(tmp_path, phase, fault), fault, phase)


TARGETS = {
    "controller": ("controller",), "channel": CHANNELS, "amplifier": ("amplifier",),
    "temperature": ("temperature_1",),
}  # fmt: skip
"""By class of the injector: what of it the matrix strikes."""


@pytest.mark.slow
def test_the_matrix_has_every_fault_of_the_injector() -> None:
    """A class, a target or a fault that the injector gets fails here until the matrix knows it."""
    assert INJECTED.keys() - TARGETS.keys() == {"acquisition"}, "see tests/two_clocks/test_campaign.py"
    injected = {
        f"{target}={kind}"
        for name, targets in TARGETS.items()
        for kind in INJECTED[name]
        for target in targets
    }
    assert {f"{target}={kind}" for target, kind, _ in every_fault()} == injected
    assert set(FAULTS) == injected
    assert len(cells()) == len(PHASES) * len(every_fault())
    assert len(set(PHASES)) == len(PHASES) == 6
