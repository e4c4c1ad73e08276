"""Runs commands in this process, as ``bufferstand.cli.main`` does, and tells what came of each."""

from __future__ import annotations

import io
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace

import click

from bufferstand.cli.main import bufferstand
from bufferstand.foundation.errors import BadInput, DeviceFault


@dataclass(frozen=True)
class Outcome:
    """How a command ended: exit status, its message, and the name of the exception that was a bug."""

    status: int
    message: str
    bug: str = ""
    output: str = ""


def attempt(*arguments: object) -> Outcome:
    """Run one command; whatever would have been a traceback is told as a bug."""
    said, told = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(told):
            status = bufferstand.main(
                args=[str(argument) for argument in arguments],
                prog_name="bufferstand",
                standalone_mode=False,
            )
    except BadInput as error:
        ended = Outcome(2, str(error), output=said.getvalue())
    except click.ClickException as error:
        ended = Outcome(2, error.format_message())
    except DeviceFault as error:
        ended = Outcome(4, str(error))
    except Exception as error:  # noqa: BLE001 - what main calls a bug
        return Outcome(4, str(error), type(error).__name__)
    else:
        ended = Outcome(status if isinstance(status, int) else 0, told.getvalue(), output=said.getvalue())
    printed = said.getvalue() + told.getvalue()
    return replace(ended, bug="printed a traceback", message=printed) if "Traceback" in printed else ended


def bugs(outcomes: Sequence[tuple[str, Outcome]]) -> list[str]:
    """Return one line for each attempt that ended in a bug."""
    return [f"{name}: {one.bug}: {one.message[:200]}" for name, one in outcomes if one.bug]
