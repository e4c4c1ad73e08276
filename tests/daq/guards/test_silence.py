"""A stream that falls silent: at the limit, beyond it, said once, with what its driver complained of."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bufferstand.daq.guards.kinds.silence import SilenceGuard, SilenceMemory
from bufferstand.daq.guards.sights import Complaint, MotionOver, PassOver, Samples
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.drivers.interfaces import SensorFault

from .beside import Around, block

GUARD = SilenceGuard("amplifier", 2.0, Action.STOP)
HEARD = SilenceMemory(100.0)


def after(
    wall_s: float, memory: SilenceMemory = HEARD, guard: SilenceGuard = GUARD
) -> tuple[SilenceMemory, Any]:
    return guard.look(memory, PassOver(), Around(wall_s=wall_s))


def test_the_limit_itself_is_no_silence() -> None:
    assert after(102.0) == (HEARD, None)
    memory, trip = after(102.5)
    assert memory == SilenceMemory(100.0, said=True)
    assert trip == Trip(
        "silence of amplifier",
        Action.STOP,
        "amplifier has delivered nothing for 2.5 s (limit 2 s): nothing was received; "
        "check cable, power and port",
        5.0,
        value=2.5,
        limit=2.0,
        unit="s",
        stream="amplifier",
        device_fault=True,
    )


def test_silence_is_said_once_until_it_is_heard_again() -> None:
    said, _ = after(103.0)
    assert after(120.0, said) == (said, None)
    heard, trip = GUARD.look(said, Samples(block({"force": 1.0}, stream="amplifier")), Around(wall_s=121.0))
    assert (heard, trip) == (SilenceMemory(121.0), None)
    assert after(124.0, heard)[1] is not None


def test_a_note_is_no_fault_of_a_device() -> None:
    _, trip = after(103.0, guard=SilenceGuard("amplifier", 2.0, Action.NOTE))
    assert not trip.device_fault


def test_only_samples_of_its_own_stream_are_heard() -> None:
    for other in (block({"force": 1.0}), block({}, stream="amplifier")):
        assert GUARD.look(HEARD, Samples(other), Around(wall_s=101.0)) == (HEARD, None)
    assert GUARD.look(HEARD, MotionOver(), Around(wall_s=110.0)) == (HEARD, None)


def test_what_its_driver_complains_of_explains_it() -> None:
    told, nothing = GUARD.look(HEARD, Complaint(SensorFault("amplifier", 1.0, "CRC wrong")), Around())
    assert (told.complaint, nothing) == ("CRC wrong", None)
    assert after(103.0, told)[1].reason.endswith("(limit 2 s): CRC wrong")
    assert GUARD.look(HEARD, Complaint(SensorFault("other", 1.0, "x")), Around()) == (HEARD, None)


def test_its_margin_is_the_share_of_the_limit_that_is_used() -> None:
    margin = GUARD.margin(HEARD, Around(wall_s=100.5))
    assert (margin.share, margin.text, margin.action) == (0.25, "0.5 s ago, trips after 2 s", Action.STOP)
    assert (margin.name, margin.label) == ("silence amplifier", "silence of amplifier")
    assert (GUARD.key, GUARD.begin(7.0)) == ("amplifier", SilenceMemory(7.0))
    assert not HEARD.said


@pytest.mark.parametrize("does", [Action.NOTE, Action.EMERGENCY])
def test_one_is_made_for_each_amplifier_and_one_of_an_acquisition_device_stops_at_least(does: Action) -> None:
    site: Any = SimpleNamespace(
        sensors={"temperature_1": 1, "amplifier": 2, "t7": 3},
        thermometers={"temperature_1": 1},
        acquisition={"t7": 3},
        table=SimpleNamespace(amplifier_silence_s=9.0, controller_silence_s=1.5),
        does=lambda name: {"amplifier_silence": does}[name],
    )
    assert list(SilenceGuard.made_for(site)) == [
        SilenceGuard("amplifier", 9.0, does),
        SilenceGuard("t7", 1.5, max(does, Action.STOP)),
    ]
    assert (SilenceGuard.turn, SilenceGuard.in_journal) == (10, True)
