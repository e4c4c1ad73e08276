"""The keys of every step about its strokes: specimen's or piston's."""

from __future__ import annotations

from bufferstand.foundation.settings import Settings


class StrokeSettings(Settings):
    """Keys of a step that say whose strokes it asks for."""

    compensate: bool | None = None
    """True: the specimen's, the piston goes further by what the machine gives way; False: the piston's; None:
    as ``[stroke]`` of the campaign says."""
