"""Other families of spring models, fitted to the same runs as ours: the runs choose (docs/families.md)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.families.catalogue import (
        FAMILIES,
    )
    from bufferstand.model.families.comparing import (
        FamilyRanking,
        FittedFamily,
        FittedParameter,
        rank_families,
    )
    from bufferstand.model.families.data import (
        FamilyData,
        data_of,
    )
    from bufferstand.model.families.family import (
        Family,
    )
    from bufferstand.model.families.telling import (
        TellingRun,
        creates_energy,
        telling_run,
    )

__all__ = [
    "FAMILIES",
    "Family",
    "FamilyData",
    "FamilyRanking",
    "FittedFamily",
    "FittedParameter",
    "TellingRun",
    "creates_energy",
    "data_of",
    "rank_families",
    "telling_run",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
