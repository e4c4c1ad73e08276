"""Where registers lie: files and elements of 32 bits, their addresses on Modbus (p. 192, 1041, 1138)."""

from __future__ import annotations

from dataclasses import dataclass

ELEMENTS = 256
"""Elements that a file has on Modbus (p. 1138: other protocols than DF1 address the first 256)."""


def modbus_address(file: int, element: int) -> int:
    """Give the Modbus address, counted from 1, of the first of a register's two words (p. 1041)."""
    return 2 * (ELEMENTS * file + element) + 1


def iec_number(file: int, element: int) -> int:
    """Give an address as the number that a command parameter takes: ``%MD8.33`` is 32801 (p. 779, 782)."""
    return file * 4096 + element


def place(address: int) -> tuple[int, int, int]:
    """Give file, element and half (0 or 1) of a Modbus address that is counted from 1."""
    register, half = divmod(address - 1, 2)
    return register // ELEMENTS, register % ELEMENTS, half


@dataclass(frozen=True)
class Model:
    """Files of one model (p. 192, 1041; help page “RMC Commands Overview”).

    Parameters
    ----------
    name : str
    commands, map_definition, data_map, controller : int
        Files of the command area, of the indirect data map and its definition, of the controller itself.
    plot_status, plot_upload : int
        File of plot 0's status and of its dynamic upload area; plot n lies n files on.
    axes, plots : int
        How many of them the emulator has (the manual's pages name files for so many).
    """

    name: str
    commands: int
    map_definition: int
    data_map: int
    controller: int
    plot_status: int
    plot_upload: int
    axes: int
    plots: int

    def low(self, file: int, element: int) -> tuple[int, int]:
        """Give what a place of the low address range stands for (1–511, 513–1023, 1025–1535, 1537–3583)."""
        if file == 0:
            return self.data_map, element
        if file == 1:
            return self.map_definition, element
        if file == 2:
            return self.commands, element
        if 3 <= file <= 6:
            return VARIABLES + file - 3, element
        return file, element


VARIABLES = 56
"""First file of the variables' current values, %MD56.0 to %MD59.255 (p. 1041)."""
AXIS_STATUS = 8
"""File of axis 0's status registers; axis n lies n files on (p. 864)."""

MODELS = {
    "RMC75": Model("RMC75", 25, 17, 18, 20, 32, 40, axes=4, plots=8),
    "RMC150": Model("RMC150", 40, 41, 42, 44, 96, 104, axes=16, plots=8),
}
