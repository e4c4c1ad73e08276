"""The purpose of a run: the conformity test of a specimen, or a characterisation of it."""

from __future__ import annotations

from typing import Literal

Purpose = Literal["conformity", "characterisation"]
"""As the campaign says of a step, or ``[test]`` of an import."""
