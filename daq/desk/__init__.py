"""The desk: the whole job in the browser, over a folder of stands, specimens, campaigns and runs."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.desk.server import (
        serve_desk,
    )

__all__ = [
    "serve_desk",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
