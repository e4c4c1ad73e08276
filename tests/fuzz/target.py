"""What a target of fuzzing states: samples, how they are mutated, who reads them, how long it may take."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from random import Random

from bufferstand.foundation.errors import BadInput, DeviceFault

WELL_ENDED: tuple[type[Exception], ...] = (BadInput, DeviceFault)
"""How a reader may end instead of giving a value; what it says is one line."""

Mutate = Callable[[bytes, Random], bytes]
Read = Callable[[bytes], object]


class Altered(Exception):  # noqa: N818 - it names the fact
    """A reader gave other figures than those that were written, and said nothing of it."""


@dataclass(frozen=True)
class Case:
    """A target that is ready to read.

    Parameters
    ----------
    corpus : sequence of bytes
        Good samples.
    read : callable
        Takes an input; gives a value, or raises one of the exceptions of its target. :class:`Altered` says
        that the value is false.
    mutate : callable
        Makes an input of a sample.
    """

    corpus: Sequence[bytes]
    read: Read
    mutate: Mutate


@dataclass(frozen=True)
class Target:
    """Something that reads what others wrote.

    Parameters
    ----------
    name : str
    what : str
        What is read, in a line.
    begin : callable
        Makes it ready in an empty folder of its own.
    well_ended : tuple of exceptions
        How it may end instead of giving a value.
    dose : int
        Inputs that always run: those that are slow have fewer.
    cpu_s : float
        Processor time that an input may take [s].
    """

    name: str
    what: str
    begin: Callable[[Path], AbstractContextManager[Case]]
    well_ended: tuple[type[Exception], ...] = WELL_ENDED
    dose: int = 20
    cpu_s: float = 10.0
