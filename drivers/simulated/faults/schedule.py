"""Faults that a simulated stand can be told to show: which, of which device, when, and how.

The names are the same in a fault file, on the command line, over the control socket and in process; what each
does and what the engineer sees of it is in docs/simulated-stand.md.
"""

from __future__ import annotations

import difflib
import random
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from bufferstand.drivers.register_maps import quantity_of
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.foundation.settings import alternatives, shown

Setting = float | str
"""A parameter of a fault: a number, or a name."""

_SHARE: Mapping[str, Setting] = {"share": 1.0}
_FRAMES: Mapping[str, Mapping[str, Setting]] = {
    "drop": _SHARE,
    "delay": {"share": 1.0, "delay_s": 1.0},
    "corrupt": _SHARE,
    "duplicate": _SHARE,
    "reorder": _SHARE,
}
_ON_LINE = {kind: settings for kind, settings in _FRAMES.items() if kind != "reorder"}
FRAME_KINDS = tuple(_FRAMES)
"""Faults of what is sent: ``share`` of all frames, picked by the schedule's seed."""

FAULTS: Mapping[str, Mapping[str, Mapping[str, Setting]]] = {
    "controller": {
        "lost": {},
        **_FRAMES,
        "request-drop": _SHARE,
        "request-corrupt": _SHARE,
        "exception": {"share": 1.0, "code": 4.0},
        "stuck": {"register": "heartbeat"},
        "nan": {"register": "force"},
        "trip": {"code": 4.0},
        "watchdog": {},
        "clock-jump": {"jump_s": 1.0},
        "overrun": {"keep": 0.0},
    },
    "channel": {"broken": {"side": "low"}, "stuck": {}},
    "amplifier": {"silent": {}, "overload": {}, "resync": {"bytes": 2.0}, **_ON_LINE},
    "acquisition": {"silent": {}},
    "temperature": {
        kind: {}
        for kind in (
            "silent", "crc", "crc-mismatch", "all-zero", "power-on", "no-power", "out-of-range",
            "unreadable", "garbled", "missing", "frozen", "stale", "shorted", "unfinished", "unpowered",
        )
    },
}  # fmt: skip
"""By class of device: each fault's name with its parameters and what they are if not given."""

ONCE = ("trip", "watchdog", "clock-jump", "overrun", "resync")
"""Faults that happen at an instant; the others last."""
_MEASURED = ("force", *STROKE_CHANNELS, "position")
"""Channels whose transducer can fail, as messages name them; of further ones those that can, too."""
FOREVER_S = float("inf")

_NAMES: Mapping[str, Sequence[str]] = {"side": ("low", "high")}
_MOST: Mapping[str, float] = {"share": 1.0, "code": 255.0, "delay_s": 60.0, "bytes": 64.0, "keep": 65536.0}
_TARGET = re.compile(r"^temperature_[1-9][0-9]*$")
_INSTRUMENT = re.compile(r"^(amplifier|sensor)(_([2-9]|[1-9][0-9]+))?$")
_ACQUISITION = re.compile(r"^acquisition(_([2-9]|[1-9][0-9]+))?$")
_NUMBER = r"[0-9]+(?:\.[0-9]*)?"
_FORM = re.compile(
    rf"^(?P<target>[a-z][a-z0-9_]*)=(?P<kind>[a-z0-9-]+)(?:@(?P<start>{_NUMBER})(?::(?P<end>{_NUMBER}))?)?"
    r"(?P<rest>(?:,[^,=]+=[^,=]+)*)$"
)
FORM = "TARGET=KIND@START[:END][,KEY=VALUE]…"


@dataclass(frozen=True)
class ScheduledFault:
    """A fault of one device between two instants of stand time.

    Parameters
    ----------
    target : str
        ``controller``, ``amplifier``, ``sensor_2``, ``temperature_1`` … or a measured channel of the
        controller.
    kind : str
        Name of the fault, see :data:`FAULTS`.
    start_s, end_s : float
        Stand time [s]; the end of a fault that happens at an instant means nothing.
    settings : mapping
        Its parameters; those that are not there are as :data:`FAULTS` says.

    Raises
    ------
    BadInput
        If there is no such target or fault, or a parameter is none that it has.
    """

    target: str
    kind: str
    start_s: float
    end_s: float = FOREVER_S
    settings: Mapping[str, Setting] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        known = FAULTS[target_class(self.target)]
        if self.kind not in known:
            raise BadInput(
                f"{self.target} has no fault “{self.kind}”{nearest(self.kind, known)}",
                place=f"fault {self.target}={self.kind}",
                remedy=f"its faults: {', '.join(known)}",
            )
        if not 0.0 <= self.start_s < self.end_s:
            raise BadInput(
                f"a fault from {self.start_s:g} s to {self.end_s:g} s is none",
                place=f"fault {self.target}={self.kind}",
                remedy="let it begin at 0 or later, and end after that",
            )
        for key, value in self.settings.items():
            self._demand(key, value, known[self.kind])

    def _demand(self, key: str, value: Setting, known: Mapping[str, Setting]) -> None:
        place = f"fault {self.target}={self.kind}"
        if key not in known:
            has = f"it has {', '.join(known)}" if known else "it has none"
            raise BadInput(f"it has no parameter “{key}”{nearest(key, known)}", place=place, remedy=has)
        wanted = "a number" if isinstance(known[key], float) else "a name"
        if isinstance(value, str) != isinstance(known[key], str):
            raise BadInput(f"{key} = {shown(value)} is not possible", place=place, remedy=f"write {wanted}")
        if isinstance(value, str):
            if key in _NAMES and value not in _NAMES[key]:
                named = alternatives(_NAMES[key])
                raise BadInput(f"{key} = “{value}” is not known", place=place, remedy=f"write {named}")
        elif self.kind == "trip" and value not in (1.0, 2.0, 3.0, 4.0):
            raise BadInput(
                f"code = {value:g} is not known",
                place=place,
                remedy="write 1 (watchdog), 2 (force limit), 3 (stroke limit) or 4 (actuator)",
            )
        elif not (0.0 <= value <= _MOST.get(key, FOREVER_S) or key == "jump_s"):
            most = f"from 0 to {_MOST[key]:g}" if key in _MOST else "of 0 or more"
            raise BadInput(f"{key} = {value:g} is not possible", place=place, remedy=f"write a number {most}")

    def number(self, key: str) -> float:
        """Return a parameter that is a number."""
        return float(self._setting(key))

    def name(self, key: str) -> str:
        """Return a parameter that is a name."""
        return str(self._setting(key))

    def _setting(self, key: str) -> Setting:
        return self.settings.get(key, FAULTS[target_class(self.target)][self.kind][key])

    def __str__(self) -> str:
        """Return it as it is written on the command line."""
        end = "" if self.end_s == FOREVER_S else f":{self.end_s:g}"
        more = "".join(
            f",{key}={value}" if isinstance(value, str) else f",{key}={value:g}"
            for key, value in self.settings.items()
        )
        return f"{self.target}={self.kind}@{self.start_s:g}{end}{more}"


class FaultSchedule:
    """Which faults a stand shows at an instant.

    Parameters
    ----------
    faults : sequence of ScheduledFault
    seed : int
        By which the frames are picked that a fault with a ``share`` strikes.
    """

    def __init__(self, faults: Sequence[ScheduledFault] = (), seed: int = 0) -> None:
        self._faults = list(faults)
        self._done: list[ScheduledFault] = []
        self.random = random.Random(seed)

    def add(self, fault: ScheduledFault) -> None:
        """Add a fault."""
        self._faults.append(fault)

    def clear(self, target: str | None = None) -> int:
        """Forget the faults of a target, or all; return how many."""
        kept = [fault for fault in self._faults if target not in (None, fault.target)]
        forgotten = len(self._faults) - len(kept)
        self._faults = kept
        return forgotten

    @property
    def faults(self) -> tuple[ScheduledFault, ...]:
        """All that were given, those that are over too."""
        return tuple(self._faults)

    def at(self, target: str, time_s: float) -> str | None:
        """Return the name of the lasting fault that ``target`` shows at stand time ``time_s`` [s]."""
        for fault in self._faults:
            if fault.target == target and fault.kind not in ONCE and _lasts(fault, time_s):
                return fault.kind
        return None

    def find(self, target: str, kind: str, time_s: float) -> ScheduledFault | None:
        """Return the fault of that kind that ``target`` shows at stand time ``time_s`` [s]."""
        for fault in self._faults:
            if fault.target == target and fault.kind == kind and _lasts(fault, time_s):
                return fault
        return None

    def strikes(self, target: str, kind: str, time_s: float) -> ScheduledFault | None:
        """Return the fault of that kind if it strikes now: in its time, and by its share."""
        fault = self.find(target, kind, time_s)
        if fault is None or self.random.random() >= fault.number("share"):
            return None
        return fault

    def due(self, time_s: float, target: str | None = None) -> list[ScheduledFault]:
        """Return, each once, the faults of an instant that has come by stand time ``time_s`` [s]."""
        due = [
            fault
            for fault in self._faults
            if fault.kind in ONCE
            and fault.start_s <= time_s
            and fault not in self._done
            and target in (None, fault.target)
        ]
        self._done += due
        return due

    def next_change_s(self, time_s: float) -> float:
        """Return when the next fault begins or ends after stand time ``time_s`` [s]; infinite if none."""
        edges = [edge for fault in self._faults for edge in (fault.start_s, fault.end_s) if edge > time_s]
        return min(edges, default=FOREVER_S)


def target_class(target: str) -> str:
    """Return which row of :data:`FAULTS` a target belongs to.

    Raises
    ------
    BadInput
        If there is no such target.
    """
    if target == "controller":
        return target
    if _INSTRUMENT.match(target):
        return "amplifier"
    if _ACQUISITION.match(target):
        return "acquisition"
    if _TARGET.match(target):
        return "temperature"
    if quantity_of(target) not in (None, "command"):
        return "channel"
    known = ("controller", "amplifier", *_MEASURED, "temperature_1")
    raise BadInput(
        f"there is no “{target}” that could fail{nearest(target, known)}",
        place=f"fault {target}",
        remedy=f"{', '.join(known)} …",
    )


def parse_fault(
    text: str, *, file: str = "--fault", start_s: Callable[[], float] | None = None
) -> ScheduledFault:
    """Return the fault that ``TARGET=KIND@START[:END][,KEY=VALUE]…`` describes (stand time in s).

    Parameters
    ----------
    text : str
        As a user writes it.
    file : str
        Where it was written, for messages.
    start_s : callable, optional
        When one without ``@START`` begins [s]; without it there must be a start.

    Raises
    ------
    BadInput
        If it does not have this form, or the target cannot have this fault.
    """
    found = _FORM.match(text.strip())
    if found is None or (found["start"] is None and start_s is None):
        raise BadInput(
            f"“{text}” is no fault that can be simulated",
            file=file,
            remedy=f"write {FORM}, e.g. controller=lost@12:15, controller=corrupt@30:60,share=0.05, "
            "amplifier=silent@30 or temperature_1=power-on@30",
        )
    settings = {
        key.strip(): _setting(value.strip())
        for key, _, value in (part.partition("=") for part in found["rest"].split(",")[1:])
    }
    start = float(found["start"]) if found["start"] or start_s is None else start_s()
    end = float(found["end"]) if found["end"] else FOREVER_S
    try:
        return ScheduledFault(found["target"], found["kind"], start, end, settings)
    except BadInput as error:
        problem = f"“{text}” is no fault that can be simulated: {error.problem}"
        raise BadInput(problem, file=file, remedy=error.remedy) from None


def nearest(name: str, known: Mapping[str, object] | Sequence[str]) -> str:
    """Return “; did you mean …?” for a name that is nearly one of those known, else nothing."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean “{near[0]}”?" if near else ""


def _setting(text: str) -> Setting:
    try:
        return float(text)
    except ValueError:
        return text


def _lasts(fault: ScheduledFault, time_s: float) -> bool:
    return fault.start_s <= time_s < fault.end_s
