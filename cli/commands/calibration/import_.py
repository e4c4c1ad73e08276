"""``bufferstand calibration import``: from a certificate into a stand file."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click

from bufferstand.cli.options import EXISTING, warn
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from bufferstand.drivers.certificates import ChannelCalibration
    from bufferstand.foundation.channels import Calibration, Quantity


@click.command(
    "import",
    epilog="Example:  bufferstand calibration import certificate.xml --channel force --stand stand.toml",
)
@click.argument("certificate", metavar="CERTIFICATE.xml", type=EXISTING)
@click.option(
    "--channel", metavar="NAME", required=True, help="The channel that it is of, e.g. force, stroke_1."
)
@click.option(
    "--stand",
    metavar="STAND.toml",
    type=EXISTING,
    help="Change the channel in this stand file; without it the lines are printed, to be pasted.",
)
@click.option(
    "--table",
    metavar="NUMBER",
    type=click.IntRange(min=1),
    help="Which of the certificate's tables, where it has several.",
)
@click.option(
    "--valid-until",
    metavar="YYYY-MM-DD",
    type=click.DateTime(["%Y-%m-%d"]),
    help="Where the certificate does not name the day, or your laboratory sets another.",
)
def command(
    certificate: Path, channel: str, stand: Path | None, table: int | None, valid_until: datetime | None
) -> None:
    """Take a channel's calibration from a digital calibration certificate (DCC 3.0 to 3.3, XML).

    What a transducer gives (mV/V) becomes the channel's table. Of a certificate of the whole chain the errors
    with U become limits, and counts become values as before. Number, laboratory, day and validity are
    written beside. A signature of the certificate is not checked. Comments of the stand file stay.
    """
    from bufferstand.drivers.certificates import calibrated, channel_of, fragment, read_certificate

    read = read_certificate(certificate)
    until = None if valid_until is None else valid_until.date()
    if stand is None:
        imported = calibrated(read, _quantity(channel), None, table=table, valid_until=until)
        _tell(imported)
        click.echo(fragment(imported), nl=False)
        return
    quantity, before = channel_of(stand, channel)
    imported = calibrated(read, quantity, before, table=table, valid_until=until)
    _change(stand, channel, before, imported)
    _tell(imported)
    if before.date is not None and read.day < before.date:
        warn(f"the certificate is of {read.day}, and the former calibration of {before.date}")
    former = f"“{before.id}” ({before.certificate or 'no certificate'}, {before.date or 'no day'})"
    click.echo(f"{stand}: {channel} is calibrated by {read.number} of {read.day}; before by {former}")


def _quantity(channel: str) -> Quantity:
    """Return what a channel measures, by its name: the quantity, and a number where there are several."""
    from bufferstand.foundation.channels import Quantity

    for quantity in get_args(Quantity):
        if channel.rstrip("0123456789").rstrip("_") == quantity:
            found: Quantity = quantity
            return found
    raise BadInput(
        f"“{channel}” does not tell what the channel measures",
        file="--channel",
        remedy="give --stand STAND.toml, or a name as in it, e.g. force, stroke_1",
    )


def _change(stand: Path, channel: str, before: Calibration, imported: ChannelCalibration) -> None:
    """Write the stand file anew, once it is seen to be one that can be used."""
    from bufferstand.drivers.certificates import changed_stand
    from bufferstand.drivers.stand_file import load_any_stand
    from bufferstand.foundation.files import replaced_whole

    text = changed_stand(stand, channel, before, imported)
    with replaced_whole(stand) as place:
        place.write_text(text, encoding="utf-8", newline="\n")
        try:
            load_any_stand(place)
        except BadInput as error:
            raise BadInput(
                f"with this certificate it could not be used: {error.problem}",
                file=stand,
                place=error.place,
                remedy=f"nothing was changed; {error.remedy}",
            ) from None


def _tell(imported: ChannelCalibration) -> None:
    for note in imported.notes:
        click.echo(note, err=True)
