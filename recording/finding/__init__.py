"""Finding run files: their key facts, an index as cache, and queries."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.finding.cache_file import (
        NO_FOLDER,
        STAMP_COLUMNS,
        CacheFile,
        Stamp,
        check_sum,
        default_folder,
        stamp_of,
    )
    from bufferstand.recording.finding.files import (
        is_there,
        matching,
    )
    from bufferstand.recording.finding.index import (
        PLANNED,
        RECORDED,
        indexed_runs,
        recorded_facts,
    )
    from bufferstand.recording.finding.query import (
        Query,
        QueryField,
        parse_query,
    )
    from bufferstand.recording.finding.run_facts import (
        RunFileFacts,
        facts_of,
        list_runs,
        run_files,
        unsealed,
    )

__all__ = [
    "NO_FOLDER",
    "PLANNED",
    "RECORDED",
    "STAMP_COLUMNS",
    "CacheFile",
    "Query",
    "QueryField",
    "RunFileFacts",
    "Stamp",
    "check_sum",
    "default_folder",
    "facts_of",
    "indexed_runs",
    "is_there",
    "list_runs",
    "matching",
    "parse_query",
    "recorded_facts",
    "run_files",
    "stamp_of",
    "unsealed",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
