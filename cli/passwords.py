"""Passwords: from a file, the environment or the terminal; never from the command line, which others see."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import click

from bufferstand.foundation import BadInput

SIGN_PASSWORD = "BUFFERSTAND_SIGN_PASSWORD"
_LONGEST = 4096


def sign_password(file: Path | None) -> Callable[[], str]:
    """Return what gives the password, or PIN, of the key that signs, when it is asked.

    Parameters
    ----------
    file : Path or None
        Its first line is the password. None: the environment variable :data:`SIGN_PASSWORD`; where that is
        not set, the user is asked on the terminal.
    """
    return (lambda: _of_file(file)) if file is not None else _of_environment


def _of_file(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            line = stream.readline(_LONGEST)
        return line.decode("utf-8").rstrip("\r\n")
    except FileNotFoundError:
        raise BadInput("no such file", file=file, remedy="check the path") from None
    except UnicodeDecodeError:
        raise BadInput("not UTF-8 text", file=file, remedy="save it as UTF-8") from None
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=file) from None


def _of_environment() -> str:
    if (known := os.environ.get(SIGN_PASSWORD)) is not None:
        return known
    if sys.stdin is None or not sys.stdin.isatty():
        raise BadInput(
            "the password of the key is needed, and there is no terminal to ask on",
            file="--sign",
            remedy=f"give --sign-password-file FILE, or set {SIGN_PASSWORD}",
        )
    return str(
        click.prompt("Password or PIN of the key", hide_input=True, default="", show_default=False, err=True)
    )
