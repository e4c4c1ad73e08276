"""A doubt: which signal does not measure what it should, how that looks, and which setting to look at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from bufferstand.daq.guards.trips import Action, Trip

Kind = Literal[
    "sign", "scale", "zero", "delay", "still", "slipped", "disagrees", "no heat", "fallen off", "swapped",
    "follows the specimen", "cold",
]  # fmt: skip
"""What is wrong with a signal, as data."""


@dataclass(frozen=True)
class SignalDoubt:
    """A signal that cannot be true beside the others.

    Parameters
    ----------
    kind : str
        What is wrong with it.
    sensor : str
        Its channel; several are joined by commas where the others do not tell which.
    stream : str
        The stream that it comes in.
    setting : str
        Where to look in the stand file.
    text : str
        One sentence: what was seen, with figures and units.
    value, limit : float or None
        What was seen and what may be, in ``unit``.
    unit : str
    asks : bool
        Whether it may well be right: a person is asked, and nothing stops.
    """

    kind: Kind
    sensor: str
    stream: str
    setting: str
    text: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    asks: bool = False


def doubt_trip(doubt: SignalDoubt, action: Action, at_s: float, time_us: int | None = None) -> Trip:
    """Return the trip of a doubt: a device's fault, whatever it is that is wired or stated wrongly.

    A question is a note that spoils no figure, under a name of its own.

    Parameters
    ----------
    doubt : Doubt
    action : Action
        What it leads to.
    at_s : float
        Host stand time [s].
    time_us : int, optional
        Time stamp of the newest sample that was looked at [µs].
    """
    where = f"look at its wiring and at {doubt.setting} in the stand file (stream {doubt.stream})"
    return Trip(
        f"{'question about' if doubt.asks else 'wiring of'} {doubt.sensor}",
        Action.NOTE if doubt.asks else action,
        f"{doubt.text}: {where}",
        at_s,
        value=doubt.value,
        limit=doubt.limit,
        unit=doubt.unit,
        stream=doubt.stream,
        time_us=time_us,
        device_fault=not doubt.asks,
        sensor=doubt.sensor,
        setting=doubt.setting,
        doubt="" if doubt.asks else doubt.kind,
    )


def channel_setting(name: str, key: str) -> str:
    """Return where the setting of a channel, or of several joined by commas, stands in the stand file.

    Each is an entry of its own there, e.g. ``[[controller.channel]] name = “stroke_1”, calibration``.
    """
    entries = []
    for one in name.split(", "):
        channel = "[amplifier.channel]" if one == "force_2" else f"[[controller.channel]] name = “{one}”,"
        entries.append(f"{channel} {key}")
    return " and ".join(entries)


def stream_of(name: str) -> str:
    """Return the stream of a channel of force, stroke or position."""
    return "amplifier" if name == "force_2" else "controller"
