"""What the contract of a controller runs on: physics in process, loopback wires, or a real stand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import cast

import numpy as np

from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.interfaces import Controller, ControllerStatus, MotionState, SampleBlock
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import Clock, WallClock
from bufferstand.foundation.motions import Release
from tests.clean_stand import clean_stand_text
from tests.contract.controller.announced import Announced, Bounds, Say, confirmed_at, consent
from tests.many_channels import stand_with
from tests.peers.delta_rmc import SpecimenFacts
from tests.peers.references import BUILD_PLC, IN_ST, build_reference, reference_stand
from tests.peers.rmc_stand import rmc_stand

BOUNDS = Bounds()
"""What the suite orders on whatever it runs; a few orders that a real stand never sees go beyond."""
SAMPLES = Path(__file__).parents[3] / "sample_runs"
LIMIT_S = 120.0
TCP_SPEED, POLLED_SPEED, RTU_SPEED = 4.0, 2.0, 1.0
"""Of the served stands: who polls samples less often, and a line carries fewer blocks."""
TCP = 'host = "127.0.0.1"\nport = 15020'
RTU = 'serial = "wires/controller"\nbaud = 115200'


@dataclass
class Bench:
    """One controller under test, and the time by which it is waited for."""

    name: str
    controller: Controller
    clock: Clock
    polled: bool = False
    real: bool = False
    second: Callable[[], Controller] | None = None
    """Makes another program's driver of the same controller, connected; None where a wire allows one only."""

    def __post_init__(self) -> None:
        self.blocks: list[SampleBlock] = []

    def drain(self) -> bool:
        """Take what the controller has sampled, in a bounded time: the watchdog wants its turn."""
        for _ in range(64):
            block = self.controller.read_block()
            if block is None:
                return True
            self.blocks.append(block)
        return False

    def finish(self) -> None:
        """Take everything that has been sampled up to now: a fast stand is 6000 samples ahead at most."""
        for _ in range(8):
            if self.drain():
                return
            self.feed()

    def feed(self) -> None:
        """Feed the watchdog, if this program may: before it has switched on it may not."""
        if self.controller.in_charge:
            self.controller.feed_watchdog()

    def until(
        self,
        reached: Callable[[ControllerStatus], bool],
        *,
        feeding: bool = True,
    ) -> ControllerStatus:
        """Run the acquisition's loop, in small, until a status; fail after two minutes of the wall."""
        end_s = self.clock.wall_s() + LIMIT_S
        while True:
            if feeding:
                self.feed()
            self.drain()
            status = self.controller.status()
            if reached(status):
                return status
            assert self.clock.wall_s() < end_s, f"not reached within {LIMIT_S} s: {status}"
            self.clock.sleep(0.02)

    def done(self, sequence: int) -> ControllerStatus:
        """Wait for the end of a motion."""
        return self.until(lambda status: status.done_sequence == sequence)

    def enable(self, *, watchdog_ms: int = 5000, stroke_limit_mm: float = BOUNDS.stroke_limit_mm) -> None:
        self.controller.enable(
            force_limit_kN=BOUNDS.force_limit_kN, stroke_limit_mm=stroke_limit_mm, watchdog_ms=watchdog_ms
        )

    def rest(self) -> None:
        """Bring it to zero force, off, and forget what was sampled and said."""
        if self.controller.status().state in (MotionState.HOLDING, MotionState.RAMPING, MotionState.WAVEFORM):
            self.done(self.controller.start(Release(speed_mm_per_s=20.0)))
        if self.controller.in_charge:  # else nobody has switched it on
            self.controller.disable()
            self.controller.give_back()
        self.finish()
        self.blocks.clear()
        self.controller.events()

    def values(self, name: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return a channel of everything drained, in its unit."""
        channel = next(c for c in self.controller.facts.channels if c.name == name)
        return np.asarray(
            channel.calibration.apply(np.concatenate([block.counts[name] for block in self.blocks]))
        )


def write_stand(folder: Path, changes: dict[str, str]) -> Path:
    text = clean_stand_text()
    for old, new in {'model = "': f'model = "{SAMPLES}/', **changes}.items():
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


@contextmanager
def in_process(folder: Path) -> Iterator[Bench]:
    made = open_in_process(load_stand(write_stand(folder, {})))
    made.stand.controller.connect()

    def second() -> Controller:
        controller = made.second()
        controller.connect()
        return controller

    yield Bench("in process", made.stand.controller, made.clock, second=second)
    made.stand.close()


@contextmanager
def served(folder: Path, changes: dict[str, str] | None) -> Iterator[Bench]:
    path = stand_with(folder, wires=4, further=True) if changes is None else write_stand(folder, changes)
    stand = load_stand(path)
    speed = RTU_SPEED if stand.controller.serial else TCP_SPEED
    if stand.controller.kind != "registers":
        speed = RTU_SPEED
    if stand.profile().window is None:
        speed = min(speed, POLLED_SPEED)
    clock = WallClock(speed)
    with start_process(path, directory=folder / "run", speed=speed) as process:
        controller = build_controller(with_endpoints(stand, process.served.endpoints()), clock)
        try:
            controller.connect()
            wired = with_endpoints(stand, process.served.endpoints())
            second = None if stand.controller.serial else partial(_second, wired, clock)
            yield Bench("served", controller, clock, polled=stand.profile().window is None, second=second)
        finally:
            controller.close()


@contextmanager
def of_another_author(folder: Path) -> Iterator[Bench]:
    """An RMC that was written from the manual by somebody who had not seen the driver."""
    with rmc_stand(folder, specimen=SpecimenFacts(k1_kN_per_mm=2.5)) as peer:
        stand, clock = load_stand(peer.path), WallClock()
        controller = build_controller(stand, clock)
        try:
            controller.connect()
            yield Bench("another author's", controller, clock, second=partial(_second, stand, clock))
        finally:
            controller.close()


@contextmanager
def reference_in_c(folder: Path) -> Iterator[Bench]:
    """The controller in C that laboratories start from."""
    with reference_stand(folder, [build_reference(folder / "built")]) as path:
        yield from _reached(path)


@contextmanager
def plc_program(folder: Path, by: str) -> Iterator[Bench]:
    """The PLC program that laboratories start from, behind a Modbus server that knows nothing of it."""
    with reference_stand(folder, [BUILD_PLC[by](folder / "built")], IN_ST) as path:
        yield from _reached(path)


def _reached(path: Path) -> Iterator[Bench]:
    stand, clock = load_stand(path), WallClock()
    controller = build_controller(stand, clock)
    try:
        controller.connect()
        yield Bench("reference", controller, clock, second=partial(_second, stand, clock))
    finally:
        controller.close()


def _second(stand: StandFile, clock: Clock) -> Controller:
    controller = build_controller(stand, clock)
    controller.connect()
    return controller


def open_real(stand: StandFile) -> tuple[Controller, Clock]:
    """Return the controller that a stand file leads to, not connected yet, and its clock."""
    clock = WallClock()
    return build_controller(stand, clock), clock


@contextmanager
def real(path: Path, given: str | None, say: Say) -> Iterator[Bench]:
    """A real stand: its operator has consented to all, and confirms each motion or did by ``--yes-move``."""
    stand = load_stand(path)
    with ExitStack() as stack:
        terminal = None
        if given is None:
            with suppress(OSError):
                terminal = stack.enter_context(Path("/dev/tty").open(encoding="utf-8"))
        consent(stand, BOUNDS, given, say, terminal)
        confirmed = (lambda _: True) if terminal is None else confirmed_at(terminal, say)
        controller, clock = open_real(stand)
        try:
            controller.connect()
            polled = stand.profile().window is None
            careful = cast(Controller, Announced(controller, BOUNDS, say, confirmed))
            second = None if stand.controller.serial else partial(_second, stand, clock)
            yield Bench("hardware", careful, clock, polled=polled, real=True, second=second)
        finally:
            controller.close()


RING_TO_POLLING = {'profile = "ring"': 'profile = "polling"'}
RMC = {
    'profile = "ring"': 'kind = "rmc"',
    "watchdog_s = 2.0\n": """watchdog_s = 2.0

[controller.rmc]
model = "rmc150"
axis = 0
plot = 7
word_order = "little"
variables = 100
force = "%MD9.8"
clear_mm = -5.0
acceleration_mm_per_s2 = 5000.0
change = { amplitude = 0, offset = 2, ramp_cycles = 2 }
""",
}
SERVED: dict[str, dict[str, str] | None] = {
    "TCP": {},
    "four wires and more over TCP": None,
    "RTU": {TCP: RTU},
    "polled over TCP": RING_TO_POLLING,
    "RMC over TCP": RMC,
    "polled over RTU": {TCP: RTU, **RING_TO_POLLING},
}
