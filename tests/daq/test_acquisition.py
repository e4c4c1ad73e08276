"""The loop loses nothing, feeds the watchdog, records before it judges, and latches what fails."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.guards.kinds.agreement import AgreementGuard
from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.kinds.temperature import TemperatureGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.guards.trips import Action
from bufferstand.drivers.interfaces import MotionState, SampleBlock, Stand
from tests.daq.cases import ListRecorder
from tests.daq.fake_stand import BLOCK, FakeClock, FakeController, FakeThermometer, Orders, fake_stand

GUARDS = GuardSet(
    (ChannelGuard("force", "force", 600.0, -10.0, "kN", "force"),),
    (TemperatureGuard("temperature_1", "plate", 40.0, 30.0, grace_s=5.0),),
    ControllerGuard(2.0, 0.5, 1000.0),
)


def acquire(
    orders: Orders | None = None,
    *,
    clock: FakeClock | None = None,
    pace: LoopPace | None = None,
    waited_for: bool = False,
    civil_s: Callable[[], float] = time.time,
    **stand: object,
) -> tuple[Acquisition, FakeController, ListRecorder]:
    clock = clock or FakeClock()
    opened, controller = fake_stand(clock, orders, **stand)  # type: ignore[arg-type]
    guards = GuardPanel(GUARDS, wall_s=0.0)
    acquisition = Acquisition(
        opened,
        clock,
        guards,
        pace=pace,
        utc=lambda: "2026-01-01T00:00:00+00:00",
        civil_s=civil_s,
        waited_for=waited_for,
    )
    recorder = ListRecorder()
    acquisition.attach(recorder)
    return acquisition, controller, recorder


def run(acquisition: Acquisition, duration_s: float) -> None:
    end_s = acquisition.clock.now_s() + duration_s
    while acquisition.clock.now_s() < end_s:
        acquisition.rest()
        acquisition.tick()


def test_every_sample_is_recorded_once_in_order_as_received() -> None:
    acquisition, _, recorder = acquire()
    run(acquisition, 3.0)
    blocks = [block for block in recorder.blocks if block[0] == "controller"]
    sequence = np.concatenate([b[1] + np.arange(len(b[2])) for b in blocks])
    assert sequence[0] == 1
    assert np.all(np.diff(sequence) == 1)
    assert len(sequence) == round(1000.0 * acquisition.clock.now_s()) >= 3000
    assert np.array_equal(np.concatenate([b[2] for b in blocks]), sequence * 1000)
    assert {name: counts.dtype for name, counts in blocks[0][3].items()} == dict.fromkeys(
        ("force", "stroke_1", "stroke_2", "position", "command"), np.dtype(np.int32)
    )
    assert sum(block[0] == "temperature_1" for block in recorder.blocks) == 4


def test_a_gap_is_counted_in_the_run_and_noted() -> None:
    acquisition, _, recorder = acquire(Orders(lose_at={500: 37}))
    run(acquisition, 1.0)
    assert [(block[1], block[4]) for block in recorder.blocks if block[4]] == [(537, 37)]
    assert acquisition.latest.lost == 37
    assert acquisition.latest.samples == 1000 - 37
    notes = [event for event in recorder.events if event[1] == "note"]
    assert len(notes) == 1
    assert "37 samples (37 ms) were lost before sample 537" in notes[0][2]
    assert acquisition.panel.trip is None


def test_a_pass_is_bounded_in_time_and_the_rest_comes_in_the_next() -> None:
    acquisition, controller, _ = acquire(Orders(round_trip_s=0.005))
    acquisition.clock.sleep(1.0)
    acquisition.tick()
    assert acquisition.latest.samples in (4 * BLOCK, 5 * BLOCK)  # 20 ms of reading
    assert not acquisition.up_to_date
    while not acquisition.up_to_date:
        acquisition.tick()
    assert acquisition.latest.samples >= 1000
    assert controller.calls.count("status") == 2, "at first, and when no samples were left"


@pytest.mark.parametrize(
    ("round_trip_s", "waited_for", "rest_s"),
    [
        (0.06, False, 0.42),  # seven times its own duration
        (0.3, False, 0.5),  # the longest: a guard counts on the heartbeat
        (0.06, True, 0.2),  # who waits for its reader loses nothing by it
    ],
)
def test_a_reader_that_stays_behind_reads_the_status_nevertheless(
    round_trip_s: float, waited_for: bool, rest_s: float
) -> None:
    acquisition, controller, _ = acquire(Orders(round_trip_s=round_trip_s), waited_for=waited_for)
    acquisition.clock.sleep(100.0)
    began_s = acquisition.clock.now_s()
    while acquisition.clock.now_s() < began_s + 6.0:
        acquisition.tick()
        assert not acquisition.up_to_date
    # a look takes 20 ms, so one block; feeding comes in between
    longest_s = rest_s + 3.0 * round_trip_s
    assert 6.0 / longest_s <= controller.calls.count("status") <= 6.0 / (rest_s + round_trip_s) + 1.0


def test_a_partly_filled_block_is_the_end_of_what_there_is() -> None:
    acquisition, controller, _ = acquire()
    acquisition.clock.sleep(0.025)
    acquisition.tick()
    assert acquisition.up_to_date
    assert acquisition.latest.samples == 25
    assert controller.calls.count("read_block") == 1, "no empty read is needed to know it"


@pytest.mark.parametrize("round_trip_s", [0.001, 0.002, 0.005, 0.01, 0.02, 0.03])
def test_a_slow_round_trip_loses_nothing_and_is_no_lag(round_trip_s: float) -> None:
    acquisition, _, recorder = acquire(Orders(round_trip_s=round_trip_s))  # 40 samples a block
    run(acquisition, 30.0)
    assert acquisition.panel.trip is None
    stamps = np.concatenate([block[2] for block in recorder.blocks if block[0] == "controller"])
    assert np.all(np.diff(stamps) == 1000)
    assert stamps[-1] / 1e6 > acquisition.clock.now_s() - 0.15


def test_a_block_is_judged_when_it_arrives_and_a_trip_ends_the_reading() -> None:
    orders = Orders(round_trip_s=0.005, add={"force": lambda n: 650.0 if n == BLOCK + 1 else 0.0})
    acquisition, controller, _ = acquire(orders)
    acquisition.clock.sleep(1.0)
    acquisition.tick()
    assert acquisition.panel.trip is not None
    assert controller.calls[-2:] == ["read_block", "read_block"], "the wire is left to the safe stop"
    assert acquisition.latest.samples == 2 * BLOCK


def test_the_watchdog_is_fed_through_a_long_wait() -> None:
    acquisition, controller, _ = acquire()
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=500)
    run(acquisition, 10.0)
    assert controller.watchdog_trips == 0
    assert controller.state is MotionState.HOLDING
    acquisition.clock.sleep(1.0)  # nobody feeds
    acquisition.tick()
    assert controller.watchdog_trips == 1
    assert acquisition.panel.trip is not None
    assert "its watchdog ran out" in acquisition.panel.trip.reason


def test_before_it_switches_on_a_program_feeds_nobody() -> None:
    acquisition, controller, _ = acquire()
    acquisition.feeding = False  # another program's actuator: its watchdog must see that one's death
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=500)
    run(acquisition, 1.0)
    assert controller.watchdog_trips == 1


@pytest.mark.parametrize("stand_waits", [False, True])
def test_a_late_pass_is_said_only_where_guards_were_to_look(
    monkeypatch: pytest.MonkeyPatch, stand_waits: bool
) -> None:
    """Not before the actuator is switched on, nor where the stand stood still with this program."""
    steady_s = [0.0]
    monkeypatch.setattr("bufferstand.daq.acquisition.loop.steady_s", lambda: steady_s[0])
    civil_s = lambda: 1000.0 + steady_s[0]  # noqa: E731
    acquisition, controller, recorder = acquire(civil_s=civil_s)

    def passes(late_s: float) -> int:
        """Make a pass that comes late and one that does not; return how often that was said."""
        before = len(recorder.events)
        for pause_s in (late_s, 0.02):
            steady_s[0] += pause_s
            acquisition.clock.sleep(0.25 if stand_waits else pause_s)
            acquisition.tick()
        return len([event for event in recorder.events[before:] if "stood still" in str(event)])

    acquisition.feeding = False
    assert passes(10.0) == 0
    acquisition.feeding = True
    assert passes(10.0) == 0, "it took so long to switch on"
    assert passes(10.0) == (0 if stand_waits else 1)
    silent = ["the sample ring: no reply within 1 s; connection closed, sent once more on a new connection"]
    monkeypatch.setattr(controller, "events", lambda: [silent.pop()] if silent else [])
    assert passes(3.0) == 0, "the controller was silent: that is said, and no computer is to blame"
    assert passes(3.0) == (0 if stand_waits else 1)


def test_feeding_counts_the_walls_time_on_a_fast_stand() -> None:
    acquisition, controller, _ = acquire(clock=FakeClock(wall_speed=0.05))
    run(acquisition, 20.0)  # one second of the wall
    assert 4 <= controller.calls.count("feed_watchdog") <= 6


def test_a_fast_stand_does_not_trip_by_its_own_speed() -> None:
    silent_after_3 = lambda t_s: 25.0 if t_s < 3.0 else None  # noqa: E731
    fast, _, _ = acquire(clock=FakeClock(wall_speed=0.05), reading=silent_after_3)
    run(fast, 20.0)
    assert fast.panel.trip is None
    real, _, _ = acquire(reading=silent_after_3)
    run(real, 10.0)
    assert real.panel.trip is not None
    assert real.panel.trip.guard == "temperature_1"


def test_a_clock_anchor_a_second_with_the_least_delay() -> None:
    acquisition, _, recorder = acquire()
    run(acquisition, 5.0)
    assert 5 <= len(recorder.anchors) <= 6
    delays = [host_s - device_us / 1e6 for device_us, host_s, _ in recorder.anchors]
    assert max(delays) < 1e-3  # the newest sample of a drained ring, not the oldest of a block
    assert all(b[0] > a[0] for a, b in zip(recorder.anchors, recorder.anchors[1:], strict=False))


def test_the_sample_that_trips_is_recorded_and_the_event_names_it() -> None:
    acquisition, _, recorder = acquire(Orders(add={"force": lambda n: 650.0 if n == 777 else 0.0}))
    run(acquisition, 1.0)
    trip = acquisition.panel.trip
    assert trip is not None
    assert (trip.sequence, trip.value) == (777, 650.0)
    recorded = np.concatenate([b[1] + np.arange(len(b[2])) for b in recorder.blocks if b[0] == "controller"])
    assert 777 in recorded
    event = next(event for event in recorder.events if event[1] == "trip")
    assert event[3]["sequence"] == 777
    assert event[3]["limit"] == 600.0


def test_a_wire_that_fails_is_latched_not_raised() -> None:
    acquisition, _, _ = acquire(Orders(wire_down=lambda now_s: now_s >= 0.5))
    run(acquisition, 1.0)
    trip = acquisition.panel.trip
    assert trip is not None
    assert (trip.guard, trip.action, trip.device_fault) == ("controller", Action.EMERGENCY, True)
    assert "no answer within 0.5 s" in trip.reason


@pytest.mark.parametrize(
    ("orders", "said"),
    [
        (Orders(silent_from_s=1.0), "delivers no new samples"),
        (Orders(heart_stops_at_s=1.0), "does not count its heartbeat"),
    ],
)
def test_a_controller_that_answers_but_does_not_live_trips(orders: Orders, said: str) -> None:
    acquisition, _, _ = acquire(orders)
    run(acquisition, 2.9)
    assert acquisition.panel.trip is None
    run(acquisition, 0.3)
    assert acquisition.panel.trip is not None
    assert said in acquisition.panel.trip.reason


def test_an_unexpected_exception_is_not_swallowed() -> None:
    acquisition, _, _ = acquire(Orders(explode_at_s=0.5))
    with pytest.raises(ZeroDivisionError):
        run(acquisition, 1.0)


@pytest.mark.parametrize(
    ("failure", "warning", "said"),
    [
        (OSError("no space left"), None, "recording failed: no space left"),
        (None, "1 MiB left", "nearly full"),
    ],
)
def test_a_failing_recorder_stops(failure: Exception | None, warning: str | None, said: str) -> None:
    acquisition, _, recorder = acquire()
    run(acquisition, 0.1)
    assert acquisition.panel.trip is None
    recorder.failure, recorder.disk_warning = failure, warning
    run(acquisition, 0.1)
    trip = acquisition.panel.trip
    assert trip is not None
    assert (trip.guard, trip.action, trip.device_fault) == ("recorder", Action.STOP, True)
    assert said in trip.reason


def test_a_sensors_complaint_becomes_an_event_of_the_run() -> None:
    acquisition, _, recorder = acquire(reading=lambda t_s: "CRC wrong" if t_s == 2.0 else 25.0)
    run(acquisition, 3.0)
    assert [(event[1], event[2]) for event in recorder.events] == [("sensor", "temperature_1: CRC wrong")]
    assert acquisition.panel.trip is None


class _Amplifier(FakeThermometer):
    """Delivers a constant second force, 50 samples a pass."""

    def drain(self) -> list[SampleBlock]:  # type: ignore[override]
        now_s = self._clock.now_s()
        counts = {"force_2": np.full(50, round(8.0 / 0.0625))}
        return [SampleBlock("amplifier", 0, np.full(50, round(now_s * 1e6)), counts, 0, now_s)]


def test_a_second_force_that_disagrees_is_a_note_in_the_run() -> None:
    clock = FakeClock()
    amplifier = _Amplifier(clock, lambda _: 0.0, "force_2")
    amplifier.facts = type(amplifier.facts)("amplifier", "host", amplifier.facts.channels, 250.0, "fake")
    guards = GuardSet(GUARDS.of(ChannelGuard), GUARDS.of(ControllerGuard), AgreementGuard(6.0))
    panel = GuardPanel(guards, wall_s=0.0)
    acquisition = Acquisition(Stand(FakeController(clock), (amplifier,)), clock, panel)
    recorder = ListRecorder()
    acquisition.attach(recorder)
    run(acquisition, 16.5)
    assert panel.trip is None
    notes = [event[2] for event in recorder.events if event[1] == "note"]
    assert len(notes) == 1
    assert "differ by -8.00 kN" in notes[0]
