"""The guard of the wiring: signals that must fit each other, the command and the plan."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, Self

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import (
    BegunAnew,
    Happening,
    Judged,
    MotionOver,
    NewZero,
    Phase,
    Samples,
    Sight,
)
from bufferstand.daq.guards.site import CONTROLLER_STREAM, Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.guards.wiring import WiringGuard, WiringWatch
from bufferstand.daq.scaling import ScaledBlock


@dataclass(frozen=True)
class SignalsGuard(WiringGuard, Guard[WiringWatch]):
    """What signals are compared with, as a guard: it doubts every signal that the others believe."""

    kind: ClassVar = "wiring"
    title: ClassVar = "signals fit each other, the command and the plan"
    settings: ClassVar = ("guards.force_against_model_factor", "guards.action.wiring")
    facts_as: ClassVar[Literal["list", "one", "none"]] = "one"
    docs: ClassVar = ("`wiring of …`",)
    looks_at: ClassVar = (Samples, Judged, MotionOver)
    turn: ClassVar = 40  # before the limits: it says more of a wrong sign than the limit that it breaks
    remembers: ClassVar = WiringWatch

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return it for a campaign; of motions by hand nothing is expected."""
        if site.plan is not None:
            # Plans bring the spring model's libraries: not before somebody has a plan.
            from bufferstand.daq.guards.wiring import wiring_guard  # noqa: PLC0415

            expected = wiring_guard(
                site.plan,
                site.stand,
                site.predictor,
                action=site.does("wiring"),
                force_factor=site.table.force_against_model_factor,
                ambient=site.ambient,
                speed=site.speed,
            )
            yield cls(**vars(expected))

    def look(self, memory: WiringWatch, sight: Sight, beside: Beside) -> tuple[WiringWatch, Found]:
        """Judge samples: a sensor's after its own guard has said whether the reading is true."""
        match sight:
            case Samples(block=block) if block.stream == CONTROLLER_STREAM:
                return memory, self._observed(memory, block, beside)
            case Judged(block=block):
                return memory, self._observed(memory, block, beside)
            case MotionOver():
                return memory, memory.look_once_more(self, beside.latest_temperatures(), beside.at_s)
        return memory, None

    def _observed(self, memory: WiringWatch, block: ScaledBlock, beside: Beside) -> list[Trip]:
        controller = beside.guard(ControllerGuard)
        return memory.observe(
            self,
            block,
            beside.latest_temperatures(),
            controller=block.stream == CONTROLLER_STREAM,
            device_clock=controller is not None and controller.own_clock,
        )

    def after(self, memory: WiringWatch, happening: Happening) -> WiringWatch:
        """Return its memory, which knows itself what to forget."""
        match happening:
            case NewZero(counted=counted):
                memory.rebase(counted=counted)
            case BegunAnew():
                memory.begin_anew()
        return memory

    def during(self, phase: Phase) -> Self:
        """Return it for so much of force, strokes and position as is compared with each other."""
        match phase:
            case Phase.VALVE_OFF:
                return replace(self, motion="none")
            case Phase.TOUCH:
                return replace(self, motion="piston")
        return self

    def explained(self, memory: WiringWatch, trip: Trip, beside: Beside) -> Trip:
        """Return the trip of a limit with what the wiring says of it: its signal may be none."""
        if self.action is Action.NOTE:
            return trip
        own = [value for name, value in beside.latest_temperatures().items() if name in self.specimen]
        return memory.explained(self, trip, max(own, default=None), trip.limited)

    def is_unsure(self, memory: WiringWatch) -> bool:
        """Return whether a judge has begun to doubt."""
        return memory.begun

    def margin(self, memory: WiringWatch, beside: Beside) -> Margin:
        """Return what it watches for: no single number shows it."""
        text = f"signals must fit each other and the plan (force within a factor of {self.force_factor:g})"
        return Margin("wiring", "wiring of every signal", text, None, self.action)

    @classmethod
    def from_facts(cls, facts: Any) -> Self:
        """Return it from its data, for its margin: what it was compared with is left out."""
        action = Action[facts["action"].upper()]
        return cls(action=action, force_factor=facts["force_factor"], motion="none")
