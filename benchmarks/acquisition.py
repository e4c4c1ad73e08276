"""How fast samples come from the simulated controller in another process, beside a bare socket; and to disk.

    .venv/bin/python -m benchmarks.acquisition [--seconds 10]

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

import argparse
import socket
import struct
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign_folder.run_metadata import stream_document
from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.recording.recorder import RunRecorder

SAMPLE_STAND = Path(__file__).parents[1] / "sample_runs" / "stand.toml"
TURN = 40
FAST = 200.0
MEMORY = Path("/dev/shm")
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


def fast_enough(stand: StandFile, seconds: float) -> tuple[float, float, float, float, int]:
    """Return samples/s, ratio of wall times, ratio of processor times, driver's µs a transaction, lost."""
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
        driver.lost,
    )


def chain(stand: StandFile, folder: Path, seconds: float, speed: float) -> tuple[float, float, int]:
    """Return the share of one processor, samples/s and lost samples of the whole chain to disk."""
    clock = WallClock(speed)
    controller = build_controller(stand, clock)
    controller.connect()
    opened = Stand(controller, ())
    guards = GuardSet(
        (
            ChannelGuard("force", "force", 600.0, -60.0, "kN", "force"),
            ChannelGuard("stroke_1", "stroke_1", 250.0, -60.0, "mm", "stroke"),
        ),
        (),
        ControllerGuard(30.0, 30.0, controller.facts.rate_Hz),
    )
    panel = GuardPanel(guards, wall_s=clock.wall_s())
    # 20 ms of the wall between two passes, as at a real stand of this rate.
    acquisition = Acquisition(opened, clock, panel, pace=LoopPace(tick_s=0.02 * speed))
    while True:
        acquisition.tick()
        if acquisition.up_to_date:
            break
    facts = controller.facts
    recorder = RunRecorder(
        folder,
        "benchmark",
        {
            "format": "bufferstand/run",
            "format_version": 1,
            "run": {"id": "benchmark", "kind": "harmonic", "started_utc": "2026-01-01T00:00:00+00:00"},
            "software": {"name": "bufferstand", "version": "0"},
            "stand": {},
            "specimen": {},
            "streams": {facts.name: stream_document(facts)},
        },
    )
    acquisition.attach(recorder)
    before = acquisition.latest.samples, acquisition.latest.lost
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
    return processor_s / wall_s, (latest.samples - before[0]) / wall_s, latest.lost - before[1]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()
    memory = MEMORY if MEMORY.is_dir() else None
    with (
        tempfile.TemporaryDirectory(prefix="bufferstand-") as name,
        tempfile.TemporaryDirectory(prefix="bufferstand-", dir=memory) as wires,
    ):
        folder = Path(name)
        alone = controller_alone(folder)
        with start_process(alone, directory=Path(wires) / "fast", speed=FAST) as process:
            rate, ratio, processor, each_us, lost = fast_enough(
                with_endpoints(load_stand(alone), process.served.endpoints()), given.seconds
            )
        print(
            f"driver: {rate:,.0f} samples/s per channel, {each_us:.0f} µs a transaction at best, {lost} lost"
        )
        print(
            f"driver / bare socket: {ratio:.2f} of the wall's time, "
            f"{processor:.2f} of the client's processor time"
        )
        speed = CHAIN_HZ / 1000.0
        stand = prompt_stand(folder)
        with start_process(stand, directory=Path(wires) / "chain", speed=speed) as process:
            share, rate, lost = chain(
                with_endpoints(load_stand(stand), process.served.endpoints()), folder, given.seconds, speed
            )
        print(f"whole chain: {rate:,.0f} samples/s, {100.0 * share:.1f} % of one processor, {lost} lost")


if __name__ == "__main__":
    main()
