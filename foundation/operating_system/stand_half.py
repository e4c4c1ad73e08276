"""Which half of the program this computer can run: at a stand it needs Linux, behind a desk it does not."""

from __future__ import annotations

import sys

from bufferstand.foundation.errors import BadInput


def has_stand_half() -> bool:
    """Return whether stands, real and simulated ones, can be worked here."""
    return sys.platform == "linux"


def need_linux(what: str) -> None:
    """Refuse what works a stand on a computer that cannot.

    Parameters
    ----------
    what : str
        What was asked for.

    Raises
    ------
    BadInput
        If this computer does not run Linux.
    """
    if not has_stand_half():
        raise BadInput(
            f"“{what}” needs Linux, as everything that works a stand, also a simulated one; records are"
            " imported, evaluated, compared and reported, and models fitted, on this computer, too",
            remedy="give this command on the computer of the stand",
        )
