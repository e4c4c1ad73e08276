"""The digital test report: the results of a report as XML for machines (DCC 3.2.1 of PTB, D-SI units)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.digital.proof import (
        evaluation_hash,
    )
    from bufferstand.evaluation.report.digital.whole import (
        render_digital,
    )

__all__ = [
    "evaluation_hash",
    "render_digital",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
