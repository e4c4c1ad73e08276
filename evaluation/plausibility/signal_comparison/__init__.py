"""Checks of the wiring: signals of one motion compared with each other and with the plan.

Each check is a pure function from a :class:`bufferstand.evaluation.plausibility.Look` to findings, in its own
module. What is found joins the findings of the run (:mod:`bufferstand.evaluation.plausibility`) and has their
effects.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.signal_comparison.checks import (
        doubted_signals,
    )
    from bufferstand.evaluation.plausibility.signal_comparison.draw_wires import (
        check_wires,
    )

__all__ = [
    "check_wires",
    "doubted_signals",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
