"""From a run file to a record: joining streams of different rates, resampling, and averaging of long runs."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.loading.condense import (
        condensed_for,
    )
    from bufferstand.evaluation.loading.load import (
        load_opened,
        load_run,
    )
    from bufferstand.evaluation.loading.long_runs import (
        on_time,
    )

__all__ = [
    "condensed_for",
    "load_opened",
    "load_run",
    "on_time",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
