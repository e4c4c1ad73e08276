"""The desk's pages of what was recorded: results of campaigns and runs, reports, and the archive."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.desk.results.archive import (
        Archive,
    )
    from bufferstand.daq.desk.results.pages import (
        Results,
    )

__all__ = [
    "Archive",
    "Results",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
