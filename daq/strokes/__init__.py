"""The stroke that was asked for.

What the piston is told to do for it, what was reached, and what is learned from that.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.strokes.command_settings import (
        StrokeCommandSettings,
    )
    from bufferstand.daq.strokes.commands import (
        StrokeCommands,
    )
    from bufferstand.daq.strokes.correction_steps import (
        StrokeBounds,
    )
    from bufferstand.daq.strokes.knowledge import (
        StrokeKnowledge,
    )
    from bufferstand.daq.strokes.knowledge_file import (
        NOW_NAME,
        StrokeKeeper,
        learned_in,
    )
    from bufferstand.daq.strokes.sine_command import (
        commanded_sine,
        first_loading,
        uncompensated_sine,
    )
    from bufferstand.daq.strokes.stroke_rows import (
        add_strokes,
        read_strokes,
        spans,
    )
    from bufferstand.daq.strokes.turning_points import (
        prepare,
    )

__all__ = [
    "NOW_NAME",
    "StrokeBounds",
    "StrokeCommandSettings",
    "StrokeCommands",
    "StrokeKeeper",
    "StrokeKnowledge",
    "add_strokes",
    "commanded_sine",
    "first_loading",
    "learned_in",
    "prepare",
    "read_strokes",
    "spans",
    "uncompensated_sine",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
