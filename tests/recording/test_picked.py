"""Some of a channel's samples, without the others: the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.runfile.run import Run

SAMPLE = Path(__file__).resolve().parents[2] / "sample_runs/runs/005-harmonic-20mm-20mm-1.27Hz.h5"


@pytest.mark.parametrize("falling", [False, True])
def test_picked_samples_are_those_of_the_series(falling: bool) -> None:
    """Alone or behind the whole series; where a falling branch hangs on all samples, of these."""
    channel = "position"

    def opened() -> Run:
        run = open_run(SAMPLE)
        stream = run.stream_of(channel)
        own = stream.channels[channel]
        if falling:
            branch = {"falling": (0.5, *own.calibration.coefficients[1:]), "turn_counts": 50.0}
            changed = own.model_copy(update={"calibration": own.calibration.model_copy(update=branch)})
            stream.channels = {**stream.channels, channel: changed}
        return run

    whole, run = opened().series(channel), opened()
    for _ in range(2):
        picked = run.picked(channel, 7)
        assert np.array_equal(picked.time_s, whole.time_s[::7])
        assert np.array_equal(picked.value, whole.value[::7])
        assert picked.unit == whole.unit
        run.series(channel)
