from __future__ import annotations

import math
import re
import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.drivers.modbus import link as modbus_link
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.register_maps.profile import Profile, load_profile
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import CommandRejected, DeviceFault, NotInCharge
from bufferstand.foundation.motions import Harmonic, RampTo, Release, StandStill, StaticCycles
from tests.drivers import servers
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.profiles import plain_ring
from tests.drivers.ring_device import RingDevice

CHANNELS = load_stand(SAMPLE_STAND).controller.channel


def controller_at(port: int, profile: Profile, timeout_s: float = 0.5) -> RingController:
    link = ModbusLink(TcpWire("127.0.0.1", port), timeout_s=timeout_s)
    return RingController(link, profile, CHANNELS, WallClock(), timeout_s=timeout_s)


@contextmanager
def raw_port(device: RingDevice) -> Iterator[int]:
    with servers.raw_server(device) as server:
        yield server.port


SERVERS: dict[str, Callable[[RingDevice], AbstractContextManager[int]]] = {
    "raw": raw_port,
    "pymodbus": servers.pymodbus_server,
    "pyModbusTCP": servers.pymodbustcp_server,
}


@pytest.fixture(params=list(SERVERS))
def pair(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[RingController, RingDevice]]:
    """A connected controller on each server implementation."""
    profile = load_profile("ring")
    device = RingDevice(profile)
    with SERVERS[request.param](device) as port:
        controller = controller_at(port, profile)
        controller.connect()
        yield controller, device
        controller.close()


class TestOnEachServer:
    def test_identity(self, pair: tuple[RingController, RingDevice]) -> None:
        controller, _ = pair
        identity = controller.connect()
        assert identity.device == "bufferstand-ring"
        assert identity.serial == "630001"
        assert identity.sample_rate_Hz == 1000.0
        assert "127.0.0.1" in identity.address
        assert controller.facts.rate_Hz == 1000.0
        assert controller.facts.clock == "device"
        assert [channel.name for channel in controller.facts.channels] == [
            "force", "stroke_1", "stroke_2", "position", "command",
        ]  # fmt: skip

    def test_status(self, pair: tuple[RingController, RingDevice]) -> None:
        controller, device = pair
        for name, value in (
            ("state", 4), ("done_sequence", 12), ("end_reason", 2), ("cycles_done", 70_000),
            ("fault_code", 0), ("watchdog_trips", 3),
            ("force", 123.5), ("stroke", 25.25), ("position", -1.5), ("command", 26.0),
        ):  # fmt: skip
            device.set(name, value)
        status = controller.status()
        assert status.state is MotionState.WAVEFORM
        assert status.end_reason is EndReason.FORCE_LIMIT
        assert (status.done_sequence, status.cycles_done, status.watchdog_trips) == (12, 70_000, 3)
        assert (status.force_kN, status.stroke_mm, status.position_mm, status.command_mm) == (
            123.5, 25.25, -1.5, 26.0,
        )  # fmt: skip
        assert controller.status().heartbeat == (status.heartbeat + 1) % 0x10000

    def test_samples_whole_and_in_order(self, pair: tuple[RingController, RingDevice]) -> None:
        controller, device = pair
        assert controller.read_block() is None
        device.sample(100)
        blocks = []
        while (block := controller.read_block()) is not None:
            blocks.append(block)
        true = device.rows(0, 100)
        for name in ("force", "stroke_1", "stroke_2", "position", "command"):
            np.testing.assert_array_equal(np.concatenate([b.counts[name] for b in blocks]), true[name])
        np.testing.assert_array_equal(np.concatenate([b.time_us for b in blocks]), true["tick"])
        assert {block.stream for block in blocks} == {"controller"}
        assert controller.events() == []

    def test_commands_reach_the_device(self, pair: tuple[RingController, RingDevice]) -> None:
        controller, device = pair
        numbers = [
            controller.start(StandStill()),
            controller.start(RampTo(target_mm=25.5, speed_mm_per_s=2.5)),
            controller.start(Harmonic(mean_mm=50.0, amplitude_mm=12.5, frequency_Hz=1.25, cycles=12)),
            controller.start(
                StaticCycles(
                    speed_mm_per_s=50.0, force_limit_kN=595.0, stroke_limit_mm=105.0, cycles=3, pause_s=60.0
                )
            ),
            controller.start(Release(speed_mm_per_s=10.0)),
        ]
        assert numbers == [1, 2, 3, 4, 5]
        names = ["target", "speed", "mean", "amplitude", "frequency", "cycles"]
        names += ["turning_force", "turning_stroke", "static_pause"]
        got = [
            {name: command[name] for name in names if command[name]} | {"code": command["command_code"]}
            for command in device.executed
        ]
        assert got == [
            {"code": 1},
            {"code": 2, "target": 25.5, "speed": 2.5},
            {"code": 3, "mean": 50.0, "amplitude": 12.5, "frequency": 1.25, "cycles": 12},
            {"code": 4, "speed": 50.0, "turning_force": 595.0, "turning_stroke": 105.0, "cycles": 3,
             "static_pause": 60.0},
            {"code": 5, "speed": 10.0},
        ]  # fmt: skip

    def test_a_running_sine_is_changed_by_command_6(self, pair: tuple[RingController, RingDevice]) -> None:
        controller, device = pair
        assert controller.can_adjust
        number = controller.start(Harmonic(mean_mm=50.0, amplitude_mm=12.5, frequency_Hz=1.25, cycles=12))
        controller.adjust_harmonic(mean_mm=50.25, amplitude_mm=12.75)
        last = device.executed[-1]
        assert last["command_sequence"] == number + 1
        assert {name for name, value in last.items() if value} == {
            "command_sequence", "command_code", "mean", "amplitude",
        }  # fmt: skip
        assert (last["command_code"], last["mean"], last["amplitude"]) == (6, 50.25, 12.75)

    def test_a_device_of_edition_2_is_driven_as_ever(self, pair: tuple[RingController, RingDevice]) -> None:
        controller, device = pair
        device.set("profile_version", 2)
        identity = controller.connect()
        assert "edition 3 (the device: 2) sha256" in identity.profile
        assert not controller.can_adjust
        with pytest.raises(CommandRejected, match="this controller has no such command"):
            controller.adjust_harmonic(mean_mm=50.0, amplitude_mm=12.0)
        assert device.executed == []

    def test_on_and_off(self, pair: tuple[RingController, RingDevice]) -> None:
        controller, device = pair
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=2000)
        assert device.control_words == [0x0006, 0x0007, 0x000F]
        assert controller.status().state is MotionState.HOLDING
        assert (device.get("force_limit"), device.get("stroke_limit")) == (600.0, 150.0)
        assert device.get("watchdog_time") == 2000
        controller.enable(force_limit_kN=500.0, stroke_limit_mm=150.0, watchdog_ms=2000)
        assert device.control_words == [0x0006, 0x0007, 0x000F, 0x000F]  # never off and on again
        controller.feed_watchdog()
        controller.feed_watchdog()
        assert len(device.fed) == len(set(device.fed)) == 4  # each enabling feeds it too
        controller.disable()
        assert controller.status().state is MotionState.OFF


@pytest.fixture
def device(profile: Profile) -> RingDevice:
    return RingDevice(profile)


@pytest.fixture
def server(device: RingDevice) -> Iterator[servers.RawServer]:
    with servers.raw_server(device) as raw:
        yield raw


@pytest.fixture
def controller(server: servers.RawServer, profile: Profile) -> Iterator[RingController]:
    one = controller_at(server.port, profile, timeout_s=0.25)
    yield one
    one.close()


class TestIdentity:
    @pytest.mark.parametrize(
        ("name", "value", "message"),
        [
            (
                "device_type", 0x1234,
                "register device_type (address 0) holds 0x1234 instead of 0x4253: another device",
            ),
            (
                "profile_version", 1,
                "register profile_version (address 1) holds 0x1 instead of 0x3: its firmware has another",
            ),
            (
                "test_float", 1.5,
                "register test_float (address 2) holds 1.5 instead of -1234.5: the test value is wrong",
            ),
            (
                "test_integer", 7,
                "register test_integer (address 4) holds 0x7 instead of 0x12345678: the test value is wrong",
            ),
            ("sample_rate", 0.0, "it states a sample rate of 0.0 Hz"),
        ],
    )  # fmt: skip
    def test_each_wrong_value_has_its_message(
        self, controller: RingController, device: RingDevice, name: str, value: float, message: str
    ) -> None:
        device.set(name, value)
        with pytest.raises(DeviceFault, match=re.escape(message)) as caught:
            controller.connect()
        assert str(caught.value).startswith("controller at 127.0.0.1:")

    def test_swapped_words_are_told(self, controller: RingController, device: RingDevice) -> None:
        for start in (2, 4, 6, 8):
            device.words[start : start + 2] = device.words[start : start + 2][::-1]
        with pytest.raises(
            DeviceFault, match="the profile says word_order = “big”, the device sends “little”"
        ):
            controller.connect()

    def test_swapped_bytes_are_told(self, controller: RingController, device: RingDevice) -> None:
        device.words[:10] = [word >> 8 | (word & 0xFF) << 8 for word in device.words[:10]]
        with pytest.raises(DeviceFault, match="the bytes inside its registers are swapped"):
            controller.connect()

    @pytest.mark.parametrize(
        ("shift", "message"),
        [(1, "one too high by address: device_type is at 1, not 0"), (-1, "one too low by address")],
    )
    def test_addresses_off_by_one_are_told(
        self, controller: RingController, device: RingDevice, shift: int, message: str
    ) -> None:
        words = device.words[:10]
        device.words[:11] = [0, *words] if shift == 1 else [*words[1:], 0, 0]
        with pytest.raises(DeviceFault, match=message):
            controller.connect()

    def test_a_changed_rate_is_refused(self, controller: RingController, device: RingDevice) -> None:
        controller.connect()
        device.set("sample_rate", 500.0)
        with pytest.raises(DeviceFault, match="its sample rate changed from 1000 to 500 Hz"):
            controller.connect()

    def test_samples_before_connecting_are_refused(self, controller: RingController) -> None:
        with pytest.raises(DeviceFault, match="samples were asked for before connecting"):
            controller.read_block()

    def test_an_unknown_state_is_refused(self, controller: RingController, device: RingDevice) -> None:
        device.set("state", 9)
        with pytest.raises(DeviceFault, match="status registers: 9 is not a valid MotionState"):
            controller.status()


class TestRing:
    def test_a_lost_reply_loses_and_doubles_nothing(
        self, controller: RingController, device: RingDevice, server: servers.RawServer
    ) -> None:
        controller.connect()
        device.sample(60)
        server.replies = [servers.truly, servers.silent, servers.truly, servers.dropped]
        blocks = []
        while (block := controller.read_block()) is not None:
            blocks.append(block)
        sequences = np.concatenate([b.first_sequence + np.arange(len(b.time_us)) for b in blocks])
        np.testing.assert_array_equal(sequences, np.arange(60))
        assert all(block.lost == 0 for block in blocks)
        assert len([event for event in controller.events() if "sent once more" in event]) == 2

    def test_a_gap_is_in_the_block_and_in_the_events(
        self, controller: RingController, device: RingDevice
    ) -> None:
        controller.connect()
        device.sample(14)
        assert controller.read_block() is not None
        device.sample(4096 + 100)
        block = controller.read_block()
        assert block is not None
        assert block.lost == 100
        assert block.first_sequence == 114
        assert list(controller.events()) == [
            "100 samples lost before sequence 114: the ring was read too late (overrun counter +1)"
        ]

    def test_missed_cycles_come_as_a_counted_gap_in_their_place(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.missed = {5: 1, 9: 3}
        controller.connect()
        device.sample(20)
        blocks = []
        while (block := controller.read_block()) is not None:
            blocks.append(block)
        assert [(b.first_sequence, len(b.time_us), b.lost, b.missed) for b in blocks] == [
            (0, 5, 0, 0), (5, 4, 1, 1), (9, 5, 3, 3), (14, 6, 0, 0),
        ]  # fmt: skip
        assert [b.more for b in blocks[:3]] == [True, True, True]
        assert controller.events() == []

    def test_what_the_ring_holds_from_before_is_skipped_and_not_lost(
        self, controller: RingController, device: RingDevice
    ) -> None:
        controller.connect()
        device.sample(3000)
        device.set("tick", 3000 * 1000)  # its clock now
        controller.skip_backlog()
        sequence: list[int] = []
        while (block := controller.read_block()) is not None:
            assert block.lost == 0
            sequence += range(block.first_sequence, block.first_sequence + len(block.time_us))
        assert sequence == list(range(sequence[0], 3000))
        assert 2750 < sequence[0] < 2850  # 0.2 s are kept
        assert controller.events() == []
        controller.skip_backlog()  # nothing lies behind: nothing changes
        device.sample(5)
        block = controller.read_block()
        assert block is not None
        assert (block.first_sequence, block.lost) == (3000, 0)

    def test_one_torn_block_is_asked_for_again(
        self, controller: RingController, device: RingDevice, server: servers.RawServer
    ) -> None:
        controller.connect()
        device.sample(15)

        def torn(wire: socket.socket, header: bytes, pdu: bytes) -> None:
            wire.sendall(servers.framed(header, pdu[:60] + pdu[44:60] + pdu[76:]))

        server.replies = [torn]
        block = controller.read_block()
        assert block is not None
        np.testing.assert_array_equal(block.time_us, np.arange(14) * 1000)
        refused, reopened = controller.events()
        assert refused.startswith("block of samples refused: the block's CRC does not fit its content")
        assert reopened.endswith("opened again")
        assert server.connections == 2

    def test_a_restarted_controller_is_a_fault(self, controller: RingController, device: RingDevice) -> None:
        controller.connect()
        device.sample(30)
        while controller.read_block():
            pass
        device.oldest = device.newest = 0
        device.sample(3)
        with pytest.raises(DeviceFault, match="two blocks of samples running cannot be true") as caught:
            controller.read_block()
        assert "the controller has restarted, or another program reads its ring" in str(caught.value)
        assert len([event for event in controller.events() if "refused" in event]) == 2


class TestCommands:
    @pytest.mark.parametrize(
        ("code", "reason"),
        [
            (1, "unknown command"),
            (2, "not possible in the present state"),
            (3, "a parameter is out of range"),
            (4, "the command was not armed"),
            (9, "unknown reason 9"),
        ],
    )
    def test_a_rejection_names_command_and_reason(
        self, controller: RingController, device: RingDevice, code: int, reason: str
    ) -> None:
        device.reject = code
        with pytest.raises(CommandRejected) as caught:
            controller.start(RampTo(target_mm=300.0, speed_mm_per_s=5.0))
        assert str(caught.value) == (
            f"controller rejected arming ramp to 300 mm at 5 mm/s (command 2, sequence 1): {reason} "
            "(it is “switch-on disabled”)"
        )
        assert device.executed == []

    def test_a_modbus_exception_is_a_rejection_too(
        self, controller: RingController, device: RingDevice, server: servers.RawServer
    ) -> None:
        server.replies = [*[servers.truly] * 4, servers.with_exception(4)]  # status, lock (3), arming
        with pytest.raises(
            CommandRejected, match=r"refused arming ramp .*it gave no reason \(Modbus exception 4\)"
        ):
            controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        assert device.executed == []

    def test_a_device_that_does_not_judge_is_a_fault(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.judge = lambda: None  # type: ignore[method-assign]
        with pytest.raises(DeviceFault, match=r"arming ramp .*: not judged within 0\.25 s") as caught:
            controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        assert not isinstance(caught.value, CommandRejected)

    @pytest.mark.parametrize("at", range(7))
    def test_whichever_reply_is_lost_a_motion_starts_once(
        self, controller: RingController, device: RingDevice, server: servers.RawServer, at: int
    ) -> None:
        server.replies = [*[servers.truly] * (at + 1), servers.silent]
        assert controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0)) == 1
        assert [command["command_sequence"] for command in device.executed] == [1]

    @pytest.mark.slow
    def test_numbering_goes_on_where_the_last_program_ended(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.set("echo_sequence", 65534)
        assert [controller.start(StandStill()) for _ in range(3)] == [65535, 1, 2]  # 0 means none

    @pytest.mark.slow
    @pytest.mark.parametrize("bad", [math.nan, math.inf, 1e39])
    def test_what_is_no_number_is_not_sent(
        self, controller: RingController, server: servers.RawServer, bad: float
    ) -> None:
        with pytest.raises(CommandRejected, match="was not sent: "):
            controller.start(RampTo(target_mm=bad, speed_mm_per_s=1.0))
        assert all(request[0] == 23 for request in server.requests)  # the status


class TestAtOnce:
    @pytest.mark.slow
    def test_a_hold_goes_with_the_first_request_and_is_looked_at_afterwards(
        self, controller: RingController, device: RingDevice, server: servers.RawServer
    ) -> None:
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        assert controller.stops_at_once
        controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        before = len(server.requests)
        number = controller.start(StandStill())
        requests = server.requests[before:]
        assert [request[0] for request in requests] == [16, 23, 3], "block and execute, status, read back"
        assert struct.unpack(">HH", requests[0][1:5]) == (64, 21), "command_sequence … execute"
        assert [command["command_code"] for command in device.executed] == [1, 2, 1]
        assert device.executed[-1]["command_sequence"] == number

    @pytest.mark.slow
    def test_so_does_a_release_in_a_hurry(
        self, controller: RingController, device: RingDevice, server: servers.RawServer
    ) -> None:
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        before = len(server.requests)
        device.set("state", 5)
        controller.start(Release(speed_mm_per_s=20.0), hurry=True)
        assert [request[0] for request in server.requests[before:]] == [16, 23, 3]
        assert (device.executed[-1]["command_code"], device.executed[-1]["speed"]) == (5, 20.0)

    @pytest.mark.slow
    @pytest.mark.parametrize("how", ["refused", "armed only"])
    def test_a_controller_that_takes_no_command_in_one_request_is_known_before_anything_moves(
        self, controller: RingController, device: RingDevice, server: servers.RawServer, how: str
    ) -> None:
        write = device.write

        def in_parts(address: int, values: list[int]) -> None:
            write(address, values[:20] if address == 64 else values)

        def refusing(pdu: bytes) -> bytes:
            if pdu[0] == 16 and struct.unpack(">HH", pdu[1:5]) == (64, 21):
                return bytes([0x90, 2])
            return answer(pdu)

        answer = server._answer
        if how == "refused":
            server._answer = refusing  # type: ignore[method-assign]
        else:
            device.write = in_parts  # type: ignore[method-assign]
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        assert not controller.stops_at_once
        (event,) = controller.events()
        exception = " (Modbus exception 2)" if how == "refused" else ""
        assert event.startswith(
            f"controller does not take a command and its execution in one request{exception}: a stop releases"
        )
        before = len(server.requests)
        controller.start(StandStill())
        assert [request[0] for request in server.requests[before:]] == [16, 6, 23, 3]
        assert device.executed[-1]["command_code"] == 1

    @pytest.mark.slow
    def test_one_that_was_never_tried_is_told_in_two_requests_where_it_only_arms(
        self, controller: RingController, device: RingDevice
    ) -> None:
        write = device.write

        def in_parts(address: int, values: list[int]) -> None:
            write(address, values[:20] if address == 64 else values)

        device.write = in_parts  # type: ignore[method-assign]
        device.set("state", 3)
        controller.start(StandStill())
        assert [command["command_code"] for command in device.executed] == [1]

    @pytest.mark.slow
    def test_an_altered_hold_is_seen_afterwards_and_given_anew(
        self, controller: RingController, device: RingDevice
    ) -> None:
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        controller.events()
        write = device.write
        altered: list[list[int]] = []

        def altering(address: int, values: list[int]) -> None:
            if address == 64 and not altered:
                altered.append(values)
                values = [*values[:4], values[4] ^ 0x40, *values[5:]]
            write(address, values)

        device.write = altering  # type: ignore[method-assign]
        controller.start(StandStill())
        (event,) = controller.events()
        assert "it reads back as" in event
        assert event.endswith("given anew")
        assert [command["command_code"] for command in device.executed] == [1, 1, 1]

    @pytest.mark.slow
    def test_in_a_hurry_a_lost_reply_is_not_waited_for(
        self,
        controller: RingController,
        device: RingDevice,
        server: servers.RawServer,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        monkeypatch.setattr(modbus_link, "HURRY_S", 10.0)  # on a busy computer the other replies are late
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        before = len(server.requests)
        server.replies = [servers.silent]
        with pytest.raises(DeviceFault, match=r"hold .*no reply within 0\.\d+ s"):
            controller.start(StandStill())
        assert len(server.requests) == before + 1, "sent once"
        controller.start(Release(speed_mm_per_s=20.0), hurry=True)
        assert [command["command_code"] for command in device.executed][-2:] == [1, 5]


class TestLookingBetween:
    @pytest.mark.slow
    def test_there_is_a_look_before_each_request_of_a_command_but_the_first_one_of_a_stop(
        self, controller: RingController, server: servers.RawServer
    ) -> None:
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        at: list[int] = []

        def look() -> None:
            at.append(len(server.requests) - before)

        for give, looks in (
            (lambda: controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0)), [0, 1, 2, 3, 4, 5]),
            (lambda: controller.start(StandStill()), [1, 2]),
        ):
            before = len(server.requests)
            at.clear()
            with controller.look_between(look):
                give()
            assert at == looks
            assert len(server.requests) - before == looks[-1] + 1
        controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        assert at == [1, 2], "outside nobody looks"

    @pytest.mark.slow
    def test_what_a_look_raises_ends_the_command_before_it_moves(
        self, controller: RingController, device: RingDevice
    ) -> None:
        looks = 0

        def trip() -> None:
            nonlocal looks
            looks += 1
            if looks == 4:
                raise KeyError("a guard")

        with pytest.raises(KeyError), controller.look_between(trip):
            controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        assert device.executed == []
        controller.start(RampTo(target_mm=20.0, speed_mm_per_s=5.0))
        assert [command["target"] for command in device.executed] == [20.0]

    @pytest.mark.slow
    def test_the_controllers_clock_is_kept_from_when_it_showed_that_it_had_taken_a_command(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.set("tick", 123_456)
        controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        assert controller.taken_us == 123_456


class TestReadyRelease:
    @pytest.mark.slow
    def test_it_can_be_begun_as_soon_as_it_was_written_and_is_read_back_then(
        self, controller: RingController, device: RingDevice, server: servers.RawServer
    ) -> None:
        controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        looks = 0

        def trip() -> None:
            nonlocal looks
            looks += 1
            if looks == 2:  # it is written, and not judged yet
                raise KeyError("a guard")

        with pytest.raises(KeyError), controller.look_between(trip):
            controller.prepare(Release(speed_mm_per_s=20.0))
        before = len(server.requests)
        controller.start(Release(speed_mm_per_s=20.0), hurry=True)
        assert [request[0] for request in server.requests[before:]] == [6, 23, 3]
        assert [command["command_code"] for command in device.executed] == [2, 5]

    @pytest.mark.slow
    def test_it_takes_one_write_and_one_look(
        self, controller: RingController, device: RingDevice, server: servers.RawServer
    ) -> None:
        controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0))
        controller.prepare(Release(speed_mm_per_s=20.0))
        assert [command["command_code"] for command in device.executed] == [2], "it is ready, not begun"
        before = len(server.requests)
        assert controller.start(Release(speed_mm_per_s=20.0)) == 2
        assert [request[0] for request in server.requests[before:]] == [6, 23]
        assert [command["command_code"] for command in device.executed] == [2, 5]

    @pytest.mark.slow
    def test_another_speed_or_another_command_is_armed_as_ever(
        self, controller: RingController, device: RingDevice
    ) -> None:
        controller.prepare(Release(speed_mm_per_s=20.0))
        controller.start(Release(speed_mm_per_s=10.0))
        assert device.executed[-1]["speed"] == 10.0
        controller.prepare(Release(speed_mm_per_s=20.0))
        controller.start(StandStill())
        controller.start(Release(speed_mm_per_s=20.0))
        assert [command["command_code"] for command in device.executed] == [5, 1, 5]

    @pytest.mark.slow
    def test_a_controller_that_has_dropped_it_is_told_anew(
        self, controller: RingController, device: RingDevice
    ) -> None:
        controller.prepare(Release(speed_mm_per_s=20.0))
        device.set("command_sequence", 999)  # as when it was switched off and on meanwhile
        number = controller.start(Release(speed_mm_per_s=20.0))
        assert device.executed[-1]["command_sequence"] == number
        assert device.executed[-1]["speed"] == 20.0


class TestSwitch:
    @pytest.mark.slow
    def test_a_latched_fault_is_reset_and_told(self, controller: RingController, device: RingDevice) -> None:
        device.set("status_word", 0x0208)
        device.set("fault_code", 1)
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        assert device.control_words == [0x0000, 0x0080, 0x0006, 0x0007, 0x000F]
        assert list(controller.events()) == [
            "fault 1 (watchdog: no heartbeat from the computer) of the controller was reset"
        ]

    @pytest.mark.slow
    def test_a_fault_is_reset_alone_and_the_valve_stays_off(
        self, controller: RingController, device: RingDevice
    ) -> None:
        controller.reset_fault()
        assert device.control_words == [], "there is none"
        device.set("status_word", 0x0208)
        device.set("fault_code", 2)
        controller.reset_fault()
        assert device.control_words == [0x0000, 0x0080, 0x0000]
        assert list(controller.events()) == [
            "fault 2 (force limit of the device) of the controller was reset"
        ]

    @pytest.mark.slow
    def test_no_fault_is_reset_under_force_or_with_the_valve_on(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.set("fault_code", 2)
        for word, force_kN, why in (
            (0x0208, -5.5, r"the force is -5.5 kN, and at most 5 kN may be left; unload the specimen"),
            (0x020F, 0.0, r"the valve is still on, it takes the force away"),
        ):
            device.set("status_word", word)
            device.set("force", force_kN)
            for switch in (
                controller.reset_fault,
                lambda: controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000),
            ):
                with pytest.raises(DeviceFault, match=rf"force limit of the device\) was not reset: {why}"):
                    switch()
        assert device.control_words == []

    @pytest.mark.slow
    def test_a_fault_that_stays_is_named(self, controller: RingController, device: RingDevice) -> None:
        device.set("status_word", 0x0208)
        device.set("fault_code", 4)
        device.obedient = False
        with pytest.raises(
            DeviceFault, match=r"did not show reset of fault 4 \(actuator\) within 0.25 s"
        ) as caught:
            controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        assert "it is “fault” (status word 0x0208), fault 4 (actuator)" in str(caught.value)
        assert "look at emergency stop, interlocks and hydraulics" in str(caught.value)

    @pytest.mark.slow
    def test_an_actuator_that_does_not_come_on_is_a_fault(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.obedient = False
        with pytest.raises(DeviceFault, match="did not show “operation enabled” after control word 0x000F"):
            controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)

    @pytest.mark.slow
    def test_an_actuator_that_stays_on_is_a_fault(
        self, controller: RingController, device: RingDevice
    ) -> None:
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        device.obedient = False
        with pytest.raises(DeviceFault, match="did not show the actuator off after control word 0x0000"):
            controller.disable()

    @pytest.mark.slow
    def test_limits_that_are_not_kept_are_a_fault(
        self, controller: RingController, device: RingDevice
    ) -> None:
        true_write = device.write

        def bounded(address: int, values: list[int]) -> None:
            true_write(address, values)
            device.set("force_limit", min(device.get("force_limit"), 500.0))

        device.write = bounded  # type: ignore[method-assign]
        with pytest.raises(DeviceFault, match=r"read back as \{'force_limit': 500.0, .* instead of .* 600.0"):
            controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        assert device.control_words == []  # never switched on

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"watchdog_ms": 0}, "watchdog of 0 ms was not sent"),
            ({"watchdog_ms": 70_000}, "watchdog of 70000 ms was not sent"),
            ({"force_limit_kN": math.nan}, "limits of nan kN and 150.0 mm were not sent"),
            ({"stroke_limit_mm": -1.0}, "limits of 600.0 kN and -1.0 mm were not sent"),
        ],
    )
    def test_limits_that_are_none_are_not_sent(
        self, controller: RingController, server: servers.RawServer, changes: dict[str, float], message: str
    ) -> None:
        good = {"force_limit_kN": 600.0, "stroke_limit_mm": 150.0, "watchdog_ms": 1000}
        with pytest.raises(CommandRejected, match=message):
            controller.enable(**(good | changes))  # type: ignore[arg-type]
        assert server.requests == []

    @pytest.mark.slow
    def test_a_new_program_feeds_with_a_changed_value(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.set("watchdog_feed", 65535)
        with pytest.raises(NotInCharge, match="has not the right to give it commands; nothing was sent"):
            controller.feed_watchdog()
        assert device.fed == []
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=150.0, watchdog_ms=1000)
        assert device.fed == [0]


@pytest.mark.slow
def test_the_pymodbustcp_server_refuses_a_full_window() -> None:
    """Why the shipped window is smaller: not every server grants FC23 its 125 registers."""
    profile = plain_ring()
    device = RingDevice(profile)
    with servers.pymodbustcp_server(device) as port:
        controller = controller_at(port, profile)
        controller.connect()
        with pytest.raises(
            DeviceFault, match=r"exchanging the sample ring .*exception 3 \(illegal data value\)"
        ):
            controller.read_block()
        controller.close()
