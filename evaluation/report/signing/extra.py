"""The optional libraries that sign and check signatures."""

from __future__ import annotations

import logging
from importlib.util import find_spec

from bufferstand.foundation import BadInput, how_to_add


def needs_sign(what: str) -> None:
    """Refuse what cannot be done without the extra ``sign``.

    Parameters
    ----------
    what : str
        What needs it: the beginning of the message.

    Raises
    ------
    BadInput
        If the extra is not installed.
    """
    if find_spec("pyhanko") is None:
        raise BadInput(
            f"{what} needs pyHanko, which is not installed", remedy=f"install it ({how_to_add('sign')})"
        )
    # They log what is wrong, with tracebacks; it is told by findings and messages here.
    for name in ("pyhanko", "pyhanko_certvalidator"):
        log = logging.getLogger(name)
        if not log.handlers:
            log.addHandler(logging.NullHandler())
