"""The command ``bufferstand``: finds the sub-command; what went wrong becomes one line and a status."""

from __future__ import annotations

import errno
import sys

try:
    import os
    import signal
    import threading
    from collections.abc import Iterator
    from contextlib import contextmanager
    from types import FrameType
    from typing import NoReturn

    import click

    from bufferstand.cli.closed_terminal import drop, is_closed_terminal, plain_terminals, shows_on_terminal
    from bufferstand.cli.lazy import LazyGroup, module_name
    from bufferstand.foundation import BadInput, DeviceFault, ExitStatus
    from bufferstand.foundation.operating_system import ENDING_SIGNALS
except KeyboardInterrupt:  # while that is loaded; the status is ExitStatus.STOPPED
    sys.stderr.write("bufferstand: stopped by the operator: nothing was begun\n")
    raise SystemExit(3) from None

# Name → what it does. The modules are imported only when used, so that --help answers at once.
COMMANDS = {
    "demo": "The paper's campaign, shortened, on the simulated stand: runs, evaluation, report.",
    "samples": "Copy the shipped samples: campaigns, stand, specimens, models, recorded runs.",
    "docs": "Find words in the documentation, or read it in the browser.",
    "init": "Make a first stand, specimen and campaign by questions.",
    "desk": "Prepare, check, start, watch and judge campaigns in the browser.",
    "plan": "Dry run of a campaign: every step with its figures; refuses what breaks a limit.",
    "run": "Run a campaign; record one HDF5 file a run.",
    "record": "Record a stand that another controller moves (record-only mode).",
    "resume": "Go on where a stopped, crashed or too hot campaign ended.",
    "monitor": "Show a running or finished campaign in the browser.",
    "stop": "Stop a running campaign: now, after the cycle, or after the step.",
    "note": "Add an operator's note to a campaign, before, during or after it.",
    "check": "Read every device of a stand once; say what is stale or out of range.",
    "instruments": "List what can be connected: kinds of device, register maps, their sources.",
    "stand": "The stand by hand: readings, tare, zero, slow motions.",
    "calibration": "Take a channel's calibration from a digital certificate (DCC).",
    "simulate-stand": "Serve the simulated stand (Modbus TCP, serial, 1-Wire) for others to talk to.",
    "fault": "Let a device of a simulated stand that is being served fail, or mend it.",
    "import": "Turn foreign records (CSV) into run files.",
    "evaluate": "Evaluate runs, campaigns or archives: energies, damping, stiffness, EN 15551.",
    "compare": "Compare two evaluations: what moved, by how much, and beyond its uncertainty.",
    "skew": "Measure the skew of force and stroke on an elastic reference; what 1 ms changes.",
    "report": "Write the test report (HTML and PDF).",
    "publish": "Make an RO-Crate of a campaign: data, evaluation and report for others.",
    "model": "Identify the spring's computational model, simulate, compare, hand it on.",
    "runs": "List recorded runs with their key facts, or find those that match.",
    "verify": "Check that run files and reports are whole and unaltered.",
    "schema": "Print the JSON Schema of a settings file or of the evaluation document.",
    "validate": "Evaluate standard data sets with agreed values; write the record of it.",
}

SECTIONS = {
    "Start here": ("demo", "samples", "init", "desk", "docs"),
    "Test": (
        "plan",
        "check",
        "instruments",
        "calibration",
        "stand",
        "run",
        "resume",
        "record",
        "monitor",
        "stop",
        "note",
    ),
    "Know what was measured": (
        "runs",
        "verify",
        "import",
        "evaluate",
        "compare",
        "skew",
        "report",
        "publish",
    ),
    "Know that the figures are right": ("validate",),
    "Hand the spring on": ("model",),
    "Without a stand": ("simulate-stand", "fault"),
    "For editors and programs": ("schema",),
}
"""The commands in the order of the work; those that are named nowhere come last."""

OF_STAND = (
    "demo",
    "desk",
    "check",
    "stand",
    "run",
    "resume",
    "record",
    "monitor",
    "stop",
    "note",
    "simulate-stand",
    "fault",
)
"""What works a stand, a real or a simulated one: it needs Linux."""

_GROUPS = {
    "campaign": ("demo", "desk", "plan", "run", "resume", "record", "monitor", "stop", "note"),
    "stand": ("check", "instruments", "simulate-stand", "fault"),
    "recordings": (
        "import",
        "evaluate",
        "compare",
        "skew",
        "report",
        "publish",
        "runs",
        "verify",
        "validate",
    ),
}
"""The folder of :mod:`bufferstand.cli.commands` in which a command's module lies."""
MODULES = {
    **{name: f"{group}.{module_name(name)}" for group, names in _GROUPS.items() for name in names},
    "stand": "stand.group",
    "calibration": "calibration.group",
    "model": "model.group",
    "samples": "samples",
    "docs": "docs",
    "init": "init",
    "schema": "schema",
}
"""The module of each command, below :mod:`bufferstand.cli.commands`."""

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""What standard output fails with where it is a file; all other files say so themselves, by name."""
BUG_STATUS = 70
"""Exit status of a fault of this software (EX_SOFTWARE), which is none of those in docs/commands.md."""


@click.group(
    cls=LazyGroup,
    modules={name: f"bufferstand.cli.commands.{module}" for name, module in MODULES.items()},
    summaries=COMMANDS,
    sections=SECTIONS,
    of_stand=OF_STAND,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Start with:  bufferstand demo\n\nEach command has an example:  bufferstand evaluate --help",
    invoke_without_command=True,
)
@click.version_option(package_name="bufferstand", prog_name="bufferstand")
@click.pass_context
def bufferstand(context: click.Context) -> None:
    """Test-stand data acquisition and evaluation for railway buffers and draw gear."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command and end the process with its exit status (docs/commands.md).

    Parameters
    ----------
    arguments : list of str, optional
        Command line without the program's name; the process's own if not given.
    """
    # Before numpy is there: with more threads its sums differ in the last bit, and these are small. Whatever
    # the user has set: results are kept, and compared with those of others.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    on_terminal = shows_on_terminal()
    try:
        with _ended_by_signals(), plain_terminals():
            outcome = bufferstand.main(args=arguments, prog_name="bufferstand", standalone_mode=False)
            status = int(outcome) if isinstance(outcome, int) else ExitStatus.DONE
            _flush(status)
    except BadInput as error:
        status = _say(str(error), ExitStatus.BAD_INPUT)
    except click.UsageError as error:
        hint = f" ({error.ctx.command_path} --help)" if error.ctx and error.ctx.parent else " (--help)"
        status = _say(error.format_message().rstrip(".") + hint, ExitStatus.BAD_INPUT)
    except click.ClickException as error:
        status = _say(error.format_message(), ExitStatus.BAD_INPUT)
    except (click.Abort, KeyboardInterrupt) as interrupt:
        told = str(interrupt) or str(interrupt.__cause__ or "")  # click makes an Abort of an interrupt
        told = f": {told}" if told else ""
        status = _say(f"stopped by the operator{told}", ExitStatus.STOPPED)
    except (BrokenPipeError, SystemExit):  # a reader that has gone; click makes the latter of it, status 1
        drop(sys.stdout)
        status = ExitStatus.DONE
    except DeviceFault as error:
        status = _say(str(error), ExitStatus.DEVICE_FAULT)
    except Exception as error:  # noqa: BLE001 - a bug must not pass for a failed specimen (status 1)
        if isinstance(error, OSError) and error.filename is None and error.errno in _NO_ROOM:
            drop(sys.stdout)
            if is_closed_terminal(error, on_terminal=on_terminal):
                raise SystemExit(_say("stopped by the operator", ExitStatus.STOPPED)) from None
            message = f"standard output: cannot be written: {error.strerror}; make room, or name a file"
            raise SystemExit(_say(message, ExitStatus.BAD_INPUT)) from None
        sys.excepthook(type(error), error, error.__traceback__)
        _say("the lines above are a bug of bufferstand; please report them", ExitStatus.DEVICE_FAULT)
        raise SystemExit(BUG_STATUS) from None
    raise SystemExit(int(status))


def _flush(status: int) -> None:
    """Write what is still to be written; a status that says more than that this failed is kept."""
    if sys.stdout is None:  # closed by whoever started this
        return
    try:
        sys.stdout.flush()
    except OSError:
        if not status:
            raise
        drop(sys.stdout)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """While inside, SIGTERM and SIGHUP do what Ctrl-C does, unless they are ignored (nohup).

    A command that has a stand to stop puts its own handlers in their place (daq.operator.stop_request).
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [
        number
        for number in ENDING_SIGNALS
        if number is not signal.SIGINT and signal.getsignal(number) is signal.SIG_DFL
    ]
    for number in numbers:
        signal.signal(number, _interrupt)
    try:
        yield
    finally:
        for number in numbers:
            signal.signal(number, signal.SIG_DFL)


def _interrupt(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - Python's signature
    raise KeyboardInterrupt


def _say(message: str, status: ExitStatus) -> ExitStatus:
    """Say why it ended; a terminal that is gone changes nothing of the status."""
    try:
        click.echo(f"bufferstand: {message}", err=True)
    except OSError:
        drop(sys.stderr)
    return status
