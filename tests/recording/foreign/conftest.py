"""Fixtures of the tests on foreign records."""

from __future__ import annotations

import pytest

from bufferstand.recording.foreign.text import blocks as textblocks


@pytest.fixture(params=["whole", "small blocks"])
def block_size(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Read in one block, and in blocks of a few characters: the result must be the same."""
    if request.param == "small blocks":
        monkeypatch.setattr(textblocks, "BLOCK_CHARACTERS", 20)
    return str(request.param)
