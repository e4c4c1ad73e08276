"""The run file (HDF5): layout, metadata, writing, reading, and checks of its contents."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.runfile.content_checks import ContentFault
    from bufferstand.recording.runfile.data_frames import (
        to_dataset,
        to_frame,
    )
    from bufferstand.recording.runfile.device_clocks import (
        CLOCK_EVENT,
        ClockLine,
        ClockReadings,
        readings_in,
    )
    from bufferstand.recording.runfile.document_format import FORMAT, FORMAT_VERSION
    from bufferstand.recording.runfile.file import (
        TEMPORARY_SUFFIX,
        checked_content,
        content_faults,
        fitting_heads,
        metadata_as_stated,
        open_run,
        read_metadata,
        write_columns,
        write_run,
    )
    from bufferstand.recording.runfile.layout import (
        ENTRY,
        USER_BLOCK_BYTES,
        DatasetColumn,
        Widths,
        file_is_as_sealed,
        item_values,
        segment_rows,
        stream_columns,
    )
    from bufferstand.recording.runfile.metadata import (
        KINDS,
        STATUSES,
        StreamHead,
        check_new_document,
    )
    from bufferstand.recording.runfile.other_clocks import (
        Alignment,
        OtherClocks,
    )
    from bufferstand.recording.runfile.run import (
        Run,
        RunEvent,
        Series,
        mean_stroke,
    )
    from bufferstand.recording.runfile.simulated_origin import (
        HOW_KEY,
        KEY,
        RECORD_ONLY_KEY,
        SPEED_KEY,
        is_record_only,
        simulated_of,
    )
    from bufferstand.recording.runfile.stream import StreamData

__all__ = [
    "CLOCK_EVENT",
    "ENTRY",
    "FORMAT",
    "FORMAT_VERSION",
    "HOW_KEY",
    "KEY",
    "KINDS",
    "RECORD_ONLY_KEY",
    "SPEED_KEY",
    "STATUSES",
    "TEMPORARY_SUFFIX",
    "USER_BLOCK_BYTES",
    "Alignment",
    "ClockLine",
    "ClockReadings",
    "ContentFault",
    "DatasetColumn",
    "OtherClocks",
    "Run",
    "RunEvent",
    "Series",
    "StreamData",
    "StreamHead",
    "Widths",
    "check_new_document",
    "checked_content",
    "content_faults",
    "file_is_as_sealed",
    "fitting_heads",
    "is_record_only",
    "item_values",
    "mean_stroke",
    "metadata_as_stated",
    "open_run",
    "read_metadata",
    "readings_in",
    "segment_rows",
    "simulated_of",
    "stream_columns",
    "to_dataset",
    "to_frame",
    "write_columns",
    "write_run",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
