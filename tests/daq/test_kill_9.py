"""kill -9 of the real command on the real wires: nothing acknowledged is lost, the stand falls back."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.daq.killing import Tally, kill

LANES = 3


@pytest.mark.slow
def test_a_campaign_survives_being_killed(tmp_path: Path) -> None:
    tally = kill(tmp_path, kills=2, seed=3, steps=3, per_campaign=2)
    assert tally.kills == 2
    assert tally.acknowledged > 1000


@pytest.mark.long
def test_campaigns_survive_two_hundred_kills(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three stands at a time, as most of the time is spent waiting for the controller to drop its lock."""

    def lane(number: int) -> Tally:
        (tmp_path / f"lane {number}").mkdir()
        return kill(
            tmp_path / f"lane {number}",
            kills=67,
            seed=1000 * (number + 1),
            steps=6,
            per_campaign=10,
        )

    with ThreadPoolExecutor(LANES) as pool:
        tallies = list(pool.map(lane, range(LANES)))
    with capsys.disabled():
        for tally in tallies:
            print(f"\n{tally.line()}")
    assert sum(tally.kills for tally in tallies) >= 200
    struck = {stage for tally in tallies for stage in tally.stages}
    assert {"recording", "sealing", "recovering"} <= struck
    assert sum(tally.loaded for tally in tallies) > 40
