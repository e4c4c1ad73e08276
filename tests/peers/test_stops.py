"""Controllers by others take a command and its execution in one request, as the documents now ask for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.motions import RampTo, Release, StandStill
from tests.peers.controllers import Case, controller

Program = Callable[[str], Path]
CASES = (
    Case("c"),
    Case("go", ("--lean",)),
    Case("c", ("--scan-ms", "5")),
    Case("go", ("--scan-ms", "5", "--reply-at-edge")),
    Case("c", ("--no-fc23",)),
)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_hold_in_one_request_is_tried_when_it_is_switched_on_and_ends_a_motion(
    case: Case, program: Program, tmp_path: Path
) -> None:
    with controller(case, program(case.peer), tmp_path) as running:
        driver = build_controller(load_stand(running.stand), WallClock())
        driver.connect()
        driver.enable(force_limit_kN=100.0, stroke_limit_mm=50.0, watchdog_ms=30000)
        assert driver.stops_at_once, driver.events()
        ramp = driver.start(RampTo(target_mm=40.0, speed_mm_per_s=0.5))
        hold = driver.start(StandStill())
        release = driver.start(Release(speed_mm_per_s=20.0), hurry=True)
        driver.disable()
        driver.close()
        said = running.events()
    started = [event["sequence"] for event in said if event["event"] == "started"]
    assert started[-3:] == [ramp, hold, release]
    assert [event["code"] for event in said if event["event"] == "started"] == [1, 2, 1, 5]
