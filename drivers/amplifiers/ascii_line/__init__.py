"""Amplifiers and sensors that speak lines of text, by a description file."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.amplifiers.ascii_line.description import (
        LineDescription,
        load_line_description,
        shipped_line_descriptions,
    )

__all__ = [
    "LineDescription",
    "load_line_description",
    "shipped_line_descriptions",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
