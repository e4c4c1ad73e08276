"""Arming: before a real stand moves, the motion is announced and a person must confirm it.

The person types an id that only who has looked at the stand can know to be right: of the specimen that is in
it, or of the stand itself. Whoever starts from a script names it with ``--yes-move``. Nothing is asked of the
devices before the answer is there: what is refused has touched nothing.
"""

from __future__ import annotations

import getpass
import os
import select
import sys
import termios
import unicodedata
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any, Literal, TextIO, TypeVar

import click

from bufferstand.foundation import BadInput

Function = TypeVar("Function", bound=Callable[..., Any])
OPTION = "--yes-move"
UNTOUCHED = "nothing was moved, and no device was touched"
"""What every refusal says."""
LOOK_S = 0.1
"""How often it is seen whether a question was interrupted [s]."""


@dataclass(frozen=True)
class Movement:
    """What is about to be moved.

    Parameters
    ----------
    subject : str
        Whose id is asked for: ``specimen`` or ``stand``.
    subject_id : str
        The right answer.
    facts : tuple of (heading, text)
        What the person must see before answering, one row each: stand, specimen, limits, first motion.
    """

    subject: Literal["specimen", "stand"]
    subject_id: str
    facts: tuple[tuple[str, str], ...]

    def text(self) -> str:
        """Return the announcement, rows aligned."""
        width = max((len(heading) for heading, _ in self.facts), default=0)
        rows = (f"  {heading:<{width}}  {text}" for heading, text in self.facts)
        return "\n".join(("THIS MOVES A REAL STAND", *rows))


@dataclass(frozen=True)
class Consent:
    """Who said that it may move, when and how; it goes into the campaign's folder and every run.

    Parameters
    ----------
    subject, subject_id
        As of :class:`Movement`.
    by : str
        The login name.
    at_utc : str
        ISO 8601.
    how : str
        ``typed`` at the terminal, or ``--yes-move``.
    """

    subject: str
    subject_id: str
    by: str
    at_utc: str
    how: Literal["typed", "--yes-move"]

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data."""
        return asdict(self)


def yes_move_option(subject: Literal["specimen", "stand"]) -> Callable[[Function], Function]:
    """Return the option ``--yes-move``, which answers the question beforehand."""
    return click.option(
        OPTION,
        "yes_move",
        metavar=subject.upper(),
        help=f"The {subject}'s id: a real stand moves without asking for it.",
    )


def ask_to_move(movement: Movement, given: str | None) -> Consent:
    """Show what will move, and return the consent of the person at the terminal, or of ``--yes-move``.

    Parameters
    ----------
    movement : Movement
        What will move.
    given : str or None
        What ``--yes-move`` says; None: it is asked for.

    Raises
    ------
    BadInput
        If there is nobody to ask, no answer, or a wrong id: nothing may move then.
    KeyboardInterrupt
        If the question is interrupted.
    """
    check_given(movement, given)
    if given is None and not _somebody_is_there():
        raise BadInput(
            f"{UNTOUCHED}: a real stand moves only once the {movement.subject}'s id was given, and there is "
            "no terminal to ask for it",
            file=OPTION,
            remedy=f"see that {_in_place(movement)}, then add {OPTION} {movement.subject_id}",
        )
    click.echo(movement.text(), err=True)
    if given is None:
        _check(movement, _answer(movement), typed=True)
    consent = Consent(
        movement.subject,
        movement.subject_id,
        by=user_name(),
        at_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        how="typed" if given is None else "--yes-move",
    )
    click.echo(f"armed by {consent.by} ({consent.how})", err=True)
    return consent


def check_given(movement: Movement, given: str | None) -> None:
    """Refuse a wrong ``--yes-move`` also where nothing is asked, as on a simulated stand.

    Raises
    ------
    BadInput
        If it is another id.
    """
    if given is not None:
        _check(movement, given, typed=False)


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal that this process may use: in the background it is not."""
    try:
        if stream is None or not stream.isatty():
            return False
        return os.tcgetpgrp(stream.fileno()) == os.getpgrp()
    except (OSError, ValueError):
        return False


def typed_line(question: str) -> str:
    """Ask at the terminal; what was typed before the question was there is no answer to it.

    Returns
    -------
    str
        The line, without blanks around it; empty at the end of the input (Ctrl-D).
    """
    with suppress(OSError, ValueError, termios.error):
        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
    click.echo(question, nl=False, err=True)
    # A Ctrl-C just before a blocking read would not be seen until the next key.
    while not select.select([sys.stdin], [], [], LOOK_S)[0]:
        pass
    line = sys.stdin.readline()
    if not line.endswith("\n"):
        click.echo(err=True)  # the cursor stands behind the question still
    return line.strip()


def user_name() -> str:
    """Return the login name of who runs this, or the user's number where there is none."""
    try:
        return getpass.getuser()
    except (KeyError, OSError, ImportError):
        return f"user {os.getuid()}"


def _somebody_is_there() -> bool:
    """Return whether a person sees the question (standard error) and can answer it (standard input)."""
    return is_terminal(sys.stdin) and is_terminal(sys.stderr)


def _in_place(movement: Movement) -> str:
    if movement.subject == "specimen":
        return f"specimen {movement.subject_id} is in the stand and everybody is clear of it"
    return f"everybody is clear of stand {movement.subject_id}"


def _answer(movement: Movement) -> str:
    try:
        return typed_line(
            f"Is everybody clear of it? Then type the id of the {movement.subject} that is to be moved: "
        )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(UNTOUCHED) from None


def _check(movement: Movement, answer: str, *, typed: bool) -> None:
    """Refuse anything but the id; blanks around it and the way of writing an accent do not count."""
    said, right = _plain(answer), movement.subject_id
    if said == _plain(right):
        return
    file = None if typed else OPTION
    if not said:
        raise BadInput(
            f"{UNTOUCHED}: the {movement.subject}'s id was not given",
            file=file,
            remedy=f"once {_in_place(movement)}, start again and give {right}",
        )
    where = {
        "specimen": "put in the specimen that the campaign names, or name in the campaign the one that is in",
        "stand": "take the stand file of the stand that is meant",
    }[movement.subject]
    raise BadInput(
        f"{UNTOUCHED}: “{answer.strip()}” was given, and the {movement.subject} is “{right}”",
        file=file,
        remedy=where,
    )


def _plain(text: str) -> str:
    return unicodedata.normalize("NFC", text.strip())
