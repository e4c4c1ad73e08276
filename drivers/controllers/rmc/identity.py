"""Who answers: a controller of the model, with the watchdog program, in the word order of the stand file."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from bufferstand.drivers.controllers.rmc.addresses import RmcAddress
from bufferstand.drivers.controllers.rmc.program import EDITION, TEST_VALUE
from bufferstand.drivers.controllers.rmc.registers import WordOrder, bytes_of, words_of


def find_mismatch(
    variables: Mapping[str, float],
    product: float,
    *,
    expected: int | None,
    model: str,
    order: WordOrder,
    test_at: RmcAddress,
) -> str:
    """Return why what answers is not what the stand file says; empty where it is.

    Parameters
    ----------
    variables : mapping of str to float
        The watchdog program's.
    product : float
        Register ``%MD7.0``.
    expected : int or None
        What it holds in this model; None where that is not known.
    model : str
    order : {'big', 'little'}
        In which all was read.
    test_at : RmcAddress
        Of the variable ``test``.
    """
    test = variables["test"]
    if test != TEST_VALUE:
        return _wrong_test(test, order, test_at)
    if expected is not None and product != expected:
        return f"%MD7.0 holds {product:g}, an {model} has {expected}; look at [controller.rmc] model"
    if variables["edition"] != EDITION:
        return (
            f"the watchdog program has edition {variables['edition']:g}, this software knows {EDITION}; "
            "load the one that it ships"
        )
    return ""


def _wrong_test(test: float, order: WordOrder, at: RmcAddress) -> str:
    """Return what is wrong with the test value: the order of words, or that there is none."""
    other: WordOrder = "little" if order == "big" else "big"
    swapped = struct.unpack(">f", bytes_of(words_of(struct.pack(">f", test), order), other))[0]
    if swapped == TEST_VALUE:
        return f'{at} reads right with the words the other way round; write word_order = "{other}"'
    return (
        f"{at} holds {test:g} instead of {TEST_VALUE:g}: the watchdog program is not loaded, or begins "
        "at another variable; bufferstand instruments --program rmc prints it"
    )
