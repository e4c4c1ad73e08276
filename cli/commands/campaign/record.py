"""``bufferstand record``: record a stand that another controller moves."""

from __future__ import annotations

import re
import sys
from datetime import UTC, datetime
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, get_args

import click

from bufferstand.cli.options import EXISTING, FILE, out_option, warn
from bufferstand.foundation import (
    BadInput,
    DeviceFault,
    ExitStatus,
    Kind,
    WallClock,
    counted,
    duration_text,
    program,
)

if TYPE_CHECKING:
    from bufferstand.daq.record_only import RecordingOutcome, RecordingProgress
    from bufferstand.drivers import RecordingDevices
    from bufferstand.drivers.stand_file import RecordingStand

_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
_LONGEST_S = 7 * 24 * 3600.0


class Duration(click.ParamType[float]):
    """A time with its unit: ``90s``, ``10min``, ``2h``."""

    name = "duration"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return it in seconds."""
        if isinstance(value, float):
            return value
        found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(s|min|h)", str(value).strip())
        seconds = float(found[1]) * _UNITS_S[found[2]] if found else 0.0
        if not 0.0 < seconds <= _LONGEST_S:
            self.fail(f"“{value}” is no time of up to a week; write 90s, 10min or 2h", param, ctx)
        return seconds


@click.command(
    "record", epilog="Example:  bufferstand record stand.toml --out runs --specimen buffer.toml --for 10min"
)
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@out_option("Folder for the run file.")
@click.option("--specimen", metavar="FILE.toml", type=FILE, help="Facts of specimen and test.")
@click.option("--kind", type=click.Choice(get_args(Kind)), help="Kind of the test.  [default: harmonic]")
@click.option(
    "--for", "for_s", metavar="TIME", type=Duration(), help="How long: 90s, 10min, 2h; else until Ctrl-C."
)
@click.option("--name", metavar="NAME", help="Name of the run; else the time of its start.")
@click.option("--operator", metavar="NAME", default="", help="Who records.")
@click.option(
    "--seal", is_flag=True, help="Only seal what a recording that was killed has left in the folder."
)
def command(
    *,
    stand: Path,
    out: Path,
    specimen: Path | None,
    kind: Kind | None,
    for_s: float | None,
    name: str | None,
    operator: str,
    seal: bool,
) -> int:
    """Record a stand that another controller moves; nothing is moved here.

    The stand file has no [controller]; its devices are [[acquisition]], [[amplifier]], [[temperature]] and
    [[sensor]]. Limits are warned of. Ctrl-C ends it, or --for, or bufferstand stop DIR.
    """
    from bufferstand.drivers.stand_file import load_recording_stand
    from bufferstand.foundation.files import make_folder
    from bufferstand.recording.sealing import seal_orphans

    stand_file = load_recording_stand(stand)
    try:
        make_folder(out)
        for sealed in seal_orphans(out):
            click.echo(f"sealed what was left of {sealed.stem} -> {sealed}", err=True)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror or error}", file=out) from None
    if seal:
        return ExitStatus.DONE
    outcome = _record(stand_file, out, specimen, kind, name, operator, for_s)
    _show_outcome(outcome)
    where = quote(str(out))
    click.echo(f"Next:\n  {program()} evaluate {where}\n  {program()} report {where} --out report", err=True)
    if outcome.status == "failed":
        return ExitStatus.DEVICE_FAULT
    return ExitStatus.STOPPED if outcome.status == "stopped" else ExitStatus.DONE


def _record(
    stand: RecordingStand,
    out: Path,
    specimen: Path | None,
    kind: Kind | None,
    name: str | None,
    operator: str,
    for_s: float | None,
) -> RecordingOutcome:
    from bufferstand.daq.operator import StopRequest, listening, stop_on_signals
    from bufferstand.daq.record_only import RecordingFacts, RecordingWatch, record_devices, recording_document
    from bufferstand.drivers import build_recording
    from bufferstand.foundation.specimen import load_specimen
    from bufferstand.recording import RecordingFault, RunRecorder

    about = None if specimen is None else load_specimen(specimen)
    of_test = None if about is None else about.test.kind
    facts = RecordingFacts(_run_id(name), kind or of_test or "harmonic", operator, about)
    clock, request = WallClock(), StopRequest()
    devices = build_recording(stand, clock)
    with stop_on_signals(request), listening(out, request):
        devices.start()
        try:
            watch = RecordingWatch(stand, devices, clock)
            document = recording_document(stand, devices, watch.guards, facts)
            recorder = RunRecorder(out, facts.run_id, document)
            _show_start(devices, recorder.path, for_s)
            return record_devices(
                devices,
                recorder,
                watch,
                clock,
                request,
                for_s=for_s,
                asks_for_stop=stand.limits.ask_for_stop,
                tell=warn,
                show=_show_progress,
            )
        except RecordingFault as fault:
            raise DeviceFault(str(fault)) from None
        finally:
            devices.close()


def _run_id(name: str | None) -> str:
    if name is None:
        return f"record-{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
        raise BadInput(
            f"“{name}” is no name of a file",
            file="--name",
            remedy="write letters, digits, - and _, e.g. buffer-7",
        )
    return name


def _show_start(devices: RecordingDevices, journal: Path, for_s: float | None) -> None:
    for one in devices.all:
        identity = getattr(one, "identity", "") or one.facts.device
        channels = ", ".join(channel.name for channel in one.facts.channels)
        click.echo(f"{one.facts.name}: {identity}: {channels}", err=True)
    end = "Ctrl-C ends it" if for_s is None else f"for {duration_text(for_s)}"
    click.echo(f"recording into {journal}, {end}", err=True)


def _show_progress(progress: RecordingProgress) -> None:
    if not sys.stderr.isatty():
        return
    shown = [f"{name} {progress.values[name]:.2f}" for name in ("force", "stroke") if name in progress.values]
    lost = sum(progress.lost.values())
    text = f"{duration_text(progress.lasted_s)}: {', '.join(shown)}" + (f", {lost} lost" if lost else "")
    click.echo(f"\r{text}\x1b[K", err=True, nl=False)


def _show_outcome(outcome: RecordingOutcome) -> None:
    progress = outcome.progress
    if sys.stderr.isatty():
        click.echo(err=True)
    for name, samples in progress.samples.items():
        lost = progress.lost.get(name, 0)
        text = f"{name}: {samples} samples, {lost or 'none'} lost"
        if (silent_s := progress.silent_s.get(name)) is not None:
            text += f"; nothing in the last {duration_text(silent_s)}"
        click.echo(text, err=True)
    if progress.warnings:
        click.echo(f"warned {counted(progress.warnings, 'time')}; the run's events say of what", err=True)
    why = f" ({outcome.reason})" if outcome.reason else ""
    click.echo(f"{outcome.status}{why}: {duration_text(progress.lasted_s)} -> {outcome.path}")
