"""The driver is not much slower than a bare socket, and the chain to disk leaves the computer free."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import acquisition
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import with_endpoints


@pytest.mark.long
def test_beside_a_bare_socket_and_to_disk(tmp_path: Path) -> None:
    stand = acquisition.prompt_stand(tmp_path)
    alone = acquisition.controller_alone(tmp_path)
    with start_process(alone, directory=tmp_path / "fast", speed=acquisition.FAST) as process:
        rate, ratio, _, each_us, lost = acquisition.fast_enough(
            with_endpoints(load_stand(alone), process.served.endpoints()), 10.0
        )
    print(f"\n{rate:.0f} samples/s, {each_us:.0f} µs at best, {ratio:.2f} of a bare socket")
    assert lost == 0
    assert ratio < 2.5
    speed = acquisition.CHAIN_HZ / 1000.0
    with start_process(stand, directory=tmp_path / "chain", speed=speed) as process:
        share, rate, lost = acquisition.chain(
            with_endpoints(load_stand(stand), process.served.endpoints()), tmp_path, 10.0, speed
        )
    print(f"chain {rate:.0f} samples/s, {share:.3f} of a processor")
    assert lost == 0
    assert share < 0.25
