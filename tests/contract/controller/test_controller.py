"""The contract of a controller: what the acquisition relies on, the same over every wire and none.

``--hardware STAND.toml`` runs it on a real stand, and moves it: see ``announced`` and docs/drivers.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.interfaces import Controller, EndReason, MotionState
from bufferstand.foundation.errors import CommandRejected, DeviceFault, NotInCharge
from bufferstand.foundation.motions import Harmonic, RampTo, Release, StandStill, StaticCycles
from tests.contract.controller import backends
from tests.contract.controller.backends import Bench

SPEED = 20.0
LAG_S = 0.02  # of a position loop, at most


@pytest.fixture(
    scope="module",
    params=[
        "in process",
        "TCP",
        "four wires and more over TCP",
        "RTU",
        "polled over TCP",
        "RMC over TCP",
        "RMC of another author",
        "reference in C",
        "PLC program by our translator",
        pytest.param("PLC program by matiec", marks=pytest.mark.long),
        pytest.param("polled over RTU", marks=pytest.mark.long),
        pytest.param("hardware", marks=pytest.mark.hardware),
    ],
)
def opened(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    folder = tmp_path_factory.mktemp("stand")
    if request.param == "in process":
        with backends.in_process(folder) as bench:
            yield bench
    elif request.param == "RMC of another author":
        with backends.of_another_author(folder) as bench:
            yield bench
    elif request.param == "reference in C":
        with backends.reference_in_c(folder) as bench:
            yield bench
    elif request.param.startswith("PLC program by "):
        with backends.plc_program(folder, request.param.removeprefix("PLC program by ")) as bench:
            yield bench
    elif request.param == "hardware":
        options, capture = request.config, request.config.pluginmanager.getplugin("capturemanager")

        def say(line: str) -> None:
            with capture.global_and_fixture_disabled():
                print(line, flush=True)

        path, given = Path(options.getoption("--hardware")), options.getoption("--yes-move")
        with backends.real(path, given, say) as bench:
            yield bench
    else:
        with backends.served(folder, backends.SERVED[request.param]) as bench:
            yield bench


@pytest.fixture
def bench(opened: Bench) -> Iterator[Bench]:
    opened.rest()
    yield opened
    opened.rest()


def simulated_only(bench: Bench, why: str) -> None:
    """Leave a test out on a real stand."""
    if bench.real:
        pytest.skip(f"never on a real stand: {why}")


def test_it_says_who_it_is_and_says_it_again(bench: Bench) -> None:
    identity = bench.controller.connect()
    assert identity == bench.controller.connect()
    assert identity.sample_rate_Hz == bench.controller.facts.rate_Hz > 0.0
    facts = bench.controller.facts
    assert facts.name == "controller"
    assert facts.clock == ("host" if bench.polled else "device")
    assert {"force", "stroke_1", "position", "command"} <= {channel.name for channel in facts.channels}


def test_whoever_commands_sees_no_other_program_do_so(bench: Bench) -> None:
    before = bench.controller.other_writer()
    assert not before, "nobody commands it"
    bench.enable()
    assert bench.controller.other_writer() == before, "the own right is nobody else's"


def test_nothing_is_sent_to_it_without_the_right_to(bench: Bench) -> None:
    if bench.controller.in_charge:  # before it has switched anything on
        pytest.skip("in process there is no second program, and no lock")
    before = bench.controller.seen_writer()
    assert not before.number
    for order in (bench.controller.feed_watchdog, bench.controller.disable):
        with pytest.raises(NotInCharge):
            order()
    assert bench.controller.seen_writer().feed == before.feed
    bench.enable()
    bench.controller.feed_watchdog()
    assert bench.controller.seen_writer().feed != before.feed
    bench.controller.give_back()
    assert not bench.controller.in_charge
    bench.enable()


def test_a_second_writer_is_refused_until_the_first_gives_the_right_back(bench: Bench) -> None:
    """Also with the valve off; what the second was refused has changed nothing."""
    if bench.second is None or bench.controller.other_writer() is None:
        pytest.skip("no second program can reach it, or it has no lock")
    second = bench.second()
    try:
        bench.enable()
        held = second.other_writer()
        assert held
        for valve in ("on", "off"):
            for order in (lambda: second.start(StandStill()), lambda: switched_on(second)):
                with pytest.raises(DeviceFault, match="another program") as refused:
                    order()
                assert str(held) in str(refused.value)
            with pytest.raises(NotInCharge):
                second.disable()
            with pytest.raises(NotInCharge):
                second.feed_watchdog()
            assert second.other_writer() == held
            on = bench.controller.status().state is MotionState.HOLDING
            assert on == (valve == "on")
            bench.controller.look_at_lock()
            bench.controller.disable()
        bench.controller.give_back()
        assert second.other_writer() == 0
        switched_on(second)
        with pytest.raises(DeviceFault, match="another program"):
            bench.enable()
        second.disable()
        second.give_back()
        bench.enable()
    finally:
        second.close()


def switched_on(controller: Controller) -> None:
    controller.enable(
        force_limit_kN=backends.BOUNDS.force_limit_kN,
        stroke_limit_mm=backends.BOUNDS.stroke_limit_mm,
        watchdog_ms=5000,
    )


def test_samples_follow_each_other_or_a_counted_gap_says_so(bench: Bench) -> None:
    start_s = bench.clock.now_s()
    bench.until(lambda _: bench.clock.now_s() > start_s + 2.0, feeding=False)
    assert len(bench.blocks) > 0
    after = None
    for block in bench.blocks:
        rows = len(block.time_us)
        assert block.stream == "controller"
        assert {len(column) for column in block.counts.values()} == {rows}
        assert set(block.counts) == {channel.name for channel in bench.controller.facts.channels}
        if after is not None:
            assert block.first_sequence == after + block.lost
        after = block.first_sequence + rows
    time_us = np.concatenate([block.time_us for block in bench.blocks])
    sequence = np.concatenate([b.first_sequence + np.arange(len(b.time_us)) for b in bench.blocks])
    period_us = 1e6 / bench.controller.facts.rate_Hz
    assert np.all(np.diff(time_us) > 0)
    if bench.polled:  # by the computer's clock: late, by scheduling, but no long pause without a counted gap
        pause_us = np.diff(time_us) / np.diff(sequence)
        assert np.max(pause_us) < 8.0 * period_us
    else:
        np.testing.assert_allclose(
            time_us - time_us[0], (sequence - sequence[0]) * period_us, atol=0.5 * period_us
        )
    for channel in bench.controller.facts.channels:
        assert np.all(np.isfinite(bench.values(channel.name)))


def test_its_heart_beats_while_it_is_off(bench: Bench) -> None:
    first = bench.controller.status()
    assert first.state in (MotionState.OFF, MotionState.READY)
    bench.until(lambda status: status.heartbeat != first.heartbeat, feeding=False)


def test_no_command_is_taken_while_it_is_off(bench: Bench) -> None:
    with pytest.raises(CommandRejected):
        bench.controller.start(RampTo(target_mm=0.5, speed_mm_per_s=1.0))
    with pytest.raises(CommandRejected):
        bench.controller.start(Harmonic(mean_mm=0.1, amplitude_mm=0.1, frequency_Hz=0.5, cycles=1))
    assert bench.controller.status().state in (MotionState.OFF, MotionState.READY)


def test_on_it_holds_and_off_again(bench: Bench) -> None:
    bench.enable()
    bench.until(lambda status: status.state is MotionState.HOLDING)
    bench.enable()  # on already: it stays
    assert bench.controller.status().state is MotionState.HOLDING
    bench.controller.disable()
    bench.until(lambda status: status.state in (MotionState.OFF, MotionState.READY))


def test_a_ramp_reaches_its_target_and_a_release_zero_force(bench: Bench) -> None:
    bench.enable()
    number = bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=SPEED))
    status = bench.done(number)
    assert status.end_reason is EndReason.REACHED
    # Its target has come there; the piston follows within the lag of its loop (RMC: "target done").
    assert status.position_mm == pytest.approx(10.0, abs=SPEED * LAG_S)
    bench.until(lambda status: abs(status.position_mm - 10.0) < 0.1)
    status = bench.done(bench.controller.start(Release(speed_mm_per_s=SPEED)))
    assert status.end_reason is EndReason.REACHED
    assert abs(status.force_kN) < 2.0
    bench.finish()
    assert np.max(bench.values("position")) == pytest.approx(10.0, abs=0.2)


def test_a_harmonic_makes_its_cycles_about_its_mean(bench: Bench) -> None:
    bench.enable()
    bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=SPEED)))
    bench.finish()
    bench.blocks.clear()
    number = bench.controller.start(Harmonic(mean_mm=10.0, amplitude_mm=4.0, frequency_Hz=1.0, cycles=3))
    status = bench.done(number)
    assert (status.end_reason, status.cycles_done) == (EndReason.REACHED, 3)
    bench.finish()
    position = bench.values("position")
    # A position loop of 15 Hz follows 1 Hz to 0.2 %; of 100 points one is 0.05 % off the peak at most.
    assert np.max(position) == pytest.approx(14.0, abs=0.2)
    assert np.min(position) == pytest.approx(6.0, abs=0.2)


def test_a_harmonic_away_from_its_mean_is_refused(bench: Bench) -> None:
    simulated_only(bench, "a controller that took it would jump to the mean")
    bench.enable()
    with pytest.raises(CommandRejected):
        bench.controller.start(Harmonic(mean_mm=15.0, amplitude_mm=2.0, frequency_Hz=0.5, cycles=1))


def test_a_running_sine_is_changed_where_the_controller_can(bench: Bench) -> None:
    bench.enable()
    bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=SPEED)))
    number = bench.controller.start(Harmonic(mean_mm=10.0, amplitude_mm=4.0, frequency_Hz=1.0, cycles=8))
    bench.until(lambda status: status.cycles_done >= 1)
    if not bench.controller.can_adjust:
        with pytest.raises(CommandRejected):
            bench.controller.adjust_harmonic(mean_mm=10.2, amplitude_mm=4.4)
        assert bench.done(number).end_reason is EndReason.REACHED
        return
    bench.controller.adjust_harmonic(mean_mm=10.2, amplitude_mm=4.4)
    status = bench.done(number)
    assert (status.end_reason, status.cycles_done) == (EndReason.REACHED, 8)
    bench.finish()
    position = bench.values("position")
    moving = np.flatnonzero(np.abs(position - position[-1]) > 2.0)  # behind the sine it stands at its mean
    rate_Hz = bench.controller.facts.rate_Hz
    last = position[moving[-1] - round(2.5 * rate_Hz) : moving[-1]]  # its last cycle fades out
    assert 0.5 * (np.max(last) + np.min(last)) == pytest.approx(10.2, abs=0.1)
    assert 0.5 * (np.max(last) - np.min(last)) == pytest.approx(4.4, abs=0.1)
    bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=SPEED)))
    with pytest.raises(CommandRejected):
        bench.controller.adjust_harmonic(mean_mm=10.0, amplitude_mm=4.0)  # nothing runs


def test_static_cycles_turn_at_the_force(bench: Bench) -> None:
    bench.enable()
    number = bench.controller.start(
        StaticCycles(speed_mm_per_s=SPEED, force_limit_kN=35.0, stroke_limit_mm=16.0, cycles=2, pause_s=0.2)
    )
    status = bench.done(number)
    assert (status.end_reason, status.cycles_done) == (EndReason.FORCE_LIMIT, 2)
    bench.finish()
    assert 34.0 < np.max(bench.values("force")) < 45.0


def test_hold_ends_a_motion(bench: Bench) -> None:
    bench.enable()
    moving = bench.controller.start(RampTo(target_mm=14.0, speed_mm_per_s=1.0))
    bench.until(lambda status: status.state is MotionState.RAMPING)
    number = bench.controller.start(StandStill())
    assert number != moving
    status = bench.done(number)
    assert status.state is MotionState.HOLDING
    assert status.position_mm < 13.0


def refused_and_unmoved(bench: Bench, **ramp: float) -> None:
    before = bench.controller.status()
    with pytest.raises(CommandRejected):
        bench.controller.start(RampTo(**ramp))
    after = bench.controller.status()
    assert after.state is MotionState.HOLDING
    assert after.command_mm == pytest.approx(before.command_mm, abs=0.02)


def test_a_ramp_beyond_the_limit_that_was_set_is_refused(bench: Bench) -> None:
    bench.enable(stroke_limit_mm=5.0)
    refused_and_unmoved(bench, target_mm=5.5, speed_mm_per_s=5.0)


def test_a_ramp_without_speed_is_refused(bench: Bench) -> None:
    bench.enable()  # its target is where it stands: whoever takes 0 for “as fast as it goes” has no way to go
    here_mm = max(0.0, bench.controller.status().position_mm)
    refused_and_unmoved(bench, target_mm=min(here_mm, 1.0), speed_mm_per_s=0.0)


@pytest.mark.parametrize(
    "command",
    [
        {"target_mm": 61.0, "speed_mm_per_s": SPEED},
        {"target_mm": 10.0, "speed_mm_per_s": 6000.0},
        {"target_mm": 1e9, "speed_mm_per_s": SPEED},
    ],
)
def test_what_would_be_dangerous_is_refused(bench: Bench, command: dict[str, float]) -> None:
    simulated_only(bench, "a controller that took it would do harm")
    bench.enable()
    refused_and_unmoved(bench, **command)


def test_unfed_it_falls_back_to_zero_force_and_off(bench: Bench) -> None:
    trips = bench.controller.status().watchdog_trips
    bench.enable(watchdog_ms=1000)
    bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=SPEED)))
    status = bench.until(lambda seen: seen.state is MotionState.FAULT, feeding=False)
    assert (status.fault_code, status.watchdog_trips) == (1, trips + 1)
    assert abs(status.force_kN) < 2.0
    with pytest.raises(CommandRejected):
        bench.controller.start(RampTo(target_mm=0.5, speed_mm_per_s=1.0))
    bench.enable()
    assert bench.controller.status().state is MotionState.HOLDING
    assert any("reset" in event for event in bench.controller.events())


def test_polling_says_what_it_costs(opened: Bench) -> None:
    """In the stream's description and its channels, which both go into every run."""
    facts = opened.controller.facts
    assert opened.polled == ("POLLED, not sampled by the device" in facts.device)
    if not opened.polled:
        return
    by_name = {channel.name: channel for channel in facts.channels}
    assert (by_name["force"].uncertainty.u_delay_s or 0.0) > 2e-5  # more than the stand file states
    assert by_name["force"].delay_s > 0.0008  # it is read before the stroke
    assert "makes the damping uncertain by" in facts.device
