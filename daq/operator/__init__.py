"""The operator: stop requests, keys, notes, the control socket, and progress in the terminal."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.operator.control_socket import (
        LEVELS,
        LONGEST_NAME,
        ask,
        is_running,
        listening,
    )
    from bufferstand.daq.operator.dead_man_switch import (
        DeadManSwitch,
    )
    from bufferstand.daq.operator.keys import (
        characters_from,
        keys_from,
    )
    from bufferstand.daq.operator.notes import (
        NOTES_NAME,
        add_note,
        read_notes,
        signed_note,
    )
    from bufferstand.daq.operator.progress import (
        CampaignProgress,
        Part,
        Phase,
        ProgressSink,
        SilentSink,
        Throttle,
        TwoSinks,
        Watcher,
    )
    from bufferstand.daq.operator.stop_request import (
        StopLevel,
        StopRequest,
        signals_held_back,
        stop_on_signals,
    )
    from bufferstand.daq.operator.terminal import (
        progress_on,
    )

__all__ = [
    "LEVELS",
    "LONGEST_NAME",
    "NOTES_NAME",
    "CampaignProgress",
    "DeadManSwitch",
    "Part",
    "Phase",
    "ProgressSink",
    "SilentSink",
    "StopLevel",
    "StopRequest",
    "Throttle",
    "TwoSinks",
    "Watcher",
    "add_note",
    "ask",
    "characters_from",
    "is_running",
    "keys_from",
    "listening",
    "progress_on",
    "read_notes",
    "signals_held_back",
    "signed_note",
    "stop_on_signals",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
