"""Where an RMC's registers lie: ``%MDfile.element`` as a Modbus address and as a number in a command.

Source: RMC70/150 and RMCTools User Manual 3.62, pp. 1041 (Modbus), 779 (numbers), 1110 and 1138 (RMC150),
RMCTools web help “RMC75 Registers, Files 40-47” and “RMC Commands Overview”.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

ELEMENTS = 256
"""Elements of a file that Modbus can reach."""
LAST_ADDRESS = 0xFFFF
_WRITTEN = re.compile(r"%MD(\d{1,3})[.:](\d{1,3})")


@dataclass(frozen=True)
class RmcAddress:
    """A 32-bit register.

    Parameters
    ----------
    file, element : int
        As in ``%MDfile.element``.
    """

    file: int
    element: int

    @property
    def modbus(self) -> int:
        """Address as the manual counts it, from 1."""
        return 2 * (ELEMENTS * self.file + self.element) + 1

    @property
    def wire(self) -> int:
        """Address as it goes over the wire, from 0."""
        return self.modbus - 1

    @property
    def number(self) -> int:
        """As a parameter of a command names it."""
        return 4096 * self.file + self.element

    def plus(self, elements: int) -> RmcAddress:
        """Return the register so many elements further on; the next file follows behind the last element."""
        file, element = divmod(ELEMENTS * self.file + self.element + elements, ELEMENTS)
        return RmcAddress(file, element)

    def __str__(self) -> str:
        """Return it as RMCTools writes it."""
        return f"%MD{self.file}.{self.element}"


def parse_address(text: str) -> RmcAddress:
    """Return the register that a text like ``%MD9.8`` names.

    Raises
    ------
    ValueError
        If it is none that Modbus reaches.
    """
    found = _WRITTEN.fullmatch(text.strip())
    if found is None:
        raise ValueError(f"“{text}” is no register of an RMC; write e.g. “%MD9.8”")
    address = RmcAddress(int(found[1]), int(found[2]))
    if address.element >= ELEMENTS or address.modbus + 1 > LAST_ADDRESS + 1:
        raise ValueError(f"{text} cannot be reached by Modbus: files go to 127, elements to 255")
    return address


@dataclass(frozen=True)
class Model:
    """What differs between the controllers: files.

    Parameters
    ----------
    name : str
    commands : int
        File of the command area: ten registers an axis.
    plot_setup, plot_upload : int
        Files of plot 0: its settings and state, its dynamic upload.
    product : int or None
        What register ``%MD7.0`` holds; None where it is not in what was read.
    axes, plots : int
    """

    name: str
    commands: int
    plot_setup: int
    plot_upload: int
    product: int | None
    axes: int
    plots: int = 8

    def command(self, axis: int) -> RmcAddress:
        """Return where the commands of an axis are written."""
        return RmcAddress(self.commands, 10 * axis)

    def status(self, axis: int) -> RmcAddress:
        """Return where the status of an axis begins."""
        return RmcAddress(8 + axis, 0)

    def upload(self, plot: int) -> RmcAddress:
        """Return where the dynamic upload of a plot begins."""
        return RmcAddress(self.plot_upload + plot, 0)

    def setup(self, plot: int) -> RmcAddress:
        """Return where the settings and the state of a plot begin."""
        return RmcAddress(self.plot_setup + plot, 0)


MODELS = {
    "rmc75": Model("rmc75", commands=25, plot_setup=32, plot_upload=40, product=None, axes=4),
    "rmc150": Model("rmc150", commands=40, plot_setup=96, plot_upload=104, product=2, axes=16),
}
"""An RMC200 has other files (its status begins at ``%MD256``), which this arithmetic does not reach."""
PRODUCT = RmcAddress(7, 0)
VARIABLES = RmcAddress(56, 0)
"""Current values of the variables 0 to 1023."""
VARIABLES_THERE = 1024
