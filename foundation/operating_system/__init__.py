"""What differs between Linux, macOS and Windows, so that no other room of the offline half has to ask."""

from typing import TYPE_CHECKING

from bufferstand.foundation.lazy_face import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.operating_system.bounds import (
        ReaderBounds,
        bound_processor_time,
        bound_reader,
        bounded_memory,
        usable_cores,
    )
    from bufferstand.foundation.operating_system.disk import (
        BINARY,
        make_read_only,
        nameless_file,
        read_at,
        reserve_space,
        sync_data,
        sync_folder,
        write_at,
    )
    from bufferstand.foundation.operating_system.locks import (
        is_lock_taken,
    )
    from bufferstand.foundation.operating_system.signals import (
        ENDING_SIGNALS,
        let_signals_come,
        signals_held,
    )
    from bufferstand.foundation.operating_system.stand_half import (
        has_stand_half,
        need_linux,
    )

__all__ = [
    "BINARY",
    "ENDING_SIGNALS",
    "ReaderBounds",
    "bound_processor_time",
    "bound_reader",
    "bounded_memory",
    "has_stand_half",
    "is_lock_taken",
    "let_signals_come",
    "make_read_only",
    "nameless_file",
    "need_linux",
    "read_at",
    "reserve_space",
    "signals_held",
    "sync_data",
    "sync_folder",
    "usable_cores",
    "write_at",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
