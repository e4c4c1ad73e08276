"""``bufferstand stand tare``: what is read at rest is zero."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.arming import user_name
from bufferstand.cli.options import EXISTING
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from bufferstand.daq.stand import StandReader
    from bufferstand.drivers import ControllerStatus
    from bufferstand.foundation.channels import Channel, ChannelZero, Zero

CHANNELS = ("force", "force_2", "stroke_1", "stroke_2", "stroke_3", "stroke_4")
REST_S = 2.0
MOST_NOISE = {"kN": 1.0, "mm": 0.1}
"""A channel that scatters more than this (standard deviation) is not at rest."""
FORCE_MAX_KN, WIRE_MAX_MM, APART_MAX_MM = 5.0, 10.0, 5.0
"""A tare that is larger is refused: it would hide a fault."""


@click.command("tare", epilog="Example:  bufferstand stand tare stand.toml --channel force --channel force_2")
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@click.option(
    "--channel",
    "channels",
    type=click.Choice(CHANNELS),
    multiple=True,
    help="Only these; all that the stand has if none is given.",
)
@click.option("--specimen", metavar="ID", default="", help="The specimen that is in the stand.")
@click.option("--operator", metavar="NAME", default="", help="Who does it; the login name if not given.")
def command(stand: Path, channels: tuple[str, ...], specimen: str, operator: str) -> int:
    """Take what the channels read now for their zero; nothing moves.

    The specimen must be unloaded and the valve off. Written to STAND.zero.toml beside the stand file, with
    the date; it replaces what was stored there. Campaigns with “touch = false” in [zero] take it over for a
    day. A tare of more than 5 kN or 10 mm is refused (exit status 3).
    """
    from bufferstand.cli.closed_terminal import say
    from bufferstand.cli.stand_by_hand import opened
    from bufferstand.daq.stand import StandReader
    from bufferstand.daq.zero import store_zero
    from bufferstand.foundation import ExitStatus

    with opened(stand, "stand tare") as (stand_file, devices, clock):
        devices.controller.connect()
        _demand_off(devices.controller.status(), stand)
        for sensor in devices.sensors:
            sensor.start()
        found = _at_rest(StandReader(devices, clock), channels or CHANNELS)
    if missing := [name for name in channels if name not in {one.name for one in found}]:
        raise BadInput(
            f"the stand has delivered nothing of {', '.join(missing)}",
            file=stand,
            remedy="see what “bufferstand check” says of it",
        )
    zero = _zero_of(found, specimen, operator or user_name())
    if why := _refusal(zero, stand_file.stand.tilt_max_mm or APART_MAX_MM):
        say(f"bufferstand: {why}; nothing was written")
        return ExitStatus.STOPPED
    path = store_zero(stand, zero)
    click.echo(f"{zero.sentence()}\nwritten to {path}")
    return ExitStatus.DONE


def _demand_off(status: ControllerStatus, stand: Path) -> None:
    """Refuse a tare while the actuator is on, or the controller shows a fault."""
    from bufferstand.daq.guards.kinds import fault_text
    from bufferstand.daq.motions import VALVE_OFF
    from bufferstand.drivers import MotionState
    from bufferstand.foundation import DeviceFault

    if status.fault_code or status.state is MotionState.FAULT:
        raise DeviceFault(
            f"the controller shows {fault_text(status.fault_code)} from before: look why, then reset it; the "
            f"next command that moves the stand (“bufferstand stand zero {stand}”) does, after asking"
        )
    if status.state not in VALVE_OFF:
        raise BadInput(
            "the actuator is switched on: a tare is taken with the valve off",
            file=stand,
            remedy="end the program that moves it, or switch it off",
        )


def _at_rest(reader: StandReader, names: tuple[str, ...]) -> list[ChannelZero]:
    """Return the zeros of channels by what they read now."""
    import numpy as np

    from bufferstand.daq.zero import rest_zero

    found: list[ChannelZero] = []
    for stream in reader.collect(REST_S).values():
        for channel in stream.facts.channels:
            parts = stream.counts.get(channel.name)
            if channel.name in names and parts:
                values = channel.calibration.apply(np.concatenate(parts))
                _demand_rest(channel, float(np.std(values)))
                found.append(rest_zero(channel, values))
    return found


def _demand_rest(channel: Channel, noise: float) -> None:
    most = MOST_NOISE[channel.unit]
    if noise > most:
        raise BadInput(
            f"{channel.name} scatters by {noise:.3g} {channel.unit} (standard deviation, at most {most:g}): "
            "it is not at rest",
            remedy="wait until nothing moves, or mend its cable",
        )


def _zero_of(found: list[ChannelZero], specimen: str, operator: str) -> Zero:
    from datetime import UTC, datetime

    from bufferstand.foundation.channels import Zero

    now = datetime.now(UTC)
    return Zero(how="tare", found=now, specimen=specimen, operator=operator, channel=tuple(found))


def _refusal(zero: Zero, apart_mm: float) -> str:
    from bufferstand.daq.zero import BY_HAND, ZeroLimits, zero_refusal
    from bufferstand.protocols.campaign_file import ZeroTable

    table = ZeroTable(stroke_max_mm=WIRE_MAX_MM)
    return zero_refusal(zero, table, ZeroLimits(FORCE_MAX_KN, apart_mm, 1.0, BY_HAND))
