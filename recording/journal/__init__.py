"""The journal of a running recording: records with checksums, appended to a chain of files."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.journal.file import (
        JOURNAL_SUFFIX,
        STARTING_PATTERN,
        JournalFile,
        lock_or_refuse,
        remove_journal,
    )
    from bufferstand.recording.journal.records import (
        DataRecord,
        EndRecord,
        JournalEnd,
        Record,
    )
    from bufferstand.recording.journal.segments import (
        SEGMENT_BYTES,
        ChainReader,
        SegmentedJournal,
        later_segments,
        segment_path,
    )

__all__ = [
    "JOURNAL_SUFFIX",
    "SEGMENT_BYTES",
    "STARTING_PATTERN",
    "ChainReader",
    "DataRecord",
    "EndRecord",
    "JournalEnd",
    "JournalFile",
    "Record",
    "SegmentedJournal",
    "later_segments",
    "lock_or_refuse",
    "remove_journal",
    "segment_path",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
