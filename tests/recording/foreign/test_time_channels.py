"""A channel of times beside the times that a record keeps by itself: which one is taken, and what is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from .attempts import read, refused
from .texts import values

WAVE = {"wf_increment": 0.01, "wf_start_offset": 0.0}
ROWS = 5


def written(tmp_path: Path, *, group: str = "G", rows: int = ROWS) -> Path:
    """Return a record of stroke and force by their waveforms, and a channel of times in a group."""
    path = tmp_path / "record.tdms"
    ramp = np.arange(ROWS, dtype=np.float64)
    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject("G", "stroke", ramp, {"unit_string": "mm", **WAVE}),
                ChannelObject("G", "force", 2.0 * ramp, {"unit_string": "kN", **WAVE}),
                ChannelObject(group, "time", 0.5 * np.arange(rows), {"unit_string": "s"}),
            ]
        )
    return path


def test_a_time_channel_of_their_group_goes_before_the_waveform(tmp_path: Path) -> None:
    run, _ = read(written(tmp_path))
    assert run.series("force").time_s.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert values(run, "force") == [0.0, 2.0, 4.0, 6.0, 8.0]
    assert run.metadata["original"]["time_from"] == {"record": "column"}
    assert list(run.streams) == ["record"]


@pytest.mark.parametrize(("group", "rows"), [("H", ROWS), ("G", ROWS + 1)])
def test_a_time_channel_that_is_not_theirs_is_refused(tmp_path: Path, group: str, rows: int) -> None:
    message = refused(written(tmp_path, group=group, rows=rows))
    assert "is not of the group of stroke and force, or not as long" in message
    assert f"group “{group}”, channel “time”" in message
