"""Common parts of the commands of ``bufferstand stand``: the stand, its zero, consent, and how they end."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from bufferstand.cli.arming import Consent, Movement, ask_to_move
from bufferstand.cli.campaign import stand_text
from bufferstand.cli.closed_terminal import nobody_reads, say
from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.motions import Halt
from bufferstand.daq.operator import StopRequest, stop_on_signals
from bufferstand.daq.stand import RELEASE_SPEED_MM_PER_S, ManualLimits, ManualStand, by_hand
from bufferstand.daq.zero import stored_path, stored_zero
from bufferstand.drivers import RecordingDevices, Stand, build_controller, build_recording, build_sensors
from bufferstand.drivers.stand_file import (
    RecordingStand,
    StandFile,
    has_controller,
    load_recording_stand,
    load_stand,
)
from bufferstand.foundation import Clock, ExitStatus, WallClock
from bufferstand.foundation.channels import Zero


@contextmanager
def opened(path: Path, doing: str = "") -> Iterator[tuple[StandFile, Stand, Clock]]:
    """Give a stand whose wires are not connected yet, for what is to be done; let go of them at the end."""
    stand_file, clock = load_stand(path), WallClock()
    stand = Stand(build_controller(stand_file, clock, doing), build_sensors(stand_file, clock))
    try:
        yield stand_file, stand, clock
    finally:
        stand.close()


@contextmanager
def opened_to_read(
    path: Path,
) -> Iterator[tuple[StandFile | RecordingStand, Stand | RecordingDevices, Clock]]:
    """Give what a stand file lists, with a controller or without, as :func:`opened` does."""
    if has_controller(path):
        with opened(path) as found:
            yield found
        return
    recorded, clock = load_recording_stand(path), WallClock()
    devices = build_recording(recorded, clock)
    try:
        yield recorded, devices, clock
    finally:
        devices.close()


def zero_of(path: Path) -> Zero | None:
    """Return the stored zero of a stand, and say how old it is."""
    zero = stored_zero(path)
    if zero is not None:
        say(f"zero of {zero.found:%Y-%m-%d %H:%M} UTC ({zero.how}) from {stored_path(path)}")
    return zero


def consent(
    stand_file: StandFile, limits: ManualLimits, motion: tuple[tuple[str, str], ...], given: str | None
) -> Consent:
    """Show what will move (rows of heading and text), and ask for the stand's id."""
    rows = (
        ("stand", stand_text(stand_file)),
        *motion,
        ("limits", f"{limits.force_kN:g} kN, {limits.stroke_mm:g} mm of the piston"),
        ("at the end", f"unloaded at {RELEASE_SPEED_MM_PER_S:g} mm/s, valve off"),
    )
    return ask_to_move(Movement("stand", stand_file.stand.id, rows), given)


@contextmanager
def moving(stand: Stand, stand_file: StandFile, clock: Clock, limits: ManualLimits) -> Iterator[ManualStand]:
    """Give a stand that moves by hand: connected, looked at, switched on; safely stopped at the end.

    Raises
    ------
    Halt, DeviceFault
        As :func:`bufferstand.daq.stand.manual.by_hand`; a terminal that is gone is the operator's stop.
    """
    try:
        with (
            stop_on_signals(StopRequest()) as request,
            by_hand(stand, stand_file, clock, limits, request, say) as hand,
        ):
            yield hand
    except OSError as lost:
        if not nobody_reads(lost):
            raise
        reason = "stopped: the terminal is gone, or nobody reads what is printed"
        raise Halt(Trip("operator", Action.STOP, reason, clock.now_s(), device_fault=False)) from lost


def ended(halt: Halt) -> ExitStatus:
    """Say why it was stopped; return the exit status."""
    say(f"bufferstand: {halt.trip.reason}")
    return ExitStatus.DEVICE_FAULT if halt.trip.device_fault else ExitStatus.STOPPED


def show_there(text: str) -> None:
    """Show a line in place of the one before, where standard error is a terminal."""
    if sys.stderr.isatty():
        with suppress(OSError):
            click.echo(f"\r{text}\x1b[K", nl=False, err=True)
