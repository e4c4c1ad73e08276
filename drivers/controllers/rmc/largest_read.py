"""How many registers an RMC answers in one read: found by asking, since its documents do not say it."""

from __future__ import annotations

from collections.abc import Callable

from bufferstand.foundation import DeviceFault

MOST = 125
"""Registers of one read that Modbus allows (application protocol 1.1b3, function 3)."""
LEAST = 20
"""Ten values of 32 bits: whoever answers less has shown no status of an axis before."""


def find_largest_read(read: Callable[[int], object]) -> int:
    """Return the largest even number of registers that is answered.

    Values of 32 bits lie in pairs, so that odd numbers are of no use. What is answered once is taken to be
    answered always; numbers between are halved, so that at most seven reads are made.

    Parameters
    ----------
    read : callable
        Reads so many registers from where as many lie; raises where that is refused or not answered.

    Raises
    ------
    DeviceFault
        If not even :data:`LEAST` are answered.
    """
    read(LEAST)
    answered, refused = LEAST // 2, MOST // 2 + 1
    middle = MOST // 2  # most likely all that Modbus allows
    while refused - answered > 1:
        try:
            read(2 * middle)
        except DeviceFault:
            refused = middle
        else:
            answered = middle
        middle = (answered + refused) // 2
    return 2 * answered
