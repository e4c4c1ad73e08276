"""On a real stand every motion of the suite is announced and confirmed, and none is beyond its bounds.

The bounds hold for every command that the suite gives, also for those that the controller is to refuse: what
it trusts the controller to refuse could do no harm if it were obeyed.
"""

from __future__ import annotations

import math
import select
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, TextIO

import pytest

from bufferstand.cli.arming import Movement, check_given
from bufferstand.cli.campaign.movement import stand_text
from bufferstand.drivers.interfaces import Controller
from bufferstand.drivers.stand_file.schema import StandFile, StandFileLimits
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import ControllerMotion

FEED_S = 0.2
"""While the operator thinks, a holding actuator wants its watchdog fed [s]."""
Say = Callable[[str], object]
Confirmed = Callable[[Callable[[], object]], bool]


class OutOfBounds(Exception):  # noqa: N818 - it names the fact
    """The suite would have ordered more than it announced; nothing was sent."""


@dataclass(frozen=True)
class Bounds:
    """The greatest that the suite orders: piston from first contact [mm], its speed [mm/s], and the limits
    that it sets in the device [kN, mm]."""

    stroke_mm: float = 16.0
    speed_mm_per_s: float = 30.0
    force_limit_kN: float = 60.0
    stroke_limit_mm: float = 20.0

    def text(self) -> str:
        return (
            f"piston at most {self.stroke_mm:g} mm from first contact, at most {self.speed_mm_per_s:g} mm/s; "
            f"limits of the device are set to {self.force_limit_kN:g} kN and {self.stroke_limit_mm:g} mm"
        )

    def too_wide_for(self, limits: StandFileLimits) -> str:
        """Return which limit of a stand is narrower than what the suite needs, empty if none."""
        pairs = {
            "force_max_kN": (limits.force_max_kN, self.force_limit_kN),
            "stroke_max_mm": (limits.stroke_max_mm, self.stroke_limit_mm),
            "speed_max_mm_per_s": (limits.speed_max_mm_per_s, self.speed_mm_per_s),
        }
        narrow = [
            f"{name} = {has:g} (needs {needs:g})" for name, (has, needs) in pairs.items() if has < needs
        ]
        return ", ".join(narrow)

    def broken_by(self, order: str, values: dict[str, Any]) -> str:
        """Return how an order breaks them, empty if it does not; what is not finite breaks them."""
        stroke_mm, speed_mm_per_s = reach(order, values)
        if not -0.01 <= stroke_mm <= self.stroke_mm:
            return f"{order} {values} leads to {stroke_mm:g} mm"
        if not 0.0 <= speed_mm_per_s <= self.speed_mm_per_s * (1.0 + 1e-9):
            return f"{order} {values} has {speed_mm_per_s:g} mm/s"
        force, stroke = values.get("force_limit_kN", 0.0), values.get("stroke_limit_mm", 0.0)
        if not (0.0 <= force <= self.force_limit_kN and 0.0 <= stroke <= self.stroke_limit_mm):
            return (
                f"{order} {values} sets limits beyond {self.force_limit_kN:g} kN, {self.stroke_limit_mm:g} mm"
            )
        return ""


def reach(order: str, values: dict[str, Any]) -> tuple[float, float]:
    """Return the farthest stroke [mm] and the greatest speed [mm/s] that an order asks for, if obeyed.

    A change of a running sine has no frequency of its own: that of the suite's slowest fast sine, 1 Hz. On
    the way to a sine's mean it may step: the mean is a stroke like any other.
    """
    if order == "enable":
        return 0.0, 0.0  # it holds where it stands
    if "mean_mm" in values:
        mean, amplitude = values["mean_mm"], values["amplitude_mm"]
        lowest, highest = mean - abs(amplitude), mean + abs(amplitude)
        farthest = lowest if lowest < 0.0 else highest
        return farthest, 2.0 * math.pi * values.get("frequency_Hz", 1.0) * abs(amplitude)
    speed = values.get("speed_mm_per_s", 0.0)
    if order == "static":
        return values["stroke_limit_mm"], speed
    return values.get("target_mm", 0.0), speed


class Announced:
    """A controller that says each order before it gives it, lets the operator confirm, and keeps the bounds.

    Parameters
    ----------
    controller : Controller
        The real one.
    bounds : Bounds
        What was announced.
    say : callable
        Shows a line to the operator.
    confirmed : Confirmed
        Waits for the operator, calling what it is given to keep the stand alive; returns whether to go on.
    """

    MOTIONS = ("ramp", "harmonic", "static", "adjust_harmonic", "enable")
    SAFE = ("release", "hold", "disable")
    """They take away force or speed: said, never asked for."""

    def __init__(
        self,
        controller: Controller,
        bounds: Bounds,
        say: Say,
        confirmed: Callable[[Callable[[], object]], bool],
    ) -> None:
        self._controller = controller
        self._bounds = bounds
        self._say = say
        self._confirmed = confirmed

    def __getattr__(self, name: str) -> Any:
        member = getattr(self._controller, name)
        if name == "start":

            def started(motion: ControllerMotion, **how: Any) -> Any:
                self._before(motion.name, asdict(motion))
                return member(motion, **how)

            return started
        if not callable(member) or not name.startswith((*self.MOTIONS, *self.SAFE)):
            return member

        def ordered(**values: Any) -> Any:
            self._before(name, values)
            return member(**values)

        return ordered

    def _feed(self) -> None:
        """Feed while the operator thinks; before it is first switched on nothing needs it, and none may."""
        if self._controller.in_charge:
            self._controller.feed_watchdog()

    def _before(self, order: str, values: dict[str, Any]) -> None:
        if why := self._bounds.broken_by(order, values):
            raise OutOfBounds(why)
        parameters = ", ".join(f"{key} {value:.4g}" for key, value in values.items())
        self._say(f"NEXT: {order}  {parameters}")
        if order not in self.SAFE and not self._confirmed(self._feed):
            pytest.exit("the operator said no; the force is taken away", returncode=3)


def consent(stand: StandFile, bounds: Bounds, given: str | None, say: Say, terminal: TextIO | None) -> None:
    """Show what the suite will do on a stand and demand the stand's id; nothing is connected yet.

    Parameters
    ----------
    stand : StandFile
        The stand.
    bounds : Bounds
        The greatest that will be ordered.
    given : str or None
        What ``--yes-move`` says.
    say : callable
        Shows a line.
    terminal : TextIO or None
        Where the operator types; None: nobody is there.
    """
    if narrow := bounds.too_wide_for(stand.limits):
        pytest.exit(f"{stand.path}: [limits] are narrower than what this suite moves: {narrow}", returncode=2)
    movement = Movement("stand", stand.stand.id, (("stand", stand_text(stand)), ("in all", bounds.text())))
    say(movement.text())
    try:
        if given is None:
            if terminal is None:
                raise BadInput(f"no terminal to ask for consent: add --yes-move {stand.stand.id}")
            say("Is everybody clear of it, and a soft specimen in? Then type the stand's id: ")
            given = terminal.readline()
        check_given(movement, given)
    except BadInput as error:
        pytest.exit(str(error), returncode=2)


def confirmed_at(terminal: TextIO, say: Say) -> Confirmed:
    """Return what asks for Enter at a terminal, feeding the watchdog while the operator thinks."""

    def confirmed(alive: Callable[[], object]) -> bool:
        say("      Enter: go on; anything else: stop")
        while not select.select([terminal], [], [], FEED_S)[0]:
            alive()
        return terminal.readline() == "\n"

    return confirmed
