"""What the first files are made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date
from math import isfinite

from bufferstand.foundation import BadInput

CONTROLLERS = {
    "ring": "samples into a ring of its own, all channels of one instant (recommended)",
    "polling": "shows momentary values only, and is polled",
    "rmc": "Delta RMC75 or RMC150, with its own registers and the watchdog program",
    "none": "of another maker, which moves the stand by itself: it is recorded only",
}
"""Kind of controller → what it is: a shipped register profile, another kind, or none of ours."""
NONE = "none"
CAMPAIGNS = {
    "en15551": "static characteristic, three cycles, EN 15551",
    "sweeps": "the paper's sweeps of amplitude and speed at 20 and 50 mm prestress",
    "warm-up": "static characteristic cold and warm, with the warming between recorded",
}
"""First campaign → what it does."""
CHANNELS = ("force", "stroke_1", "stroke_2", "stroke_3", "stroke_4", "position", "force_2")
"""Channels of the first stand whose certificate can be named."""
UNITS = {name: "kN" if name.startswith("force") else "mm" for name in CHANNELS}
"""Unit of each channel."""
MOST_WIRES = 4
FURTHER = {"pressure": "in the cylinder", "acceleration": "of the piston"}
"""Further channels that a controller can sample → where."""
MOST_THERMOMETERS = 6
MOST_FORCE_KN = 630.0
"""Nominal force of the stand that the first files are of [kN]."""


@dataclass(frozen=True)
class Certificate:
    """The calibration certificate of a channel."""

    number: str
    valid_until: date | None = None


@dataclass(frozen=True)
class Answers:
    """What was asked, or given by options.

    Parameters
    ----------
    laboratory, stand : str
        Name of the laboratory, id of the stand.
    controller : str
        One of :data:`CONTROLLERS`.
    host : str
        Its address; a loopback address is that of the stand's simulated twin.
    port : int
    force_max_kN, stroke_max_mm : float
        Limits of the stand.
    second_force : bool
        A second amplifier on the load cell, on a serial line.
    draw_wires : int
        From 1 to :data:`MOST_WIRES`, beside the specimen.
    further : tuple of str
        Of :data:`FURTHER`.
    thermometers : int
        On the specimen; one more is in the air beside the stand.
    certificates : mapping
        Channel → certificate.
    coefficients : mapping
        Channel → zero [its unit] and slope [its unit per count, or per V of a recorder's input].
    specimen : str
        Its id.
    kind, category, elastic_system : str
        As in a specimen file; an empty category is none.
    max_stroke_mm : float
    model : bool
        The shipped elastomer spring stands for the specimen's until its own is identified.
    campaign : str
        One of :data:`CAMPAIGNS`.
    operator : str
    """

    laboratory: str = "laboratory"
    stand: str = "stand-1"
    controller: str = "ring"
    host: str = "127.0.0.1"
    port: int = 15020
    force_max_kN: float = 600.0
    stroke_max_mm: float = 250.0
    second_force: bool = True
    draw_wires: int = 2
    further: tuple[str, ...] = ()
    thermometers: int = 2
    certificates: dict[str, Certificate] = field(default_factory=dict)
    coefficients: dict[str, tuple[float, float]] = field(default_factory=dict)
    specimen: str = "A-0001"
    kind: str = "buffer"
    category: str = "A"
    elastic_system: str = "elastomer"
    max_stroke_mm: float = 105.0
    model: bool = True
    campaign: str = "en15551"
    operator: str = ""


def is_twin(host: str) -> bool:
    """Return whether an address is that of a simulated twin on this computer."""
    return host in {"127.0.0.1", "::1", "localhost"}


def is_like_shipped(kind: str, elastic_system: str, max_stroke_mm: float) -> bool:
    """Return whether a specimen is of the kind that the shipped spring model is of: no other may be planned
    with it."""
    return (kind, elastic_system, max_stroke_mm) == ("buffer", "elastomer", 105.0)


def parse_certificate(text: str) -> tuple[str, Certificate]:
    """Return channel and certificate of ``CHANNEL=NUMBER`` or ``CHANNEL=NUMBER@YYYY-MM-DD``.

    Raises
    ------
    BadInput
        If it has another form, names no channel, or the day is none.
    """
    option, form = "--certificate", "CHANNEL=NUMBER@YYYY-MM-DD"
    channel, separator, rest = text.partition("=")
    channel = channel.strip()
    number, at, day = rest.rpartition("@")
    if not at:
        number, day = rest, ""
    if not separator or not number.strip():
        raise BadInput(f"“{text}” has not the form {form}", file=option, remedy=f"write {option} {form}")
    _demand_channel(channel, option)
    try:
        return channel, Certificate(number.strip(), date.fromisoformat(day) if day else None)
    except ValueError:
        raise BadInput(f"“{day}” is no day", file=option, remedy="write it as 2027-01-31") from None


def parse_coefficients(text: str) -> tuple[str, tuple[float, float]]:
    """Return channel, zero and slope of ``CHANNEL=ZERO,SLOPE``: value = zero + slope × reading.

    Raises
    ------
    BadInput
        If it has another form, names no channel, or a slope by which nothing can be measured.
    """
    option, form = "--coefficients", "CHANNEL=ZERO,SLOPE"
    channel, _, rest = text.partition("=")
    channel = channel.strip()
    parts = rest.replace(";", ",").split(",")
    try:
        zero, slope = map(float, parts)
    except ValueError:
        raise BadInput(
            f"“{text}” has not the form {form}",
            file=option,
            remedy=f"write e.g. {option} force=0,9.54e-05: kN, and kN per count, with decimal points",
        ) from None
    _demand_channel(channel, option)
    if not (isfinite(zero) and isfinite(slope)) or slope == 0.0:
        raise BadInput(
            f"{zero:g} and {slope:g} make no measure of a reading",
            file=option,
            remedy=f"give zero [{UNITS[channel]}] and slope [{UNITS[channel]} per count] of the certificate",
        )
    return channel, (zero, slope)


def _demand_channel(channel: str, option: str) -> None:
    if channel not in CHANNELS:
        raise BadInput(
            f"there is no channel “{channel}”", file=option, remedy=f"name one of {', '.join(CHANNELS)}"
        )
