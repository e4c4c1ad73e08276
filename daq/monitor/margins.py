"""How far every guard is from its trip, from its data in the run file and the newest values."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

WINDOW_S = 10.0
"""Extremes of so long count [s of stand time]: a peak is to be read before it is gone."""
SPEED_S = 0.02
"""Speed is a difference over at least so long [s]: over less it is noise."""
RATE_S = 20.0
"""Heating is a difference over at least half of so long [s], as the guard's."""


@dataclass(frozen=True)
class Margin:
    """One guard on the screen.

    Parameters
    ----------
    name, label : str
        The guard, and how a person calls it.
    text : str
        Value, limit and distance in words; what it watches for where there is no number.
    share : float or None
        How much of the way to the trip is used: 0 none, 1 tripped.
    action : str
        What its trip leads to.
    """

    name: str
    label: str
    text: str
    share: float | None
    action: str = ""


@dataclass
class Recent:
    """What margins are computed from: the newest values, and extremes of the last ``WINDOW_S``."""

    at_s: float = 0.0
    extremes: deque[tuple[float, Mapping[str, Sequence[float | None]]]] = field(default_factory=deque)
    readings: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    silent_s: Mapping[str, float] = field(default_factory=dict)
    waiting_samples: int = 0
    rate_Hz: float = 0.0

    def add(self, at_s: float, extremes: Mapping[str, Sequence[float | None]]) -> None:
        """Take the extremes of a packet; old ones are forgotten."""
        self.at_s = at_s
        if extremes:
            self.extremes.append((at_s, extremes))
        while self.extremes and not 0.0 <= at_s - self.extremes[0][0] <= WINDOW_S:
            self.extremes.popleft()

    def span(self, signal: str) -> tuple[float, float] | None:
        """Return least and greatest value of a signal in the window, None if there is none."""
        seen = [extreme[signal] for _, extreme in self.extremes if signal in extreme]
        least = [low for low, _ in seen if low is not None]
        greatest = [high for _, high in seen if high is not None]
        return (min(least), max(greatest)) if least and greatest else None

    def heating_K_per_min(self, stream: str) -> float | None:  # noqa: N802 - the unit keeps its capital
        """Return how fast a sensor warms up, None where its readings reach back too little."""
        kept = self.readings.get(stream, [])
        last = [reading for reading in kept if kept[-1][0] - reading[0] <= RATE_S]
        if len(last) < 2 or last[-1][0] - last[0][0] < RATE_S / 2.0:
            return None
        return 60.0 * (last[-1][1] - last[0][1]) / (last[-1][0] - last[0][0])


def top_speed(rows: Mapping[str, Any]) -> float | None:
    """Return the greatest speed [mm/s] in the rows of a packet, None where they are too few."""
    time, stroke = rows.get("t", []), rows.get("s", [])
    if len(time) < 2 or time[-1] <= time[0]:
        return None
    step = max(1, round(SPEED_S * 1e4 * (len(time) - 1) / (time[-1] - time[0])))
    pairs = range(len(time) - step)
    speeds = [
        abs(stroke[i + step] - stroke[i]) / (time[i + step] - time[i]) * 10.0
        for i in pairs
        if time[i + step] > time[i]
    ]
    return max(speeds, default=None)


def margins(guards: Mapping[str, Any], recent: Recent, ambient_C: float) -> list[Margin]:
    """Return every guard with its distance to the trip, in the order a person would look at them.

    Parameters
    ----------
    guards : mapping
        :meth:`bufferstand.daq.panel.GuardSet.as_dict`, as it is in a run file as well.
    recent : Recent
        The newest values.
    ambient_C : float
        Temperature of the air [°C], where a thermometer's way to its stop begins.
    """
    return [
        *(_channel(guard, recent) for guard in guards.get("channels", [])),
        *(_speed(guard, recent) for guard in guards.get("speeds") or []),
        *(_temperature(guard, recent, ambient_C) for guard in guards.get("temperatures", [])),
        *(_heating(guard, recent) for guard in guards.get("heating") or []),
        *_silences(guards, recent),
        *_watched(guards),
    ]


def _channel(guard: Mapping[str, Any], recent: Recent) -> Margin:
    span, unit = recent.span(guard["signal"]), guard["unit"]
    if span is None:
        return Margin(guard["name"], guard["label"], "no value", None, guard["action"])
    sides = []
    for value, limit in zip(span, (guard["lower"], guard["upper"]), strict=True):
        if limit:
            sides.append((value / limit, value, limit))
    if not sides:
        return Margin(guard["name"], guard["label"], f"{span[1]:.2f} {unit}", None, guard["action"])
    share, value, limit = max(sides)
    left = abs(limit - value) if share < 1.0 else 0.0
    text = f"{value:.1f} of {limit:g} {unit}, {left:.1f} left"
    return Margin(guard["name"], guard["label"], text, max(0.0, share), guard["action"])


def _speed(guard: Mapping[str, Any], recent: Recent) -> Margin:
    span, unit = recent.span("speed"), guard["unit"]
    if span is None:
        return Margin(guard["name"], "speed", f"trips at {guard['limit']:g} {unit}", None, guard["action"])
    value, limit = span[1], guard["limit"]
    text = f"{value:.0f} of {limit:g} {unit}, {max(0.0, limit - value):.0f} left"
    return Margin(guard["name"], "speed", text, value / limit, guard["action"])


def _temperature(guard: Mapping[str, Any], recent: Recent, ambient_C: float) -> Margin:
    stream, stop_C = guard["stream"], guard["stop_C"]
    label = f"{stream} ({guard['place']})" if guard.get("place") else stream
    kept = recent.readings.get(stream)
    action = guard["action"] if stop_C is not None else guard["silence_action"]
    if not kept:
        return Margin(stream, label, f"no reading yet (grace {guard['grace_s']:g} s)", None, action)
    value_C, silent_s = kept[-1][1], recent.silent_s.get(stream)
    age = "" if silent_s is None else f", {silent_s:.0f} s old"
    if stop_C is None:
        share = None if silent_s is None else silent_s / guard["grace_s"]
        return Margin(stream, label, f"{value_C:.1f} °C{age}", share, action)
    text = f"{value_C:.1f} of {stop_C:g} °C, {max(0.0, stop_C - value_C):.1f} left{age}"
    share = (value_C - ambient_C) / (stop_C - ambient_C) if stop_C > ambient_C else value_C / stop_C
    return Margin(stream, label, text, max(0.0, share), action)


def _heating(guard: Mapping[str, Any], recent: Recent) -> Margin:
    limit, name = guard["limit_K_per_min"], f"heating {guard['stream']}"
    value = recent.heating_K_per_min(guard["stream"])
    if value is None:
        return Margin(name, name, f"trips at {limit:g} K/min", None, guard["action"])
    text = f"{value:+.1f} of {limit:g} K/min"
    return Margin(name, name, text, max(0.0, value / limit), guard["action"])


def _silences(guards: Mapping[str, Any], recent: Recent) -> Iterator[Margin]:
    streams = [(guard["stream"], guard["limit_s"], guard["action"]) for guard in guards.get("silences") or []]
    controller = guards.get("controller") or {}
    if controller.get("silence_s"):
        streams.insert(0, ("controller", controller["silence_s"], "stop"))
    for stream, limit_s, action in streams:
        silent_s = recent.silent_s.get(stream)
        if silent_s is None:
            yield Margin(f"silence {stream}", f"silence of {stream}", "nothing heard yet", None, action)
            continue
        text = f"{silent_s:.1f} s ago, trips after {limit_s:g} s"
        yield Margin(f"silence {stream}", f"silence of {stream}", text, silent_s / limit_s, action)
    if limit_s := guards.get("disk_stop_s"):
        behind_s = recent.waiting_samples / recent.rate_Hz if recent.rate_Hz else 0.0
        text = f"{behind_s:.1f} s behind, trips after {limit_s:g} s"
        yield Margin("disk", "disk", text, behind_s / limit_s, "stop")


def _watched(guards: Mapping[str, Any]) -> Iterator[Margin]:
    """Guards that compare what no single number shows."""
    if agreement := guards.get("agreement"):
        text = f"mean difference of both forces at most {agreement['tolerance_kN']:g} kN"
        yield Margin("agreement", "agreement of both forces", text, None, agreement["action"])
    if wiring := guards.get("wiring"):
        text = (
            f"signals must fit each other and the plan (force within a factor of {wiring['force_factor']:g})"
        )
        yield Margin("wiring", "wiring of every signal", text, None, wiring["action"])
    for guard in guards.get("frozen") or []:
        text = f"must move when the piston moves {guard['travel_mm']:g} mm"
        yield Margin(f"frozen {guard['signal']}", f"frozen {guard['signal']}", text, None, guard["action"])
