"""Troubles that a world can have: what strikes, in which start of the campaign, and when."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from tests.daq.fault_matrix import every_fault
from tests.worlds.death import STEPS

Kind = Literal["device", "disk", "clock", "memory", "operator", "second program", "kill"]
PHASES = ("start", "touch", "ramp", "motion", "hold", "release", "cool-down", "safe stop")
"""Phases of a campaign (``CampaignProgress.phase``) in which a trouble can strike."""
SHARES: Mapping[Kind, int] = {
    "device": 10, "disk": 2, "clock": 1, "memory": 2, "operator": 3, "second program": 2, "kill": 6,
}  # fmt: skip
"""How often each kind is drawn, relative to the others."""
WHATS: Mapping[Kind, tuple[str, ...]] = {
    "disk": ("full", "slow"),
    "clock": ("set",),
    "memory": ("append", "request", "seal", "record"),
    "operator": ("stop now", "stop after cycle", "stop after step", "note"),
    "second program": ("enable",),
    "kill": ("anywhere", *STEPS),
}


@dataclass(frozen=True)
class Trouble:
    """One thing that goes wrong in one start of a campaign.

    Parameters
    ----------
    kind : Kind
        Class of the cause.
    what : str
        Which of that class; of a device's fault ``TARGET=KIND``.
    start : int
        In which start of the campaign, from 0.
    phase : str
        It strikes so long after this phase was first seen; empty: after the start began.
    after_s : float
        So long [s of stand time].
    for_s : float or None
        A device's fault lasts so long [s], None: until the next start; of the disk: how slow it is [s]; of
        the clock: by how much it is set [s].
    count : int
        A kill comes at the so-many-th time that its step is reached.
    settings : mapping
        Parameters of a device's fault.
    """

    kind: Kind
    what: str
    start: int
    phase: str
    after_s: float
    for_s: float | None = None
    count: int = 1
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Return kind and what, for tables."""
        return f"{self.kind}: {self.what}"

    def words(self) -> str:
        """Return it in words."""
        when = f"{self.after_s:.3g} s after " + (f"“{self.phase}” began" if self.phase else "the start")
        more = "".join(f", {key} {value}" for key, value in self.settings.items())
        if self.kind == "kill":
            times = "" if self.what == "anywhere" else f", at the {self.count}. “{self.what}” from then on"
            return f"start {self.start + 1}: killed {when}{times}"
        if self.kind == "clock":
            return f"start {self.start + 1}: the civil time is set by {self.for_s:+.0f} s, {when}"
        if self.what == "slow":
            return f"start {self.start + 1}: the disk takes {self.for_s:.2g} s more to sync, {when}"
        lasts = f" for {self.for_s:.2g} s" if self.for_s is not None else ""
        return f"start {self.start + 1}: {self.name}{more}{lasts}, {when}"


def draw_troubles(dice: random.Random, number: int, phases: tuple[str, ...]) -> tuple[Trouble, ...]:
    """Draw so many troubles, for campaigns that go through these phases; sorted by start."""
    found = []
    for _ in range(number):
        kind: Kind = dice.choices(list(SHARES), list(SHARES.values()))[0]
        found.append(_draw(dice, kind, dice.choice((0, 0, 0, 1, 1, 2)), phases))
    starts = sorted({one.start for one in found})
    # A start without troubles would complete the campaign, and those behind it would strike nobody.
    return tuple(sorted((_moved(one, starts.index(one.start)) for one in found), key=lambda one: one.start))


def _moved(trouble: Trouble, start: int) -> Trouble:
    return Trouble(**{**vars(trouble), "start": start})


def _draw(dice: random.Random, kind: Kind, start: int, phases: tuple[str, ...]) -> Trouble:
    phase = dice.choice(("", "", *phases))
    after_s = dice.uniform(0.0, 14.0) if not phase else dice.choice((0.0, dice.uniform(0.0, 4.0)))
    for_s: float | None = None
    settings: Mapping[str, Any] = {}
    if kind == "device":
        target, fault, settings = dice.choice(every_fault())
        what = f"{target}={fault}"
        for_s = dice.choice((None, None, dice.uniform(0.05, 8.0)))
        if fault in ("drop", "corrupt", "duplicate", "delay", "reorder", "request-drop", "request-corrupt"):
            settings = {**settings, "share": dice.choice((1.0, 0.5, 0.05))}
    else:
        what = dice.choice(WHATS[kind])
    if what == "slow":
        for_s = dice.choice((0.3, 1.0, 30.0))
    if kind == "clock":
        for_s = dice.choice((3600.0, -3600.0, 5.0))
    count = 1
    if kind == "kill":
        count = dice.choice((1, 1, 2, 5)) if what != "request-sent" else dice.randint(1, 200)
    return Trouble(kind, what, start, phase, after_s, for_s, count, settings)
