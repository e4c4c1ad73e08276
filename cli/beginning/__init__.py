"""The guided beginning: a first stand, specimen and campaign as commented files that are valid."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.cli.beginning.answers import (
        CAMPAIGNS,
        CHANNELS,
        CONTROLLERS,
        FURTHER,
        MOST_FORCE_KN,
        MOST_THERMOMETERS,
        MOST_WIRES,
        NONE,
        UNITS,
        Answers,
        Certificate,
        is_like_shipped,
        is_twin,
        parse_certificate,
        parse_coefficients,
    )
    from bufferstand.cli.beginning.writing import (
        write_first_files,
    )

__all__ = [
    "CAMPAIGNS",
    "CHANNELS",
    "CONTROLLERS",
    "FURTHER",
    "MOST_FORCE_KN",
    "MOST_THERMOMETERS",
    "MOST_WIRES",
    "NONE",
    "UNITS",
    "Answers",
    "Certificate",
    "is_like_shipped",
    "is_twin",
    "parse_certificate",
    "parse_coefficients",
    "write_first_files",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
