"""The peers, built once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.peers.building import build_c, build_go


@pytest.fixture(scope="session")
def c_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_c(tmp_path_factory.mktemp("c"))


@pytest.fixture(scope="session")
def go_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_go(tmp_path_factory.mktemp("go"))


@pytest.fixture
def program(request: pytest.FixtureRequest) -> Callable[[str], Path]:
    """Build the peer that is asked for, and only that one."""
    return lambda peer: request.getfixturevalue(f"{peer}_program")
