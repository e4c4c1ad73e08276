"""The driver is not much slower than a bare socket, and the chain to disk leaves the computer free."""

from __future__ import annotations

import pytest

from benchmarks.acquisition import BENCHMARK


@pytest.mark.long
def test_beside_a_bare_socket_and_to_disk() -> None:
    beside_socket, share, *lost = BENCHMARK.ratios(smoke=False).values()
    assert lost == [0.0, 0.0]
    assert beside_socket < 2.5
    assert share < 0.25
