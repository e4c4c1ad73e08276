"""What a run is for: the one test that a statement of conformity rests on, or to know the specimen."""

from __future__ import annotations

from typing import Literal

Purpose = Literal["conformity", "characterisation"]
"""As the campaign says of a step, or ``[test]`` of an import."""
