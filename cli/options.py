"""Options that several commands share."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Any, Literal, TextIO, TypeVar, cast

import click

from bufferstand.foundation import DELAYS_TO_SPEED, BadInput, plain
from bufferstand.foundation.files import check_outputs, replaced_whole

Function = TypeVar("Function", bound=Callable[..., Any])
JUDGED_TO_SPEED = f"delays of signals are judged only at a speed of at most {DELAYS_TO_SPEED:g}"
"""What the help says wherever a stand may run faster than the wall."""


class _Named(click.Path):
    """A path that is not empty: an empty one would mean the present folder."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        if value == "":
            self.fail("it is empty; give a name", param, ctx)
        return super().convert(value, param, ctx)


class FiniteFloat(click.types.FloatParamType):
    """A number, neither nan nor infinite."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number that a text says."""
        return _finite(self, float(super().convert(value, param, ctx)), param, ctx)


class FiniteRange(click.FloatRange):
    """A number within bounds; nan, which no comparison finds outside, is not."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number that a text says."""
        return _finite(self, float(super().convert(value, param, ctx)), param, ctx)


def _finite(
    kind: FiniteFloat | FiniteRange, number: float, param: click.Parameter | None, ctx: click.Context | None
) -> float:
    if not math.isfinite(number):
        kind.fail(f"{number} is no finite number", param, ctx)
    return number


SPRING_C = FiniteRange(min=-100.0, max=200.0)
"""Temperatures that a spring of rubber, elastomer or steel, and the air around it, may have [°C]."""
EXISTING = _Named(exists=True, path_type=Path)
FOLDER = _Named(file_okay=False, path_type=Path)
FILE = _Named(dir_okay=False, path_type=Path)


def out_option(help_text: str, *, required: bool = True) -> Callable[[Function], Function]:
    """Return the option ``--out DIR``."""
    return click.option("--out", metavar="DIR", type=FOLDER, required=required, help=help_text)


def monitor_address(context: click.Context, parameter: click.Parameter, value: str | None) -> Any:  # noqa: ARG001
    """Return where a page is served (:class:`bufferstand.daq.monitor.process.Address`), None where none is
    wanted.

    Raises
    ------
    BadInput
        If it is no HOST:PORT.
    """
    if value is None:
        return None
    from bufferstand.daq.monitor import parse_address  # noqa: PLC0415 - only where a page is wanted

    return parse_address(value)


def encryption_options(address: str) -> Callable[[Function], Function]:
    """Return the options ``--certificate``, ``--key`` and ``--unencrypted`` of a page.

    Parameters
    ----------
    address : str
        Parameter of the command that has the page's address; what they say is put into that.
    """

    def add(function: Function) -> Function:
        @wraps(function)
        def command(*words: Any, **named: Any) -> Any:
            chain, key, unencrypted = (named.pop(name) for name in ("certificate", "key", "unencrypted"))
            if named[address] is not None:
                from bufferstand.daq.monitor import certificate_of  # noqa: PLC0415 - only where a page is wanted

                page = replace(
                    named[address], certificate=certificate_of(chain, key), unencrypted=unencrypted
                )
                page.demand_encryption()
                named[address] = page
            elif chain or key or unencrypted:
                raise click.UsageError("--certificate, --key and --unencrypted are of a page: add --monitor")
            return function(*words, **named)

        for option in (
            click.option(
                "--unencrypted",
                is_flag=True,
                help="Serve the page unencrypted at another address than this computer's own.",
            ),
            click.option(
                "--key",
                metavar="FILE.pem",
                type=FILE,
                help="The certificate's private key, without password.",
            ),
            click.option(
                "--certificate",
                metavar="FILE.pem",
                type=FILE,
                help="Serve the page encrypted (https), by this certificate.",
            ),
        ):
            command = option(command)
        return cast("Function", command)

    return add


def monitor_option(function: Function) -> Function:
    """Add the option ``--monitor [HOST:PORT]``, and those of how the page is encrypted."""
    return click.option(
        "--monitor",
        metavar="[HOST:PORT]",
        is_flag=False,
        flag_value="",
        default=None,
        callback=monitor_address,
        help="Live page in the browser (default 127.0.0.1:8420); write it behind the file's name.",
    )(encryption_options("monitor")(function))


def ambient_option(help_text: str) -> Callable[[Function], Function]:
    """Return the option ``--ambient C``."""
    return click.option("--ambient", "ambient_C", metavar="C", type=SPRING_C, help=help_text)


def in_a_row_option(function: Function) -> Function:
    """Add the option ``--in-a-row``."""
    return click.option(
        "--in-a-row",
        is_flag=True,
        help="The runs are all there was: the temperature goes on from one to the next.",
    )(function)


def twin_option(function: Function) -> Function:
    """Add the option ``--twin MODEL.toml``."""
    return click.option(
        "--twin",
        metavar="MODEL.toml",
        type=EXISTING,
        help="Judge every finished cycle by this fitted model (with [fit]): a band on the live page, an "
        "event in the run where cycles leave it, with what has moved.",
    )(function)


def edits_options(function: Function) -> Function:
    """Add the options ``--take-edits`` and ``--keep``; :func:`edits_choice` makes one word of them."""
    take = click.option(
        "--take-edits",
        is_flag=True,
        help="The campaign's files were edited: go on with the edits, without asking.",
    )
    keep = click.option(
        "--keep",
        is_flag=True,
        help="The campaign's files were edited: go on with the files as they were taken.",
    )
    return take(keep(function))


def edits_choice(*, take_edits: bool, keep: bool) -> Literal["take", "keep"] | None:
    """Return what the options say of edited files; None where neither was given.

    Raises
    ------
    BadInput
        If both were given.
    """
    if take_edits and keep:
        raise BadInput(
            "--keep leaves edits out and --take-edits goes on with them: nothing was moved",
            file="--keep --take-edits",
            remedy="give only one of them",
        )
    if take_edits:
        return "take"
    return "keep" if keep else None


def key_values(pairs: Sequence[str], option: str, form: str) -> dict[str, str]:
    """Return ``NAME=VALUE`` options as a dictionary.

    Raises
    ------
    BadInput
        If one has no ``=`` or a name is given twice.
    """
    result: dict[str, str] = {}
    for pair in pairs:
        name, separator, value = pair.partition("=")
        if not separator or not name or not value:
            raise BadInput(f"“{pair}” has not the form {form}", file=option, remedy=f"write {option} {form}")
        if name in result:
            raise BadInput(f"“{name}” is given twice", file=option, remedy="give it once")
        result[name] = value
    return result


@contextmanager
def open_output(target: str) -> Iterator[TextIO]:
    """Open a text file for writing, or standard output (``-``).

    Raises
    ------
    BadInput
        As :func:`bufferstand.foundation.files.output.replaced_whole`, and if standard output is closed.
    """
    if target == "-":
        if sys.stdout is None:  # closed by whoever started this
            raise BadInput("standard output is closed", remedy="open it, or name a file")
        yield sys.stdout
        return
    with replaced_whole(Path(target)) as path, path.open("w", encoding="utf-8", newline="\n") as stream:
        yield stream


def check_named(*targets: str | Path | None) -> None:
    """Refuse names of results before anything is computed; None and ``-`` are none.

    Raises
    ------
    BadInput
        As :func:`bufferstand.foundation.files.output.check_outputs`.
    """
    check_outputs(Path(target) for target in targets if target is not None and str(target) != "-")


def write_json(content: Any, target: str) -> None:
    """Write JSON to a file, or to standard output with nothing else on it (``-``).

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    with open_output(target) as stream:
        stream.write(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def warn(message: str) -> None:
    """Say on standard error what the user should know but need not stop for."""
    click.echo(f"warning: {plain(message)}", err=True)


def figure(value: float | None, digits: int) -> str:
    """Return a number with fixed decimals, or a dash where there is none."""
    return "—" if value is None else f"{value:.{digits}f}"
