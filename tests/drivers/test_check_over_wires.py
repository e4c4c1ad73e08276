"""What `check` says of a wire, in virtual time."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bufferstand.drivers.check.devices import check_devices
from bufferstand.drivers.check.rows import CheckRow
from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.simulated.faults.schedule import parse_fault
from bufferstand.drivers.simulated.inprocess.register_wire import Lost, VirtualWire
from bufferstand.drivers.simulated.inprocess.stand import behind_a_wire, open_in_process
from bufferstand.drivers.simulated.wires.modbus_requests import READ_HOLDING
from bufferstand.drivers.stand_file.loading import load_stand
from tests.drivers.conftest import SAMPLE_STAND


def rows_over(trip_s: float) -> dict[str, CheckRow]:
    """Check the controller of the shipped stand over a wire."""
    stand_file = load_stand(SAMPLE_STAND)
    opened = open_in_process(stand_file, log_truth=False)
    controller = behind_a_wire(opened, stand_file, lambda: trip_s).controller
    rows = check_devices(stand_file, controller, (), opened.clock, watch_s=1.0)
    return {row.item: row for row in rows}


@pytest.mark.parametrize(
    ("trip_ms", "verdict"),
    [
        (0.04, Verdict.OK),
        (5.0, Verdict.OK),
        (10.0, Verdict.OK),
        (10.9, Verdict.OK),
        (11.1, Verdict.FAULT),
        (11.5, Verdict.FAULT),
        (20.0, Verdict.FAULT),
    ],
)
def test_it_says_whether_the_wire_keeps_up(trip_ms: float, verdict: Verdict) -> None:
    rows = rows_over(trip_ms / 1e3)
    row = rows["keeping up"]
    assert row.verdict is verdict, row
    assert row.figures["block_round_trip_ms"] == pytest.approx(trip_ms, abs=0.01)
    assert row.figures["samples_per_block"] == 14.0
    assert row.figures["longest_round_trip_ms"] == pytest.approx(11.025, abs=0.01)
    assert (row.figures["most_Hz"] > 1000.0) is (verdict is Verdict.OK)
    if verdict is Verdict.OK:
        assert rows["sample rate"].verdict is Verdict.OK, rows["sample rate"]


def rows_polled(trip_s: float) -> dict[str, CheckRow]:
    """Check the same stand with its controller polled at 100 Hz, in two reads a poll."""
    stand_file = load_stand(SAMPLE_STAND)
    opened = open_in_process(stand_file, log_truth=False)
    clock, stand = opened.clock, behind_a_wire(opened, stand_file, lambda: trip_s, load_profile("polling"))
    rows = check_devices(stand_file, stand.controller, (), clock, watch_s=2.0)
    return {row.item: row for row in rows}


@pytest.mark.parametrize(
    ("trip_ms", "keeping_up", "rate"),
    [
        (1.0, Verdict.OK, Verdict.OK),
        (4.3, Verdict.NOTE, Verdict.OK),  # nobody commands meanwhile: each period has its sample still
        (5.0, Verdict.FAULT, Verdict.FAULT),
        (6.0, Verdict.FAULT, Verdict.FAULT),
    ],
)
def test_it_says_whether_the_polls_fit_into_their_period(
    trip_ms: float, keeping_up: Verdict, rate: Verdict
) -> None:
    rows = rows_polled(trip_ms / 1e3)
    row = rows["keeping up"]
    assert (row.verdict, rows["sample rate"].verdict) == (keeping_up, rate), rows
    assert f"(2 reads of {trip_ms:.2f} ms, so {2.0 * trip_ms:.2f} ms a poll in periods of 10 ms)" in row.value
    assert row.figures["poll_ms"] == pytest.approx(2.0 * trip_ms, abs=0.01)
    assert "ring" not in " ".join(f"{one.value} {one.remark}" for one in rows.values())


def test_polls_that_never_fit_are_told_from_a_controller_that_samples_nothing() -> None:
    rows = rows_polled(0.0105)
    assert rows["keeping up"].verdict is Verdict.FAULT
    assert "does not keep up: at most 0 polls/s of 100" in rows["keeping up"].value
    assert rows["keeping up"].remark.startswith("state rate_Hz = 36.6 or less in [poll]")
    assert rows["samples"].verdict is Verdict.FAULT
    assert "its reads come further apart than one period" in rows["samples"].remark


def missing(cycles: int, times: int, *, watch_s: float = 5.0) -> dict[str, CheckRow]:
    """Check a controller with a ring that misses some cycles so many times while it is watched."""
    stand_file = load_stand(SAMPLE_STAND)
    at_s = [0.5 + 0.7 * watch_s * number / times for number in range(times)]
    faults = [parse_fault(f"controller=clock-jump@{t_s:.3f},jump_s={cycles / 1e3}") for t_s in at_s]
    opened = open_in_process(stand_file, log_truth=False, faults=faults)
    controller = behind_a_wire(opened, stand_file, lambda: 0.001).controller
    rows = check_devices(stand_file, controller, (), opened.clock, watch_s=watch_s)
    return {row.item: row for row in rows}


@pytest.mark.parametrize(
    ("cycles", "times", "verdict", "told"),
    [
        (1, 1, Verdict.NOTE, "1 cycle in"),
        (4, 2, Verdict.NOTE, "8 cycles in"),  # 96 a minute, by two holes: nobody can be sure of that
        (1, 20, Verdict.FAULT, "20 cycles in"),
        (70, 1, Verdict.FAULT, "70 cycles in"),  # more than a minute may have
    ],
)
def test_missed_cycles_are_told_from_lost_samples_and_judged_as_by_a_campaign(
    cycles: int, times: int, verdict: Verdict, told: str
) -> None:
    rows = missing(cycles, times)
    row = rows["missed cycles"]
    assert (row.verdict, row.value.startswith(told)) == (verdict, True), row
    assert row.figures["missed"] == cycles * times
    assert "a campaign stops at more than 60 a minute ([guards] missed_cycles_max_per_min)" in row.remark
    assert rows["sample rate"].verdict is Verdict.OK
    assert rows["sample rate"].figures["lost"] == 0.0


@pytest.mark.parametrize("function_23", [True, False])
def test_a_ring_that_another_program_reads_is_left_alone(function_23: bool) -> None:
    stand_file = load_stand(SAMPLE_STAND)
    opened = open_in_process(stand_file, log_truth=False)
    profile = replace(load_profile("ring"), read_write=function_23)
    sent: list[bytes] = []

    def seen(request: bytes) -> Lost:
        sent.append(request)
        return ""

    wire = VirtualWire(opened.device, profile, opened.clock, lambda: 0.001, seen)
    link = ModbusLink(wire, read_write=function_23)
    campaign, check = (
        RingController(link, profile, stand_file.controller.channel, opened.clock) for _ in range(2)
    )
    campaign.connect()
    campaign.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=60_000)
    opened.clock.sleep(0.1)
    assert campaign.read_block() is not None
    before = opened.device.ring.acknowledgements
    sent.clear()
    rows = {row.item: row for row in check_devices(stand_file, check, (), opened.clock, watch_s=1.0)}
    assert opened.device.ring.acknowledgements == before
    if not function_23:  # there a status needs no number
        assert {request[0] for request in sent} == {READ_HOLDING}
    assert [row for row in rows.values() if row.verdict is Verdict.FAULT] == []
    holder = campaign.other_writer(), check.other_writer()
    assert holder[0] == 0
    assert rows["in use"].value == f"program {holder[1]} gives commands (holding)"
    assert "its ring is not read" in rows["samples"].remark
    assert rows["clock drift"].figures["drift_ppm"] == pytest.approx(20.0, abs=1000.0)
    assert rows["its own reading"].value.startswith("force ")
    assert not {"sample rate", "keeping up", "force"} & set(rows)


def test_one_without_a_lock_is_left_alone_once_it_is_switched_on() -> None:
    stand_file = load_stand(SAMPLE_STAND)
    opened = open_in_process(stand_file, log_truth=False)
    opened.stand.controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=60_000)
    ring = load_profile("ring")
    lockless = replace(ring, registers={k: v for k, v in ring.registers.items() if k != "writer"})
    controller = behind_a_wire(opened, stand_file, lambda: 0.001, lockless).controller
    rows = {row.item: row for row in check_devices(stand_file, controller, (), opened.clock, watch_s=0.0)}
    assert rows["in use"].value == "somebody has switched it on (holding)"
    assert "force" not in rows


def test_polls_disturb_nobody_and_go_on_beside_another_program() -> None:
    stand_file = load_stand(SAMPLE_STAND)
    opened = open_in_process(stand_file, log_truth=False)
    opened.stand.controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=60_000)
    clock, stand = opened.clock, behind_a_wire(opened, stand_file, lambda: 0.001, load_profile("polling"))
    rows = {row.item: row for row in check_devices(stand_file, stand.controller, (), clock, watch_s=1.5)}
    assert rows["in use"].verdict is Verdict.NOTE
    assert rows["sample rate"].verdict is Verdict.OK
    assert rows["force"].verdict is Verdict.OK
