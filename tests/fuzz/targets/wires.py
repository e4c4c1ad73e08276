"""Wires: both sides of Modbus, serial frames and dialogues, streams and uploads. Nothing is waited for."""

from __future__ import annotations

import asyncio
import os
import socket
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any, cast

import numpy as np
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.framer.rtu import FramerRTU

from bufferstand.drivers.acquisition.labjack.packets import (
    HEAD_BYTES,
    NotAPacketError,
    body_bytes,
    packet_of,
    reply_of,
)
from bufferstand.drivers.acquisition.labjack.scans import ScanAssembly
from bufferstand.drivers.amplifiers.aed.values import continuous_decoder, single_decoder
from bufferstand.drivers.amplifiers.ascii_line.amplifier import AsciiLineDialect, ReplyDecoder
from bufferstand.drivers.amplifiers.gsv2.amplifier import Gsv2Dialect
from bufferstand.drivers.amplifiers.gsv2.frames import LONG, SHORT, FrameDecoder
from bufferstand.drivers.amplifiers.text_values import LineDecoder, decimal_counts
from bufferstand.drivers.controllers.ring_reader import DoubtfulBlock, RingReader
from bufferstand.drivers.controllers.rmc.plot import CONTINUOUS
from bufferstand.drivers.controllers.rmc.registers import words_of
from bufferstand.drivers.modbus.link import Exchange, ModbusLink
from bufferstand.drivers.modbus.wires import TcpWire, with_quick_replies
from bufferstand.drivers.register_maps.coding import crc_of, pack
from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.serial_line import SerialLine
from bufferstand.drivers.simulated.wires import modbus_tcp
from bufferstand.drivers.simulated.wires.modbus_requests import Responder
from bufferstand.drivers.simulated.wires.modbus_rtu import RtuStandServer
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.thermometers.ds18b20 import decode_temperature, decode_w1_slave
from bufferstand.drivers.thermometers.ds2480b.adapter import Ds2480b
from tests.drivers.ring_device import PERIOD_US, RingDevice
from tests.drivers.test_ascii_line import ANSWERS, lines_of
from tests.drivers.test_noisy_wire import Bank
from tests.drivers.test_rmc_plot import SAMPLES as PLOT_SAMPLES
from tests.drivers.test_rmc_plot import UPLOAD, Plot
from tests.fuzz.mutators import either, joined, of_pieces, of_text, pieces
from tests.fuzz.target import WELL_ENDED, Altered, Case, Mutate, Target
from tests.fuzz.targets.from_files import SAMPLES
from tests.hostile.mutations import mutated

Begin = Callable[[Path], AbstractContextManager[Case]]
SOON_S = 0.002
"""A reply is there when it is looked for; there is nothing to wait for but its absence."""


def crc(frame: bytes) -> bytes:
    """Return a frame with its check sum behind it (Modbus over serial line 1.02, 2.5.1.2)."""
    return frame + FramerRTU.compute_CRC(frame).to_bytes(2, "big")


# --- Modbus: the client ----------------------------------------------------------------------------

HOLDING = [(7919 * number) % 65536 for number in range(256)]


def _true_reply(request: bytes) -> bytes:
    """Return what a true device answers to a request (function code and data)."""
    function = request[0]
    if function in (1, 2):
        count = int.from_bytes(request[3:5], "big")
        return bytes((function, (count + 7) // 8)) + bytes((count + 7) // 8)
    if function in (3, 4, 23):
        address, count = struct.unpack_from(">HH", request, 1)
        return bytes((function, 2 * count)) + struct.pack(f">{count}H", *HOLDING[address : address + count])
    return request if function == 6 else request[:5]


class _Answering:
    """A socket or serial line whose far end answers what it is told to, at once."""

    def __init__(self, wire: ScriptedWire) -> None:
        self._wire = wire
        self._near, self._far = socket.socketpair()
        self.is_open = True

    def write(self, data: bytes) -> int:
        """Take a request; its answer is there at once."""
        if answer := self._wire.answer(data):
            self._far.sendall(answer)
        return len(data)

    send = sendall = write

    def fileno(self) -> int:
        return self._near.fileno()

    def setblocking(self, flag: bool) -> None:
        self._near.setblocking(flag)

    def recv(self, size: int) -> bytes:
        return self._near.recv(size)

    @property
    def in_waiting(self) -> int:
        self._near.setblocking(False)
        try:
            return len(self._near.recv(65536, socket.MSG_PEEK))
        except BlockingIOError:
            return 0

    def read(self, size: int = 1) -> bytes:
        self._near.setblocking(False)
        try:
            return self._near.recv(size) if size else b""
        except BlockingIOError:
            return b""

    def reset_input_buffer(self) -> None:
        self.read(65536)

    def close(self) -> None:
        self.is_open = False
        self._near.close()
        self._far.close()


class ScriptedWire(TcpWire):
    """A wire that answers requests by replies out of an input, in their order, then truly.

    A piece of an input begins with how it comes: bit 0 with the request's own transaction number and length
    (TCP), or with a check sum that fits (RTU), bit 1 with its unit, bit 2 in place of the true reply's data.
    """

    def __init__(self, kind: str, replies: Sequence[bytes]) -> None:
        super().__init__("a wire of an input", 0)
        self._kind = kind
        self._replies = list(replies)
        self.sent: list[bytes] = []
        self.now_s = lambda: float(len(self.sent))
        self.sleep = lambda _: None

    def open(self, timeout_s: float) -> Any:
        """Return a client on this wire."""
        client: ModbusTcpClient | ModbusSerialClient
        if self._kind == "tcp":
            client = ModbusTcpClient("none", timeout=timeout_s, retries=0)
        else:
            client = ModbusSerialClient("none", timeout=timeout_s, retries=0)
        client.socket = cast(Any, _Answering(self))
        return with_quick_replies(client)

    def answer(self, request: bytes) -> bytes:
        """Return what comes back."""
        true = _true_reply(request[7:] if self._kind == "tcp" else request[1:-2])
        piece = self._replies.pop(0) if self._replies else b""
        how, given = (piece[0], piece[1:]) if piece else (0b111, b"")
        pdu = given if piece and not how & 4 else true
        if piece and how & 4 and given:
            at = 1 + given[0] % len(true)
            pdu = true[:at] + given[1:]
        unit = request[6] if self._kind == "tcp" else request[0]
        unit = unit if how & 2 or not piece else given[:1][0] if given else 0
        if self._kind == "tcp":
            framed = request[:4] + struct.pack(">HB", len(pdu) + 1 & 0xFFFF, unit) + pdu
        else:
            framed = crc(bytes((unit,)) + pdu)
        sent = framed if how & 1 else given
        self.sent.append(sent)
        return sent


def _client(kind: str) -> Begin:
    @contextmanager
    def begin(folder: Path) -> Iterator[Case]:
        del folder

        def read(content: bytes) -> object:
            wire = ScriptedWire(kind, pieces(content))
            link = ModbusLink(wire, timeout_s=SOON_S, name="device")
            try:
                # An exception for function 23 is taken for a device without it: it comes last.
                found = link.read(10, 4, "four"), link.read(0, 120, "many", table="input")
                link.read_bits(3, 20, "bits", table="coil")
                link.write(5, [1], "one")
                link.write(6, [1, 2, 3], "three")
                exchanged = link.exchange(Exchange(20, 30, 5, (1, 2), "both"))
            finally:
                link.close()
            true = HOLDING[10:14], HOLDING[:120], HOLDING[20:50]
            if (
                kind == "rtu"
                and (*found, exchanged) != true
                and not any(_has_frame(one) for one in wire.sent)
            ):
                raise Altered("registers of a frame whose check sum is wrong were taken")
            return found

        good = [bytes((7, 1)), bytes((7, 3)) + bytes(8), bytes((3, 3, 8)) + bytes(8), bytes((3, 0x83, 2))]
        yield Case([joined(good), joined([*good[2:], *good])], read, of_pieces(mutated, 12))

    return begin


def _has_frame(sent: bytes) -> bool:
    """Return whether some piece of what was sent has a check sum that fits."""
    ends = range(4, len(sent) + 1)
    return any(crc(sent[at : end - 2]) == sent[at:end] for end in ends for at in range(end - 3))


# --- Modbus: the server ----------------------------------------------------------------------------


class _Transport:
    def __init__(self) -> None:
        self.written = b""
        self.closed = False

    def write(self, data: bytes) -> None:
        self.written += data

    def close(self) -> None:
        self.closed = True

    abort = close

    def is_closing(self) -> bool:
        return self.closed


def _requests() -> list[bytes]:
    return [
        bytes((3,)) + struct.pack(">HH", 0, 10),
        bytes((4,)) + struct.pack(">HH", 0, 10),
        bytes((6,)) + struct.pack(">HH", 97, 6),
        bytes((16,)) + struct.pack(">HHB4H", 100, 4, 8, 1, 2, 3, 4),
        bytes((23,)) + struct.pack(">HHHHB2H", 200, 20, 100, 2, 4, 1, 2),
        bytes((1,)) + struct.pack(">HH", 0, 8),
        bytes((43, 14, 1, 0)),
    ]


@contextmanager
def tcp_server(folder: Path) -> Iterator[Case]:
    """Give requests over TCP, whole, in pieces and on end."""
    del folder
    responder = Responder(Bank(RingDevice(load_profile("ring"))), bool, lambda: False)

    def read(content: bytes) -> object:
        connection = modbus_tcp._Connection(responder, 1, set())
        transport = _Transport()
        connection.connection_made(cast(Any, transport))
        for piece in pieces(content):
            connection.data_received(piece)
        _demand_tcp_replies(transport.written)
        return transport.written

    framed = [struct.pack(">HHHB", 7, 0, len(one) + 1, 1) + one for one in _requests()]

    def with_length(content: bytes, pick: Random) -> bytes:
        content = mutated(content, pick)
        return (
            content
            if len(content) < 7
            else content[:2] + b"\0\0" + struct.pack(">H", len(content) - 6 & 0xFF) + content[6:]
        )

    yield Case([joined(framed)], read, of_pieces(either(mutated, with_length)))


def _demand_tcp_replies(written: bytes) -> None:
    while written:
        _, protocol, length = struct.unpack_from(">HHH", written)
        assert protocol == 0, "a reply of another protocol"
        assert 3 <= length <= 254, "a reply that is no frame"
        assert len(written) >= 6 + length, "half a reply"
        written = written[6 + length :]


@contextmanager
def rtu_server(folder: Path) -> Iterator[Case]:
    """Give requests over a line, with and without a check sum that fits."""
    responder = Responder(Bank(RingDevice(load_profile("ring"))), bool, lambda: False)

    def read(content: bytes) -> object:
        return asyncio.run(_heard(responder, folder / "line", pieces(content)))

    def with_sum(content: bytes, pick: Random) -> bytes:
        return crc(mutated(content[:-2], pick)[:250])

    framed = [crc(b"\1" + one) for one in _requests()]
    yield Case([joined(framed)], read, of_pieces(either(mutated, with_sum, with_sum), 12))


async def _heard(responder: Responder, link: Path, parts: Sequence[bytes]) -> list[bytes]:
    """Return what a server on a line answers to each piece that comes after a pause."""
    server = RtuStandServer(responder, 1)
    server.start(link)
    assert server._ends is not None
    slave, replies = server._ends[1], []
    os.set_blocking(slave, False)
    try:
        for piece in parts:
            server._received, sent = b"", piece[:4000]
            if not sent:
                continue
            os.write(slave, sent)
            server._hear()
            try:
                reply = os.read(slave, 4096)
            except BlockingIOError:
                reply = b""
            if reply and crc(reply[:-2]) != reply:
                raise Altered("a reply has a check sum that does not fit")
            if reply and not _has_frame(sent):
                raise Altered("a request whose check sum does not fit was answered")
            replies.append(reply)
    finally:
        server.stop()
    return replies


# --- serial frames and dialogues -------------------------------------------------------------------


class _Clock:
    """Time passes by the looks at it."""

    def __init__(self) -> None:
        self.at_s = 0.0

    def wall_s(self) -> float:
        self.at_s += 0.01
        return self.at_s

    now_s = wall_s


class _Port:
    """A serial port at which each answer waits until something was asked."""

    def __init__(self, answers: Sequence[bytes]) -> None:
        self._answers, self._there = list(answers), b""

    @property
    def in_waiting(self) -> int:
        return len(self._there)

    def read(self, size: int = 1, /) -> bytes:
        found, self._there = self._there[:size], self._there[size:]
        return found

    def write(self, data: bytes, /) -> int:
        self._there += self._answers.pop(0) if self._answers else b""
        return len(data)

    def reset_input_buffer(self) -> None:
        self._there = b""

    def close(self) -> None:
        pass


def _decoding(corpus: Sequence[bytes], make: Callable[[], Sequence[Any]], mutate: Mutate = mutated) -> Begin:
    """Return how decoders are begun that are fed an input piece by piece."""

    @contextmanager
    def begin(folder: Path) -> Iterator[Case]:
        del folder

        def read(content: bytes) -> object:
            found = []
            for decoder in make():
                for at in range(0, len(content), 37):
                    values = decoder.feed(content[at : at + 37])
                    assert all(value.lost >= 0 and abs(value.count) < 1 << 31 for value in values)
                    found += values
                    if decoder.undecided:
                        break
                assert decoder.pending_frames >= 0
            return found

        yield Case(corpus, read, mutate)

    return begin


def _gsv2_stream() -> bytes:
    values = np.random.default_rng(1).integers(0, 1 << 24, 40)
    return b"".join(b"\x2c\x00" + int(one).to_bytes(3, "big") for one in values)


def _short_stream() -> bytes:
    values = np.random.default_rng(1).integers(0, 1 << 16, 40)
    return b"".join(b"\xa5" + int(one).to_bytes(2, "big") for one in values)


def _lines() -> list[bytes]:
    found = []
    for name in ANSWERS:
        lines = lines_of(name)
        example = lines.found.example.encode()
        found.append((example + lines.end) * 10 + b"+0012.345" + lines.end)
    return found


def _dialogue(speak: Callable[[SerialLine], object], answers: Sequence[bytes]) -> Begin:
    """Return how a dialogue on a serial line is begun: an input holds what the far end answers."""

    @contextmanager
    def begin(folder: Path) -> Iterator[Case]:
        del folder

        def read(content: bytes) -> object:
            return speak(SerialLine(_Port(pieces(content)), cast(Any, _Clock()), "force at a line"))

        yield Case([joined(answers)], read, of_pieces(either(mutated, of_text), 40))

    return begin


def _gsv2_begins(line: SerialLine) -> object:
    settings = load_stand(SAMPLES / "stand.toml").amplifier[0]
    return Gsv2Dialect(cast(Any, settings)).begin(line, str)


def _lines_begin(line: SerialLine) -> object:
    for name in ANSWERS:
        AsciiLineDialect(lines_of(name)).begin(line, str)
    return None


def _ds2480b(line: SerialLine) -> object:
    adapter = Ds2480b(line, lambda: None)
    adapter.begin()
    return adapter.search(), adapter.reset()


# --- streams ---------------------------------------------------------------------------------------


def _packet(number: int, samples: bytes, status: int = 0, additional: int = 0) -> bytes:
    return (
        struct.pack(">HHHBBBBHHH", number, 0, 10 + len(samples), 1, 76, 16, 0, 0, status, additional)
        + samples
    )


@contextmanager
def labjack_stream(folder: Path) -> Iterator[Case]:
    """Give packets of a stream, and replies at STREAM_DATA_CR."""
    del folder

    def read(content: bytes) -> object:
        assembly, after, found = ScanAssembly(3, 24), 0, []
        for piece in pieces(content):
            head, body = piece[:HEAD_BYTES].ljust(HEAD_BYTES, b"\0"), piece[HEAD_BYTES:]
            wanted = body_bytes(head)
            packet = packet_of(head, body[:wanted].ljust(wanted, b"\0"))
            scans, _ = assembly.take(packet)
            for one in scans:
                assert one.first >= after, "scans are numbered backwards"
                assert one.lost >= 0
                after = one.first + len(one.samples)
            found += scans
            words = np.frombuffer(body[: len(body) // 2 * 2].ljust(8, b"\0"), ">u2")
            with suppress(NotAPacketError):
                reply_of([int(word) for word in words])
        return found

    body = np.arange(24, dtype=">u2").tobytes()
    corpus = [joined([_packet(n, body) for n in range(6)])]
    corpus += [
        joined([_packet(0, body), _packet(1, body, 2941, 7), _packet(2, b"\xff" * 48), _packet(3, body)])
    ]
    yield Case(corpus, read, of_pieces(mutated))


@contextmanager
def rmc_plot(folder: Path) -> Iterator[Case]:
    """Give uploads of a plot, in the registers of a reply."""
    del folder

    def read(content: bytes) -> object:
        plot = Plot()
        upload, answers, after, found = plot.begun(), pieces(content), 0, []
        true = plot.upload._registers._read
        size = 4 * (5 + 2 * PLOT_SAMPLES)

        def answered(address: int, count: int, what: str) -> list[int]:
            if address != UPLOAD.wire or not answers:
                return true(address, count, what)
            return words_of(answers.pop(0)[:size].ljust(size, b"\0"), "little")[:count]

        plot.upload._registers._read = answered
        for number in range(12):
            plot.now_s += 0.003 * number
            block = upload.read()
            if block is not None:
                assert block.first >= after, "samples are numbered backwards"
                assert block.lost >= 0
                after = block.first + len(block.rows)
                found.append(block)
            assert upload.clock_us() >= 0
        return found

    def given(index: int, status: int = 0, plot_id: int = 4) -> bytes:
        head = struct.pack(">5I", CONTINUOUS | status << 4, PLOT_SAMPLES, index, plot_id, PLOT_SAMPLES)
        return head + struct.pack(f">{2 * PLOT_SAMPLES}f", *range(2 * PLOT_SAMPLES))

    corpus = [joined([given(0), given(3), given(6)]), joined([given(0), given(99), given(3, 2), given(0)])]
    yield Case(corpus, read, of_pieces(mutated, 12))


@contextmanager
def ring_windows(folder: Path) -> Iterator[Case]:
    """Give windows of a ring, mostly with a check sum that fits; without one nothing false is taken."""
    del folder
    profile = load_profile("ring")
    device = RingDevice(profile)
    head = 2 * profile.ring_header.words
    windows = []
    for portion in (5, 9, 3, 0, 12):
        device.sample(portion)
        windows.append(pack(device.window()))
        device.set("ring_acknowledge", device.newest)

    def read(content: bytes) -> object:
        reader, found = RingReader(profile, 1e6 / PERIOD_US), []
        for piece in pieces(content):
            window = piece[: len(windows[0])].ljust(len(windows[0]), b"\0")
            try:
                rows = reader.take(window)
            except DoubtfulBlock:
                continue
            if rows is None:
                continue
            found.append(rows)
            if window not in windows and not _fits(window):
                raise Altered("a window whose check sum does not fit was taken")
            assert np.all(np.diff(rows.time_us) > 0), "time goes back"
        return found

    def _fits(window: bytes) -> bool:
        header = profile.ring_header.unpack(window[:head])
        rows = window[head : head + 2 * int(header["count"]) * profile.ring_sample.words]
        words = struct.unpack(f">{(head - 4 + len(rows)) // 2}H", window[: head - 4] + rows)
        return crc_of(words) == int(header["check"])

    def with_sum(content: bytes, pick: Random) -> bytes:
        size = len(windows[0])
        window = mutated(content, pick)[:size].ljust(size, b"\0")
        count = int(profile.ring_header.unpack(window[:head])["count"])
        rows = window[head : head + 2 * count * profile.ring_sample.words]
        words = struct.unpack(f">{(head - 4 + len(rows)) // 2}H", window[: head - 4] + rows)
        check = pack(
            profile.ring_header.encode({**profile.ring_header.unpack(window[:head]), "check": crc_of(words)})
        )
        return check + window[head:]

    yield Case([joined(windows)], read, of_pieces(either(mutated, with_sum), 12))


@contextmanager
def thermometers(folder: Path) -> Iterator[Case]:
    """Give the texts of the kernel's files of a thermometer."""
    del folder
    corpus = [
        b"70 01 4b 46 7f ff 0c 10 84 : crc=84 YES\n70 01 4b 46 7f ff 0c 10 84 t=23000\n",
        b"50 05 4b 46 7f ff 0c 10 1c : crc=1c YES\n50 05 4b 46 7f ff 0c 10 1c t=85000\n",
        b"23062\n",
    ]

    def read(content: bytes) -> object:
        text = content.decode("utf-8", "replace")
        return decode_w1_slave(text), decode_temperature(text)

    yield Case(corpus, read, either(mutated, of_text))


WIRES = (
    Target("modbus-tcp-client", "replies over Modbus TCP", _client("tcp")),
    Target("modbus-rtu-client", "replies over Modbus RTU", _client("rtu"), dose=8),
    Target("modbus-tcp-server", "requests to the simulated devices over TCP", tcp_server),
    Target("modbus-rtu-server", "requests to the simulated devices over RTU", rtu_server),
    Target(
        "gsv2-frames",
        "streams of a GSV-2",
        _decoding(
            [_gsv2_stream(), _short_stream()],
            lambda: [FrameDecoder(form=form, aligned=at) for form in (LONG, SHORT) for at in (True, False)],
        ),
    ),
    Target(
        "gsv2-dialogue",
        "answers of a GSV-2",
        _dialogue(_gsv2_begins, [b"", b"\x01\x02", b"12345678", b"\x00", b"\x08", b"", b"\xff\xb1\xe0", b""]),
    ),
    Target(
        "ascii-lines",
        "lines of amplifiers by description",
        _decoding(
            [*_lines(), b"+0123.45 kN\r\n" * 10],
            lambda: [
                LineDecoder(lambda line: decimal_counts(line, 2), aligned=True),
                *(ReplyDecoder(lines_of(one), aligned=True) for one in ANSWERS),
            ],
            either(mutated, of_text),
        ),
    ),
    Target(
        "ascii-dialogue", "answers of amplifiers by description", _dialogue(_lines_begin, [b"OK\r\n"] * 12)
    ),
    Target(
        "aed-values",
        "values of an AED",
        _decoding(
            [_gsv2_stream(), b"-0012345,31,008\r\n" * 10, b" 12345\r\n" * 10],
            lambda: [
                *(
                    continuous_decoder(one, checksum=False, address=31, aligned=True)
                    for one in (0, 1, 2, 3, 8, 9, 11, 12)
                ),
                *(single_decoder(one, checksum=True, address=None) for one in (0, 3, 4)),
            ],
            either(mutated, of_text),
        ),
    ),
    Target("ds2480b", "answers of a 1-Wire adapter", _dialogue(_ds2480b, [b"\xcd"] * 40)),
    Target("labjack-stream", "packets of a LabJack stream", labjack_stream, (*WELL_ENDED, NotAPacketError)),
    Target("rmc-plot", "uploads of an RMC's plot", rmc_plot),
    Target("ring-window", "windows of a ring controller", ring_windows),
    Target("thermometer", "files of the kernel's 1-Wire", thermometers),
)
"""Everything that comes over a wire."""
