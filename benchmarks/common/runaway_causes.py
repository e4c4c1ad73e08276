"""What makes a simulated piston run away, and what then fails in the stop, for :mod:`benchmarks.runaway`."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection
from contextlib import suppress

from bufferstand.daq.strokes.commands import StrokeCommands
from bufferstand.drivers.interfaces import Controller as Interface
from bufferstand.drivers.simulated.inprocess.register_wire import Lost
from bufferstand.drivers.simulated.machine.commands import Command, CommandCode
from bufferstand.drivers.simulated.machine.controller import SimulatedController
from bufferstand.drivers.simulated.machine.device import RATE_HZ
from bufferstand.drivers.simulated.machine.motions import HarmonicMotion as RunningSine
from bufferstand.drivers.simulated.machine.motions import Motion, RampMotion
from bufferstand.drivers.simulated.wires.modbus_requests import WRITE_SEVERAL
from bufferstand.foundation.errors import CommandRejected
from bufferstand.protocols.steps import Harmonic

STIFFNESS_KN_PER_MM = 20.0
SPEED_MM_PER_S = 50.0
TOP_MM = 50.0
SINE = Harmonic(mean_mm=20.0, amplitude_mm=2.0, frequency_Hz=2.0, cycles=6)
"""What is adjusted: it stays before the spring."""
ADJUSTED_MM = 1.8
"""Its amplitude after that."""


class Stiff:
    """A spring without loss that warms by nothing, behind a gap: F = k (x - gap) in contact."""

    def __init__(self, gap_mm: float) -> None:
        self._gap_mm = gap_mm
        self.force_kN = 0.0
        self.temperature_C = self.sensor_temperature_C = 21.0
        self.heat_J = 0.0

    def step(self, stroke_mm: float, dt_s: float) -> float:  # noqa: ARG002 - the interface's
        """Return the force at a stroke [kN]."""
        self.force_kN = STIFFNESS_KN_PER_MM * max(0.0, stroke_mm - self._gap_mm)
        return self.force_kN

    def tangent_kN_per_mm(self, loading: bool) -> float:  # noqa: N802, ARG002 - the interface's
        """Return the stiffness [kN/mm]."""
        return STIFFNESS_KN_PER_MM


class Spoiled:
    """What fails in a stop: which commands the controller takes and does not follow, what the wire loses.

    Parameters
    ----------
    deaf_to : collection of int
        Commands (:class:`bufferstand.drivers.simulated.machine.commands.CommandCode`) that it acknowledges
        while it goes on as before.
    loses : str
        What is lost of the first request with a hold that goes over the wire in each run: its ``request`` or
        ``reply``; empty for neither.
    """

    def __init__(self, deaf_to: Collection[int] = (), loses: Lost = "") -> None:
        self._deaf_to, self._loses = deaf_to, loses
        self._on = self._armed = False

    def spoil(self, controller: SimulatedController) -> None:
        """Make the simulated controller deaf."""
        made = controller._motion_of

        def motion_of(command: Command) -> Motion:
            motion = made(command)
            runs = self._on and isinstance(controller._motion, RampMotion)
            if command.code not in self._deaf_to or not runs:
                return motion
            going_on = RampMotion(command.sequence, controller.command_mm, TOP_MM, SPEED_MM_PER_S / RATE_HZ)
            going_on.state = motion.state
            return going_on

        controller._motion_of = motion_of  # type: ignore[method-assign]

    def begin(self) -> None:
        """Let it fail from now on."""
        self._on = self._armed = True

    def end(self) -> None:
        """Let all be well again."""
        self._on = self._armed = False

    def lost(self, request: bytes) -> Lost:
        """Return what is lost of a request (function code and data)."""
        is_hold = request[0] == WRITE_SEVERAL and struct.unpack_from(">H", request, 8)[0] == CommandCode.HOLD
        if not (self._armed and is_hold):
            return ""
        self._armed = False
        return self._loses


FAULTS = {
    "none": Spoiled(),
    "the request with the hold is lost": Spoiled(loses="request"),
    "the reply to the hold is lost": Spoiled(loses="reply"),
    "it acknowledges the hold and goes on": Spoiled((CommandCode.HOLD,)),
    "it acknowledges hold and release and goes on": Spoiled((CommandCode.HOLD, CommandCode.RELEASE)),
}
"""What can fail in a stop, by its name."""


class Adjusting(StrokeCommands):
    """Commands a sine as it is asked for, and adjusts it once, after its first full cycle."""

    def __init__(self, controller: Interface) -> None:
        super().__init__(controller)
        self._adjusted = False

    def look(self, cycles_done: int) -> None:
        """Adjust the sine that runs, once."""
        if cycles_done and not self._adjusted:
            self._adjusted = True
            with suppress(CommandRejected):
                self._controller.adjust_harmonic(mean_mm=SINE.mean_mm, amplitude_mm=ADJUSTED_MM)


class AmokSine:
    """A sine that runs away toward more force, so long after the first request of an adjust.

    The controller takes it for a sine still.

    Parameters
    ----------
    controller : Controller
        The simulated one.
    now_s : callable
        Stand time [s].
    """

    def __init__(self, controller: SimulatedController, now_s: Callable[[], float]) -> None:
        self._controller, self._now_s = controller, now_s
        self._after_s = 0.0
        self._due_s = float("inf")

    def begin(self, after_s: float) -> None:
        """Let the next sine that is adjusted run away, so long after that [s]."""
        self._after_s, self._due_s = after_s, float("inf")

    def look(self, request: bytes) -> None:
        """Look at a request (function code and data): time counts from the first with an adjust on."""
        if request[0] == WRITE_SEVERAL and struct.unpack_from(">H", request, 8)[0] == CommandCode.ADJUST:
            self._due_s = min(self._due_s, self._now_s() + self._after_s)
        motion = self._controller._motion
        if self._now_s() < self._due_s or not isinstance(motion, RunningSine):
            return
        self._due_s = float("inf")

        def advance(force_kN: float, position_mm: float) -> float:  # noqa: ARG001 - as a Motion's
            motion.command_mm = min(motion.command_mm + SPEED_MM_PER_S / RATE_HZ, TOP_MM)
            return motion.command_mm

        motion.advance = advance  # type: ignore[method-assign]
        motion.deceleration_mm = lambda: 0.0  # type: ignore[method-assign]
