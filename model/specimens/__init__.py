"""Variation over specimens: mean and spread of fitted models, new against used (docs/specimens.md)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.specimens.between import (
        Between,
        GroupDifference,
        between_specimens,
        difference_of,
    )
    from bufferstand.model.specimens.figures import (
        FigureSpread,
        SpecimenFigure,
        compare_specimens,
        figures_of,
    )

__all__ = [
    "Between",
    "FigureSpread",
    "GroupDifference",
    "SpecimenFigure",
    "between_specimens",
    "compare_specimens",
    "difference_of",
    "figures_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
