"""What to do about a serial port that cannot be opened."""

from __future__ import annotations

HELD = ("exclusively lock", "Resource temporarily unavailable")
"""What the system says of a port that another program has."""


def is_held(text: str) -> bool:
    """Return whether a port could not be opened because another program holds it."""
    return any(sign in text for sign in HELD) or "busy" in text.lower()


def cannot_be_opened(device: str, reason: str) -> str:
    """Return the message about a device whose port cannot be opened, with what to do."""
    do = "look whether the device is there, plugged in, free, and readable by you"
    if is_held(reason):
        do = "another program holds it (“stand read”, a campaign, a terminal): end that one, or wait for it"
    return f"{device}: cannot be opened ({reason}); {do}"
