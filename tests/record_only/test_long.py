"""Eight channels at 5 kHz, none lost: fifteen seconds always, ten minutes with ``--long``.

In real time: the emulator's buffer is that of a T7 and holds 0.4 s. On a busy computer put ``chrt --rr 1``
before it, as for the peers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.recording.runfile.file import open_run
from tests.record_only.bench import MEAN_MM, call, labjack, stand_text

RATE_HZ, INPUTS = 5000.0, 8


@pytest.mark.parametrize("lasts_s", [15, 600])
@pytest.mark.dose(1)
def test_nothing_of_eight_channels_at_5_kHz_is_lost(tmp_path: Path, lasts_s: int) -> None:  # noqa: N802
    with labjack(inputs=INPUTS) as far:
        stand = tmp_path / "stand.toml"
        stand.write_text(stand_text(far, inputs=INPUTS, keys=f"rate_Hz = {RATE_HZ}"), encoding="utf-8")
        done = call(
            "record",
            stand,
            "--out",
            tmp_path,
            "--for",
            f"{lasts_s}s",
            "--name",
            "one",
            patience_s=lasts_s + 300,
        )
    assert "acquisition: " in done.stderr
    assert "none lost" in done.stderr
    run = open_run(tmp_path / "one.h5")
    assert run.gaps("acquisition") == []
    assert run.streams["acquisition"].rows >= RATE_HZ * (lasts_s - 1)
    stroke = run.series("stroke_1")
    assert np.allclose(np.diff(stroke.time_s), 1.0 / RATE_HZ, atol=1e-9)
    assert float(np.mean(stroke.value[: int(10 * RATE_HZ)])) == pytest.approx(MEAN_MM, abs=0.1)
    call("verify", tmp_path / "one.h5")
