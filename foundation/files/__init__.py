"""Files as text and bytes: writing them whole, naming them, hashing their content."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.files.durable import (
        append_line,
        make_folder,
        write_whole,
    )
    from bufferstand.foundation.files.hashes import (
        canonical_json,
        content_hash,
        file_hash,
    )
    from bufferstand.foundation.files.json_text import (
        NotJson,
        json_content,
        json_lines,
        json_object,
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
    from bufferstand.foundation.files.trees import (
        DEEPEST,
        TOO_MANY_DIGITS,
        OutOfForm,
        out_of_form,
        too_deep,
    )
    from bufferstand.foundation.files.typed_content import (
        MistypedError,
        of_type,
        typed,
        typed_json,
    )
    from bufferstand.foundation.files.xml_trees import (
        xml_tree,
    )

__all__ = [
    "DEEPEST",
    "TOO_MANY_DIGITS",
    "MistypedError",
    "NotJson",
    "OutOfForm",
    "append_line",
    "canonical_json",
    "check_outputs",
    "content_hash",
    "file_hash",
    "json_content",
    "json_lines",
    "json_object",
    "make_folder",
    "of_type",
    "out_of_form",
    "readable",
    "replaced_whole",
    "too_deep",
    "typed",
    "typed_json",
    "write_text",
    "write_whole",
    "xml_tree",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
