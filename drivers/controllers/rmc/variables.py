"""The watchdog program's variables by their names: what another program on the RMC acts on."""

from __future__ import annotations

import math
from collections.abc import Mapping

from bufferstand.drivers.controllers.rmc.addresses import VARIABLES, RmcAddress
from bufferstand.drivers.controllers.rmc.program import AT, SINE_BLOCK, VARIABLES_USED
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters


class WatchdogVariables:
    """The variables that the watchdog program uses, and the status block of Sine Start among them.

    Parameters
    ----------
    registers : RmcRegisters
    first : int
        Number of the first of them in the controller.
    """

    def __init__(self, registers: RmcRegisters, first: int) -> None:
        self._registers, self._base = registers, VARIABLES.plus(first)

    def at(self, name: str) -> RmcAddress:
        """Return where one lies."""
        return self._base.plus(AT[name])

    def all(self) -> Mapping[str, float]:
        """Get every one, in one read."""
        found = self._registers.reals(self._base, VARIABLES_USED, "the watchdog program's variables")
        return dict(zip(AT, found, strict=True))

    def get(self, name: str) -> float:
        """Get one."""
        return self._registers.reals(self.at(name), 1, f"variable {name}")[0]

    def set(self, name: str, value: float) -> None:
        """Set one."""
        self._registers.set_reals(self.at(name), (value,), f"variable {name}")

    # --- what motions have to do with them (:class:`.motions.SineBlock`) ------------------------------

    @property
    def number(self) -> int:
        """Of the first register of the sine's status block."""
        return self._base.plus(SINE_BLOCK).number

    def reset(self) -> None:
        """Write that no sine has begun."""
        self.set("cycle", -1.0)

    def cycles(self) -> float:
        """Get how many cycles are done."""
        return self.get("cycle")

    def set_turn(self, force_kN: float, speed_mm_per_s: float) -> None:
        """Write where a static stroke turns back by itself; the speed first."""
        self.set("turn_speed", speed_mm_per_s)
        self.set("turn_force", force_kN)

    def has_turned(self) -> bool:
        """Whether the watchdog program has turned since."""
        return self.get("turn_force") == 0.0


def whole(value: float) -> int:
    """Return a variable as a whole number; 0 for what is no number."""
    return round(value) if math.isfinite(value) else 0


def milliseconds(seconds: float) -> int:
    """Return seconds as a register of 16 bits has them [ms]."""
    return min(0xFFFF, max(0, whole(1000.0 * seconds)))
