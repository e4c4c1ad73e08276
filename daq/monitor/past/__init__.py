"""What was recorded before: any span of a campaign or a run, thinned out, in bounded room."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.monitor.past.filling import (
        KeptHistory,
    )
    from bufferstand.daq.monitor.past.history import (
        BACK_S,
        History,
    )
    from bufferstand.daq.monitor.past.journal_streams import (
        JournalStreams,
    )
    from bufferstand.daq.monitor.past.run_spans import (
        RunSpans,
    )

__all__ = [
    "BACK_S",
    "History",
    "JournalStreams",
    "KeptHistory",
    "RunSpans",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
