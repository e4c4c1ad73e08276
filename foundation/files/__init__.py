"""Files as text and bytes: writing them whole, naming them, hashing their content."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.files.hashes import (
        canonical_json,
        content_hash,
        file_hash,
    )
    from bufferstand.foundation.files.names import (
        readable,
    )
    from bufferstand.foundation.files.output import (
        check_outputs,
        replaced_whole,
    )
    from bufferstand.foundation.files.text import (
        write_text,
    )

__all__ = [
    "canonical_json",
    "check_outputs",
    "content_hash",
    "file_hash",
    "readable",
    "replaced_whole",
    "write_text",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
