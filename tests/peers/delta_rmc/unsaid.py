"""What the pages that were to be had do not say: a choice of this emulator, to be turned round by tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Unsaid:
    """Everything that is not in the pages; none of it is a fact about an RMC.

    Parameters
    ----------
    low_word_first : bool
        Order of a register's two words on Modbus (a setting of the controller; the pages on FINS have the low
        word first).
    largest_read : int
        Words in one reply at most.
    command_error_bit : int
        Bit of the Error Bits register that stands for a command that was refused.
    command_error_number : int
        Last Error Number after that.
    target_parameters : tuple of str
        What the first parameter of Change Target Parameter (80) selects, from number 0 on.
    ramp_types : tuple of str
        What its third parameter selects, from number 0 on.
    mode_2_starts : {"newest", "oldest"}
        Where Current Index stands after upload mode 2 or 3 is written.
    index_moves_when_lost : bool
        Whether a read whose reply was lost has moved Current Index.
    plot_samples : int
        Samples that a continuous plot holds.
    settle_mm : float
        How far the target may be from where a sine starts.
    in_position_mm : float
        In Position Tolerance (a parameter of the axis).
    """

    low_word_first: bool = True
    largest_read: int = 125
    command_error_bit: int = 14
    command_error_number: int = 99
    target_parameters: tuple[str, ...] = ("frequency", "amplitude", "offset", "cycles")
    ramp_types: tuple[str, ...] = ("time", "cycles", "rate", "time-log", "cycles-log")
    mode_2_starts: Literal["newest", "oldest"] = "newest"
    index_moves_when_lost: bool = True
    plot_samples: int = 4096
    settle_mm: float = 0.05
    in_position_mm: float = 0.1
