"""Wiring checks of positions: piston, command and draw wires against each other."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.guards.wiring.positions.draw_wires import (
        WireJudge,
    )
    from bufferstand.daq.guards.wiring.positions.piston import (
        PistonJudge,
    )
    from bufferstand.daq.guards.wiring.positions.piston_delay import (
        BACK_S,
        explained_late_s,
        late_piston,
    )
    from bufferstand.daq.guards.wiring.positions.position_jump import (
        leapt,
    )
    from bufferstand.daq.guards.wiring.positions.wire_delay import (
        late_wires,
    )

__all__ = [
    "BACK_S",
    "PistonJudge",
    "WireJudge",
    "explained_late_s",
    "late_piston",
    "late_wires",
    "leapt",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
