"""The contract of touching off by hand: one suite over physics in process and all kinds of wires.

Not on hardware: what moves a real stand belongs to the suite that asks for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from bufferstand.cli.campaign.simulation import STARVED_S
from bufferstand.daq.motions.motion_runner import Halt
from bufferstand.daq.operator.stop_request import StopRequest
from bufferstand.daq.stand.manual import ManualLimits, ManualStand, by_hand
from bufferstand.daq.zero.limits import ZeroLimits
from bufferstand.daq.zero.zeroing import Zeroing
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.interfaces import MotionState, Stand
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.clock import StandClock
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import Clock
from bufferstand.protocols.campaign_file.zero_table import ZeroTable
from tests.contract.stand.backends import STANDS, write_stand

WIRES_MM = (1.5, 1.2)
GAP_MM = 0.8
FORCE_KN = 0.6
OFF = (
    "seed = 1",
    f"seed = 1\nwire_zero_mm = {list(WIRES_MM)}\ngap_mm = {GAP_MM}\nforce_zero_kN = {FORCE_KN}",
)
LONG = "polled over RTU, Modbus RTU amplifier, 1-Wire folder"


@contextmanager
def opened(name: str, folder: Path) -> Iterator[tuple[Stand, StandFile, Clock]]:
    """Give a stand whose zeros are off, in process or on wires."""
    path = write_stand(folder, (OFF, *STANDS.get(name, ())))
    if name == "in process":
        file = load_stand(path)
        made = open_in_process(file)
        yield made.stand, file, made.clock
        return
    # By the stand's own time, which waits for its reader: a starved computer loses nothing.
    with start_process(path, directory=folder / "run", wait_for_reader=True) as process:
        endpoints = replace(process.served.endpoints(), timeout_s=STARVED_S)
        file = with_endpoints(load_stand(path), endpoints)
        clock = StandClock(Path(process.served.time_file or ""))
        stand = Stand(build_controller(file, clock), build_sensors(file, clock))
        try:
            yield stand, file, clock
        finally:
            stand.close()


def zeroing(hand: ManualStand, table: ZeroTable) -> Zeroing:
    limits = ZeroLimits(5.0, 5.0, 5.0)
    return Zeroing(hand.acquisition, hand.driver, table, limits, say=lambda _: None, catch_up=hand.catch_up)


@pytest.mark.dose(2)
@pytest.mark.parametrize(
    "name",
    ["in process", *(pytest.param(one, marks=pytest.mark.long if one == LONG else ()) for one in STANDS)],
)
def test_first_contact_is_found_and_the_stand_is_left_safe(name: str, tmp_path: Path) -> None:
    lines: list[str] = []
    with opened(name, tmp_path) as (stand, file, clock):
        limits = ManualLimits(20.0, 20.0)
        with by_hand(stand, file, clock, limits, StopRequest(), lines.append) as hand:
            zero = zeroing(hand, ZeroTable()).touch()
            hand.driver.wait(0.5)
            assert abs(hand.acquisition.latest.values["force"]) < 1.5
            assert abs(hand.acquisition.latest.values["stroke"]) < 0.1
        assert stand.controller.status().state in (MotionState.OFF, MotionState.READY)
    for wire, true in zip(("stroke_1", "stroke_2"), WIRES_MM, strict=True):
        found = zero.of(wire)
        assert found is not None
        assert abs(found.value - true) <= min(0.1, 2.0 * found.u)
    assert zero.value("position") == pytest.approx(GAP_MM, abs=0.1)
    assert zero.value("force") == pytest.approx(FORCE_KN, abs=0.1)
    assert zero.value("force_2") == pytest.approx(FORCE_KN, abs=0.15)
    assert zero.touch is not None
    assert zero.touch.peak_force_kN < 5.0
    assert lines[-1].startswith("safe stop: force")


def test_a_specimen_that_is_not_there_is_said_and_the_stand_is_left_safe(tmp_path: Path) -> None:
    with opened("in process", tmp_path) as (stand, file, clock):
        with (
            pytest.raises(Halt, match=r"no contact within 0\.5 mm of the piston's zero"),
            by_hand(stand, file, clock, ManualLimits(20.0, 20.0), StopRequest(), lambda _: None) as hand,
        ):
            zeroing(hand, ZeroTable(travel_max_mm=0.5)).touch()
        assert stand.controller.status().state in (MotionState.OFF, MotionState.READY)
