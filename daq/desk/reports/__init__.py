"""The test report: made by ``bufferstand report`` from a form on the pages, signed, verified, shown."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.desk.reports.offered import (
        MODEL_MARK,
        head_of,
        toml_files,
    )
    from bufferstand.daq.desk.reports.pages import (
        Reports,
    )

__all__ = [
    "MODEL_MARK",
    "Reports",
    "head_of",
    "toml_files",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
