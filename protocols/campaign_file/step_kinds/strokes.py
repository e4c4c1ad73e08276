"""The keys of every step about its strokes: specimen's or piston's."""

from __future__ import annotations

from bufferstand.foundation.settings import Settings


class StrokeSettings(Settings):
    """Keys of a step that say whose strokes it asks for."""

    compensate: bool | None = None
    """For this step: ``true`` the specimen's strokes, ``false`` the piston's. ``false`` is part of the plan
    hash. Default: that of ``[stroke]``.
    """
