"""One reader of a device on this computer: a second one would end the first one's stream."""

from __future__ import annotations

import hashlib
import socket
import sys

from bufferstand.foundation import DeviceFault


def claim(device: str, name: str) -> socket.socket | None:
    """Take a device for this process; it is free again when the socket is closed, or the process is gone.

    Parameters
    ----------
    device : str
        What tells it from others: kind and address.
    name : str
        What messages call it.

    Returns
    -------
    socket or None
        To be closed in the end. None where the system has no names that vanish with their owner (all but
        Linux): there nobody is kept out.

    Raises
    ------
    DeviceFault
        If another process of this computer, or another driver of this one, reads it.
    """
    if not sys.platform.startswith("linux"):
        return None
    held = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        # A name in this space has 107 bytes at most; an address may be longer.
        held.bind(f"\0bufferstand {hashlib.sha256(device.encode()).hexdigest()}")
    except OSError:
        held.close()
        raise DeviceFault(
            f"{name}: another program of this computer reads it; let that one end, its stream would break"
        ) from None
    return held
