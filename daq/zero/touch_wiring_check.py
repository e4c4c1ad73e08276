"""What a touch says of the wiring, as trips: after it, and instead of what ended it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.acquisition import Acquisition, CollectedSamples
from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.guards.kinds import ControllerGuard, SignalsGuard
from bufferstand.daq.guards.wiring import (
    SampleStretch,
    SignalDoubt,
    TouchOutcome,
    doubt_of_touch,
    doubt_trip,
    has_risen,
    scatter_doubt,
)
from bufferstand.daq.motions import Halt
from bufferstand.daq.scaling import FORCES
from bufferstand.drivers import EndReason
from bufferstand.foundation.channels import STROKE_CHANNELS

SIGNALS = ("command", "position", *STROKE_CHANNELS, "force")
EXPLAINED = (*FORCES, "zero", "tilt", "stroke", "speed", "following error")
"""Guards whose trips in a touch may be for a wrong wire; those of wiring may have a better reason."""


class TouchWiringCheck:
    """Doubts the signals of a touch, where the campaign holds them against each other.

    Parameters
    ----------
    acquisition : Acquisition
        With the guards in force.
    say : callable
        Shows a line that must not be missed.
    """

    def __init__(self, acquisition: Acquisition, say: Callable[[str], object]) -> None:
        self._acquisition = acquisition
        self._say = say

    def judge(self, samples: CollectedSamples, asked_kN: float) -> None:
        """Stop where a touch that was made speaks against a signal; say it where that is only noted.

        Raises
        ------
        Halt
            Then.
        """
        if (trip := self._doubted(samples, asked_kN)) is None:
            return
        if trip.action is not Action.NOTE:
            raise Halt(trip)
        self._say(f"WARNING: {trip.reason}")
        self._acquisition.log.say("note", trip.reason, **trip.facts())

    def is_to_come(self, samples: CollectedSamples, asked_kN: float) -> bool:
        """Return whether the controller turned, and the force has not risen yet: it may be late."""
        touch = self._touch(samples, asked_kN)
        return touch is not None and touch.turned and not has_risen(touch)

    def is_by_force(self, halt: Halt) -> bool:
        """Return whether a touch was ended by a force that may be late: what follows the stop tells it."""
        return self._acquisition.panel.guard(SignalsGuard) is not None and halt.trip.guard in FORCES

    def explained(self, halt: Halt, samples: CollectedSamples, asked_kN: float) -> Halt:
        """Return what stopped a touch, with what it says of the wiring where that is why."""
        guard = halt.trip.guard
        if guard not in EXPLAINED and not guard.startswith("wiring of"):
            return halt
        doubted = self._doubted(samples, asked_kN, halted=True)
        if doubted is None or doubted.action is Action.NOTE or "scatters by" in halt.trip.reason:
            return halt
        action = max(halt.trip.action, doubted.action)
        reason = doubted.reason if guard.startswith("wiring of") else f"{doubted.reason}; {halt.trip.reason}"
        return Halt(replace(doubted, action=action, reason=reason))

    def scatters(self, rest: NDArray[np.float64], second: NDArray[np.float64], given_kN: float) -> None:
        """Stop for a force that scatters too much at rest for a touch.

        Raises
        ------
        Halt
            Where signals are compared with each other, and a doubt stops the campaign.
        """
        guard = self._acquisition.panel.guard(SignalsGuard)
        if guard is not None and guard.action is not Action.NOTE:
            raise Halt(self._trip(scatter_doubt(rest, second, given_kN), guard.action))

    def _doubted(self, samples: CollectedSamples, asked_kN: float, *, halted: bool = False) -> Trip | None:
        guard = self._acquisition.panel.guard(SignalsGuard)
        touch = self._touch(samples, asked_kN, halted=halted)
        if guard is None or touch is None:
            return None
        doubt = doubt_of_touch(touch, guard)
        return None if doubt is None else self._trip(doubt, guard.action)

    def _trip(self, doubt: SignalDoubt, action: Action) -> Trip:
        return doubt_trip(doubt, action, self._acquisition.clock.now_s())

    def _touch(
        self, samples: CollectedSamples, asked_kN: float, *, halted: bool = False
    ) -> TouchOutcome | None:
        """Return the touch as its samples show it, each moved by its stated delay; None without a guard."""
        guard = self._acquisition.panel.guard(SignalsGuard)
        if guard is None or len(samples) < 2:
            return None
        time_s = samples.time_s()
        force_late_s = guard.delays_s.get("force", 0.0)
        values = {}
        for name in SIGNALS:
            value = samples.column(name)
            if len(value) == len(time_s):
                late_s = force_late_s - guard.delays_s.get(name, 0.0)
                values[name] = value if not late_s else np.interp(time_s - late_s, time_s, value)
        controller = self._acquisition.panel.guard(ControllerGuard)
        own_clock = controller is not None and controller.own_clock
        second_s = time_s  # where the controller samples it, too
        if "force_2" not in samples.names:
            second_s = samples.other_time_s("force_2", device_clock=own_clock)
        second_s = second_s + force_late_s - guard.delays_s.get("force_2", 0.0)
        status = self._acquisition.latest.status
        return TouchOutcome(
            SampleStretch(time_s, values, second_s, samples.column("force_2")),
            asked_kN,
            status is not None and status.end_reason is EndReason.FORCE_LIMIT,
            None if status is None else status.force_kN,
            halted,
        )
