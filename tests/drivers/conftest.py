from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers.register_maps.profile import Profile, load_profile

SAMPLE_STAND = Path(__file__).parents[2] / "sample_runs" / "stand.toml"


@pytest.fixture(scope="session")
def profile() -> Profile:
    return load_profile("ring")
