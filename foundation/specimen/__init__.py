"""The specimen file: the specimen, its test, and what the maker states of its spring."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.specimen.file import (
        Specimen,
        SpecimenFile,
        load_specimen,
    )
    from bufferstand.foundation.specimen.maker_data import (
        Catalogue,
    )

__all__ = [
    "Catalogue",
    "Specimen",
    "SpecimenFile",
    "load_specimen",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
