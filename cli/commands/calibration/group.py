"""``bufferstand calibration``: calibrations of a stand's channels."""

from __future__ import annotations

import click

from bufferstand.cli.lazy import LazyGroup

COMMANDS = {
    "import": "Take a channel's calibration from a digital calibration certificate (DCC).",
}


@click.group(
    "calibration",
    cls=LazyGroup,
    modules={"import": "bufferstand.cli.commands.calibration.import_"},
    summaries=COMMANDS,
    epilog="Example:  bufferstand calibration import certificate.xml --channel force --stand stand.toml",
)
def command() -> None:
    """Calibrations of a stand's channels."""
