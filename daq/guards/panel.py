"""The guard panel: a loop over all guards of a stand, what they remember, and the latch of the first trip."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, get_args

from bufferstand.daq.guards.catalogue import kinds
from bufferstand.daq.guards.guard import Guard, GuardT
from bufferstand.daq.guards.kinds import (
    ControllerGuard,
    ControllerMemory,
    SignalsGuard,
    TemperatureGuard,
    new_limit,
)
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import (
    BegunAnew,
    CameBack,
    ClocksRead,
    Complaint,
    Computer,
    Happening,
    Judged,
    MotionOver,
    NewZero,
    PassOver,
    Phase,
    Recorded,
    RecorderState,
    RunBegun,
    Samples,
    Sight,
    Snapshot,
    SwitchedOn,
    ValveExpected,
)
from bufferstand.daq.guards.site import CONTROLLER_STREAM
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.guards.wiring import Limited
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers import ControllerStatus, SampleBlock, SensorFault, StreamFacts

AIR_C = 20.0
"""Temperature of the air where neither a thermometer nor the plan says it."""


class GuardSet:
    """Every guard of a stand, as data; it travels in the run file as the limits in force.

    Parameters
    ----------
    *parts : Guard or iterable of Guard
        The guards.
    complete : bool
        Whether those that stand in every set are added, where they are not named.

    Raises
    ------
    ValueError
        If two guards of a kind cannot be distinguished.
    """

    def __init__(self, *parts: Guard[Any] | Iterable[Guard[Any]], complete: bool = True) -> None:
        named = [one for part in parts for one in ((part,) if isinstance(part, Guard) else part)]
        there = {type(one) for one in named}
        standing = [kind() for kind in kinds() if complete and kind.standing and kind not in there]
        self._guards = tuple(sorted((*named, *standing), key=lambda one: one.turn))
        self._of: dict[type[Guard[Any]], tuple[Any, ...]] = {}
        places = [(one.kind, one.key) for one in self._guards]
        if twice := {place for place in places if places.count(place) > 1}:
            raise ValueError(f"more than one guard of the same name: {twice}")

    def __iter__(self) -> Iterator[Guard[Any]]:
        """Return the guards in the order in which they look."""
        return iter(self._guards)

    def of(self, kind: type[GuardT]) -> tuple[GuardT, ...]:
        """Return the guards of a kind."""
        if kind not in self._of:  # asked for with every block
            self._of[kind] = tuple(one for one in self._guards if isinstance(one, kind))
        return self._of[kind]

    def changed(self, kind: type[GuardT], change: Callable[[GuardT], GuardT]) -> GuardSet:
        """Return the set with every guard of a kind changed."""
        return GuardSet(change(one) if isinstance(one, kind) else one for one in self)

    def during(self, phase: Phase) -> GuardSet:
        """Return the set of those that look in a phase, as they do then."""
        found = (now for one in self if (now := one.during(phase)) is not None)
        return GuardSet(found, complete=False)

    def cooling(self) -> GuardSet:
        """Return the set for waiting at zero force: a warm specimen does not trip, a silent sensor does."""
        return self.during(Phase.COOLING)

    def valve_off(self) -> GuardSet:
        """Return the set for a stand that is not switched on: nothing follows a command."""
        return self.during(Phase.VALVE_OFF)

    def first_look(self) -> GuardSet:
        """Return the set for the look before anything moves.

        What the draw wires read then, where nobody has set their zero yet, is judged by its own limits
        (``[zero]``), which say what to do: a wire that is hooked in wrongly is no tilt.
        """
        return self.valve_off().during(Phase.FIRST_LOOK)

    def as_dict(self) -> dict[str, Any]:
        """Return the guards as data for the run file, by their kinds."""
        content: dict[str, Any] = {}
        for kind in kinds():
            own = [one.facts() for one in self._guards if type(one) is kind]
            if kind.facts_as != "none":
                content[kind.kind] = own if kind.facts_as == "list" else next(iter(own), None)
        return content

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> GuardSet:
        """Return those guards from their data that can look at a journal.

        Those of packages that are not installed here are left out.
        """
        found = []
        for kind in kinds():
            facts = content.get(kind.kind)
            if facts is not None and kind.in_journal:
                found += [kind.from_facts(one) for one in (facts if kind.facts_as == "list" else (facts,))]
        return cls(found, *(kind() for kind in kinds() if kind.standing and kind.in_journal), complete=False)


class GuardPanel:
    """Hands every block, reading, fault and status to the guards; the first trip is latched.

    Parameters
    ----------
    guards : GuardSet
        The guards; :meth:`change` replaces them between steps.
    wall_s : float
        Time of the wall at which it begins to listen [s].

    Attributes
    ----------
    at_s, wall_s : float
        Host stand time of what is looked at, and time of the wall [s].
    """

    def __init__(self, guards: GuardSet, *, wall_s: float) -> None:
        self._trip: Trip | None = None
        self._action = Action.NOTE
        self._said: list[Trip] = []
        self._tripped: set[str] = set()
        self._began_s = self.wall_s = wall_s
        self.at_s = 0.0
        self._known: dict[tuple[str, str], Guard[Any]] = {}
        self._memories: dict[tuple[str, str], Any] = {}
        self.cut_off = False
        """Whether an outage is being ridden out, which has its own end: no silence of the controller then."""
        self.explained_by = ""
        """What a device's fault that is seen now comes of: this program did not look meanwhile."""
        self.change(guards)

    @property
    def trip(self) -> Trip | None:
        """Return the trip that stops the stand (:meth:`latch`); it stays until :meth:`reset`."""
        return self._trip

    @property
    def action(self) -> Action:
        """Return the strongest action demanded since the last reset."""
        return self._action

    def said(self) -> list[Trip]:
        """Return (and forget) every trip and note since the last call, in the order they came."""
        said, self._said = self._said, []
        return said

    def latch(self, trip: Trip) -> None:
        """Take a trip from a guard or from outside (operator, recorder, lost link).

        The first one that demands a stop is kept; later ones can only make the action stronger. What the
        operator asked for behind the cycle gives way to a stronger one: that is what stopped the stand. The
        same guard is said once per latch.
        """
        if trip.action is Action.NOTE:
            self._said.append(trip)
            return
        if self.explained_by and trip.device_fault and self._trip is None:
            trip = replace(trip, reason=f"{self.explained_by}: {trip.reason}")
        if trip.action > self._action or trip.guard not in self._tripped:
            self._said.append(trip)
        gives_way = self._trip is not None and self._trip.guard == "operator" and trip.action > self._action
        self._tripped.add(trip.guard)
        self._action = max(self._action, trip.action)
        if self._trip is None or gives_way:
            self._trip = trip

    def reset(self) -> None:
        """Forget the latch, not what was seen: a condition that lasts trips again at once."""
        self._trip, self._action = None, Action.NOTE
        self._tripped.clear()

    def change(self, guards: GuardSet) -> None:
        """Replace the guards (limits of another step); what was seen of the sensors is kept."""
        self.guards = guards
        self._in_force = [((guard.kind, guard.key), guard) for guard in guards]
        self._asked = {
            sight: [one for one in self._in_force if sight in one[1].looks_at] for sight in get_args(Sight)
        }
        for place, guard in self._in_force:
            self._known[place] = guard
            if place not in self._memories:
                self._memories[place] = guard.begin(self._began_s)

    # --- the loop ------------------------------------------------------------------------------------

    def _ask(self, sight: Sight, at_s: float, wall_s: float | None = None) -> None:
        """Have every guard look, and latch what it says."""
        self.at_s = at_s
        self.wall_s = self.wall_s if wall_s is None else wall_s
        for place, guard in self._asked[type(sight)]:
            self._memories[place], found = guard.look(self._memories[place], sight, self)
            if found is not None:
                for trip in (found,) if isinstance(found, Trip) else found:
                    self._take(trip)

    def _take(self, trip: Trip) -> None:
        """Latch a trip, with what the doubting guards say of it; under either name it is said once."""
        own = trip
        if trip.believed and self._trip is None:
            for place, guard in self._in_force:
                trip = guard.explained(self._memories[place], trip, self)
        self.latch(trip)
        if own is not trip and own.action > Action.NOTE:
            self._tripped.add(own.guard)

    def _happened(self, happening: Happening) -> None:
        """Tell every guard that there was, also one that is not in force now."""
        for place, guard in self._known.items():
            after = guard.after(self._memories[place], happening)
            self._memories[place] = guard.begin(self._began_s) if after is None else after

    def observe(
        self,
        block: ScaledBlock,
        wall_s: float,
        raw: SampleBlock | None = None,
        facts: StreamFacts | None = None,
    ) -> None:
        """Judge every sample of a block of any stream; ``raw`` and ``facts`` where its counts are known."""
        self._ask(Samples(block, raw, facts), block.received_s, wall_s)
        if block.stream != CONTROLLER_STREAM:
            self._ask(Judged(block), block.received_s, wall_s)

    def complain(self, fault: SensorFault) -> None:
        """Take a reading that could not be had: it explains the silence, should it last."""
        self._ask(Complaint(fault), self.at_s)

    def judge(
        self,
        status: ControllerStatus,
        at_s: float,
        wall_s: float,
        *,
        sampled_kN: float | None = None,
        age_s: float | None = None,
        up_to_date: bool = True,
    ) -> None:
        """Judge a snapshot of the controller (:class:`bufferstand.daq.guards.sights.Snapshot`)."""
        self._ask(Snapshot(status, sampled_kN, age_s, up_to_date), at_s, wall_s)

    def look_at_recorder(self, recorder: RecorderState, at_s: float) -> None:
        """Judge the recorder of the run under way."""
        self._ask(Recorded(recorder), at_s)

    def listen(self, at_s: float, wall_s: float, computer: Computer | None = None) -> None:
        """Judge every silence; called in each pass, after all that came in was observed."""
        self._ask(PassOver(computer), at_s, wall_s)

    def look_once_more(self, at_s: float) -> bool:
        """Ask for what was not looked at yet, as a motion has ended.

        Returns
        -------
        bool
            Whether a guard has begun to doubt, and will know from what comes next.
        """
        self._ask(MotionOver(), at_s)
        return any(guard.is_unsure(self._memories[place]) for place, guard in self._in_force)

    def margins(self, wall_s: float) -> list[Margin]:
        """Return how far every guard is from its trip now [s of the wall], the gravest action first."""
        self.wall_s = wall_s
        found = [guard.margin(self._memories[place], self) for place, guard in self._in_force]
        return sorted(found, key=lambda one: -one.action)

    # --- what happens --------------------------------------------------------------------------------

    def rebase(self, *, counted: bool = False) -> None:
        """Forget the values of the controller's channels seen so far: they count from another zero now.

        Parameters
        ----------
        counted : bool
            Whether that zero is first contact; else channels are as their calibrations say.
        """
        self._happened(NewZero(counted))

    def switched_on(self) -> None:
        """Forgive nothing from now on: what the controller showed from before has been reset."""
        self._happened(SwitchedOn())

    def expect_valve(self, on: bool | None) -> None:
        """Expect the controller's valve on or off from now on; None while this program switches it."""
        self._happened(ValveExpected(on))

    def came_back(self, wall_s: float) -> None:
        """Judge silence and lag again from now on [s of the wall]: an outage is over."""
        self.cut_off = False
        self._happened(CameBack(wall_s))

    def begin_anew(self, wall_s: float) -> None:
        """Listen as at a start from now on [s of the wall]: nothing that was seen before is believed.

        What the controller shows is from before; where its valve is to be, and the zero, stay.
        """
        self._began_s = wall_s
        self._happened(BegunAnew(wall_s))
        self.cut_off = False

    def begin_run(self) -> None:
        """Take that another run is recorded from now on."""
        self._happened(RunBegun())

    def read_clocks(self, civil_s: float, steady_s: float, at_s: float) -> None:
        """Count this computer's clocks from these [s]."""
        self._happened(ClocksRead(civil_s, steady_s, at_s))

    # --- what others ask -----------------------------------------------------------------------------

    def guard(self, kind: type[GuardT]) -> GuardT | None:
        """Return the guard of a kind that is in force, None without one."""
        return next(iter(self.guards.of(kind)), None)

    @property
    def _controller(self) -> ControllerMemory:
        memory: ControllerMemory = self._memories[ControllerGuard.kind, ""]
        return memory

    def has_limited(self, status: ControllerStatus) -> Limited | None:
        """Return what a limit of the device's own was of that has just ended a motion; None without one.

        The samples that led to it are to be observed before it is judged: they say whether it was the wiring.
        """
        return None if self._trip is not None else new_limit(self._controller, status)

    @property
    def old_fault(self) -> int | None:
        """Return the fault that the controller shows from before, and that switching on resets."""
        return self._controller.forgiven

    @property
    def ambient_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the temperature of the air [°C]: a thermometer's, else as planned."""
        latest = self.latest_temperatures()
        for guard in self.guards.of(TemperatureGuard):
            if guard.resume_C is None and guard.stream in latest:
                return latest[guard.stream]
        wiring = self.guard(SignalsGuard)
        return AIR_C if wiring is None else wiring.ambient_C

    def latest_temperatures(self) -> Mapping[str, float]:
        """Return the last true reading of every sensor that gave one [°C]."""
        return {
            guard.stream: value_C
            for guard in self.guards.of(TemperatureGuard)
            if (value_C := self._value_C(guard)) is not None
        }

    def warmer_than(self, limit_C: float | None = None) -> str:
        """Return which specimen sensor is not at or below a temperature (or silent), empty if none.

        Parameters
        ----------
        limit_C : float, optional
            The temperature [°C]; without it each sensor's own resume threshold counts.
        """
        for guard in self.guards.of(TemperatureGuard):
            if guard.resume_C is None:
                continue
            wanted_C = guard.resume_C if limit_C is None else limit_C
            value_C = self._value_C(guard)
            if value_C is None:
                return f"{guard.label} has given no reading yet"
            if value_C > wanted_C:
                return (
                    f"{guard.label} is at {value_C:.2f} °C, to go on it must be at or below {wanted_C:g} °C"
                )
        return ""

    def specimen_temperatures(self) -> Mapping[str, float | None]:
        """Return the last true reading of every sensor that touches the specimen [°C], by its label."""
        return {
            guard.label: self._value_C(guard)
            for guard in self.guards.of(TemperatureGuard)
            if guard.resume_C is not None
        }

    def _value_C(self, guard: TemperatureGuard) -> float | None:  # noqa: N802 - as above
        value_C: float | None = self._memories[guard.kind, guard.key].value_C
        return value_C
