"""``bufferstand stand``: the stand by hand."""

from __future__ import annotations

import click

from bufferstand.cli.lazy import LazyGroup

COMMANDS = {
    "read": "Live readings of every channel: counts, unit, noise, age. Nothing moves.",
    "tare": "Take what force and draw wires read at rest for their zero. Nothing moves.",
    "zero": "Touch off the specimen and take first contact for stroke 0.",
    "jog": "Move the piston slowly, while a key is held.",
}


@click.group(
    "stand",
    cls=LazyGroup,
    modules={name: f"bufferstand.cli.commands.stand.{name}" for name in COMMANDS},
    summaries=COMMANDS,
    epilog="Example:  bufferstand stand read stand.toml --once",
)
def command() -> None:
    """The stand by hand: readings, zero, slow motions. What moves asks before it does."""
