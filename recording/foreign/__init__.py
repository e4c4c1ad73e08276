"""Foreign records: files of other makers, read into run files without guessing."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.foreign.import_options import (
        ImportOptions,
    )
    from bufferstand.recording.foreign.importing import (
        Imported,
        import_file,
    )
    from bufferstand.recording.foreign.mapping import (
        MappingFile,
    )

__all__ = [
    "ImportOptions",
    "Imported",
    "MappingFile",
    "import_file",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
