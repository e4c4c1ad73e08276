"""How fast samples come from the simulated controller in another process, beside a bare socket; and to disk.

1. The driver (every block checked, decoded and put in order) and a bare socket (the same bytes sent, the
   reply received whole and nothing done with it) make the same transactions, in turns of 40. The samples a
   second are those of all the driver's turns together, while the stand makes as many; the ratio is that of
   the best turns, and alone means anything on a busy machine. The driver's samples must be complete.
2. The whole chain at 5 kHz: driver, guards, scaling, recorder, journal on the disk. Its processor time over
   the wall's, and what it lost.

The stand is at rest meanwhile: its samples (noise and all) are made 100 at a time, so that the physics of one
processor does not bound what is to be measured. For the same reason it is the controller alone that is read
so fast: amplifier and thermometers, 200 times as fast as real ones, would measure their own wires and the
disk. The chain has the whole stand, its 1-Wire folder in memory, as the kernel's is.
"""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from benchmarks.common import SAMPLE_STAND, Benchmark, record, tell, wide_guards
from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.guards.panel import GuardPanel
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.simulated.serving.process import start_process, wires_folder
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock

TURN = 40
FAST = 200.0
CHAIN_HZ = 5000.0


class BareSocket:
    """The same transactions as the driver's: FC23 of two registers out and the whole window in."""

    def __init__(self, stand: StandFile) -> None:
        self._wire = socket.create_connection((stand.controller.host, stand.controller.port), timeout=5)
        self._wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        profile = stand.profile()
        self._address = profile.find("ring_acknowledge").address
        self._window = (profile.ring.address, profile.ring.registers)
        self._size = 9 + 2 * profile.ring.registers
        header = {place.name: place.offset for place in profile.ring_header.places}
        self._count_at = header["count"]
        self._number = 0

    def count_in(self, reply: bytes) -> int:
        """Return how many samples a reply holds, so that the next request goes on behind them."""
        at = 9 + 2 * self._count_at
        return int.from_bytes(reply[at : at + 2], "big")

    def exchange(self, acknowledge: int) -> bytes:
        """Make one transaction; return the reply."""
        self._number = (self._number + 1) % 0x10000
        self._wire.sendall(
            struct.pack(
                ">HHHBBHHHHBI", self._number, 0, 15, 1, 23, *self._window, self._address, 2, 4, acknowledge
            )
        )
        reply = b""
        while len(reply) < self._size:
            reply += self._wire.recv(self._size - len(reply))
        return reply

    def close(self) -> None:
        """Let go of the wire."""
        self._wire.close()


def controller_alone(folder: Path) -> Path:
    """Write the sample stand's file without amplifier and thermometers; return its path."""
    before, rest = _prompt().split("\n[amplifier]\n")
    path = folder / "controller.toml"
    path.write_text(before + rest[rest.index("\n[simulation]") :], encoding="utf-8")
    return path


def prompt_stand(folder: Path) -> Path:
    """Write the sample stand's file with a controller that answers at once and misses no cycle."""
    path = folder / "stand.toml"
    path.write_text(_prompt(), encoding="utf-8")
    return path


def _prompt() -> str:
    """Return the sample stand's file without what would count as the driver's: waits and lost samples."""
    text = SAMPLE_STAND.read_text(encoding="utf-8").replace('model = "', f'model = "{SAMPLE_STAND.parent}/')
    kept = [line for line in text.splitlines() if not line.startswith(("reply_", "missed_cycles"))]
    return "\n".join(kept) + "\n"


@dataclass
class Turns:
    """What one client's turns took, and what it got."""

    walls_s: list[float] = field(default_factory=list)
    processors_s: list[float] = field(default_factory=list)
    samples: int = 0
    lost: int = 0

    def take(self, read: Callable[[], tuple[int, int]]) -> None:
        """Make one turn; the first transaction is not timed, since the other's last may still be answered.

        ``read`` makes a transaction and returns how many samples came and were lost.
        """
        read()
        wall_s, processor_s = time.perf_counter(), time.process_time()
        for _ in range(TURN):
            samples, lost = read()
            self.samples += samples
            self.lost += lost
        self.walls_s.append(time.perf_counter() - wall_s)
        self.processors_s.append(time.process_time() - processor_s)


def fast_enough(stand: StandFile, seconds: float) -> tuple[float, float, float, float, float]:
    """Return samples/s, ratios of wall and of processor times, driver's µs a transaction, share lost."""
    controller, bare = build_controller(stand, WallClock(FAST)), BareSocket(stand)
    if not isinstance(controller, RingController):
        raise TypeError("the sample stand's profile has no ring")
    controller.connect()
    controller.read_block()  # from now on the stand waits for its reader, 6000 samples ahead
    time.sleep(0.5)
    position = at = 0

    def read_block() -> tuple[int, int]:
        nonlocal position
        block = controller.read_block()
        if block is None:
            return 0, 0
        position = block.first_sequence + len(block.time_us)
        return len(block.time_us), block.lost

    def read_bare() -> tuple[int, int]:
        nonlocal at
        count = bare.count_in(bare.exchange(at % (1 << 32)))
        at += count
        return count, 0

    driver, plain = Turns(), Turns()
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        at = position
        # Both read the same samples, in turns first: whoever is, has the stand sample some more meanwhile.
        order = ((driver, read_block), (plain, read_bare))
        for turns, read in order if len(driver.walls_s) % 2 else order[::-1]:
            turns.take(read)
    controller.close()
    bare.close()
    return (
        driver.samples / sum(driver.walls_s),
        min(driver.walls_s) / min(plain.walls_s),
        min(driver.processors_s) / min(plain.processors_s),
        min(driver.walls_s) / TURN * 1e6,
        driver.lost / (driver.samples + driver.lost),
    )


def chain(stand: StandFile, folder: Path, seconds: float, speed: float) -> tuple[float, float, float]:
    """Return the whole chain's share of one processor, its samples/s and its share of lost samples."""
    clock = WallClock(speed)
    controller = build_controller(stand, clock)
    controller.connect()
    opened = Stand(controller, ())
    panel = GuardPanel(wide_guards("stroke_1", controller.facts.rate_Hz), wall_s=clock.wall_s())
    # 20 ms of the wall between two passes, as at a real stand of this rate.
    acquisition = Acquisition(opened, clock, panel, pace=LoopPace(tick_s=0.02 * speed))
    while True:
        acquisition.tick()
        if acquisition.up_to_date:
            break
    recorder = record(opened, folder)
    acquisition.attach(recorder)
    before = acquisition.latest
    wall_s, processor_s = time.perf_counter(), time.process_time()
    while time.perf_counter() - wall_s < seconds:
        acquisition.rest()
        acquisition.tick()
    processor_s, wall_s = time.process_time() - processor_s, time.perf_counter() - wall_s
    latest = acquisition.latest
    if panel.trip is not None:
        raise RuntimeError(panel.trip.reason)
    recorder.close("complete")
    controller.close()
    samples, lost = latest.samples - before.samples, latest.lost - before.lost
    return processor_s / wall_s, samples / wall_s, lost / (samples + lost)


def measure(folder: Path, *, seconds: float) -> Sequence[float]:
    """Measure the driver beside a bare socket, then the chain."""
    alone, whole, speed = controller_alone(folder), prompt_stand(folder), CHAIN_HZ / 1000.0
    with wires_folder() as wires:
        with start_process(alone, directory=wires / "fast", speed=FAST) as process:
            rate, ratio, processor, each_us, lost = fast_enough(
                with_endpoints(load_stand(alone), process.served.endpoints()), seconds
            )
        tell(
            f"driver: {rate:,.0f} samples/s a channel, {each_us:.0f} µs a transaction at best, "
            f"{processor:.2f} times the bare socket's processor time"
        )
        with start_process(whole, directory=wires / "chain", speed=speed) as process:
            share, chain_rate, lost_to_disk = chain(
                with_endpoints(load_stand(whole), process.served.endpoints()), folder, seconds, speed
            )
        tell(f"chain: {chain_rate:,.0f} samples/s")
    return ratio, share, lost, lost_to_disk


BENCHMARK = Benchmark(
    {
        "driver / bare socket, wall": 1.5,
        "chain to disk at 5 kHz, processor / wall": 0.25,
        "driver: lost samples / all": 0.0,
        "chain: lost samples / all": 0.0,
    },
    full=partial(measure, seconds=10.0),
    smoke=partial(measure, seconds=0.5),
)
