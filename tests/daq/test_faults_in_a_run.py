"""What an engineer reads in a run when something fails, and that the stand ends safe; in virtual time."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers.simulated.faults.schedule import parse_fault
from bufferstand.recording.runfile.file import open_run
from tests.daq.test_in_process import GENTLE, run

ENDS = {
    "controller=trip@8": "the controller stopped the motion: it reports fault 4 (actuator)",
    "controller=watchdog@8": "its watchdog ran out (it was not fed in time) and it ramped to zero force",
    "controller=clock-jump@8": "two blocks of samples running cannot be true: "
    "the ticks step by 1000 … 1001000 µs inside",
    "controller=exception@8": "refused with Modbus exception 4 (device failure)",
    "temperature_1=stale@6": "temperature_1 (spring plate 3) has given no true reading for 5.0 s (limit 5 s",
    "temperature_2=all-zero@2": "all bytes are zero, whose CRC is valid by chance; look for a short circuit",
    "stroke_1=stuck@6": "it stands still, it may have come off or its drum sticks",
    # The wire that snaps back is seen by its speed before the tilt has lasted long enough.
    "stroke_2=broken@6": "stroke (mean of the draw wires on the specimen) changes at -",
    "force=broken@8": "force (transducer of the controller) -204800.00 kN is below the limit of -10.00 kN",
}
GOES_ON = {
    "controller=drop@5:9,share=0.01": "no reply within 0.5 s; connection closed, sent once more",
    "controller=nan@8:9": "register force of the controller holds nan, which is no number; look at its",
    "amplifier=resync@6": "the spacing of its frames was lost (count since the start: 1)",
    "amplifier=overload@6:7": "force_2 reads 8388607 counts (≥ 8388607), an end of its converter",
    "temperature_3=crc@4:6": "the kernel read it with a wrong CRC (“NO”); look at cable length",
}


@pytest.mark.dose(4)
@pytest.mark.parametrize(("fault", "said"), ENDS.items(), ids=ENDS)
def test_a_fault_that_ends_a_run_is_its_reason_and_ends_safe(tmp_path: Path, fault: str, said: str) -> None:
    outcome, opened, _ = run(tmp_path, GENTLE, faults=[parse_fault(fault)])
    assert said in outcome.reason
    assert outcome.exit_status in (3, 4)
    found = open_run(outcome.runs[0])
    assert found.status in ("stopped", "failed")
    assert any(event.kind == "trip" and said in event.text for event in found.events)
    opened.clock.sleep(10.0)  # where only the watchdog could do it
    assert opened.truth.arrays()["force_kN"][-1] == pytest.approx(0.0, abs=0.5)
    assert not opened.device.controller.valve_on


@pytest.mark.dose(2)
@pytest.mark.parametrize(("fault", "said"), GOES_ON.items(), ids=GOES_ON)
def test_a_fault_that_a_run_outlives_is_an_event_of_it(tmp_path: Path, fault: str, said: str) -> None:
    outcome, _, _ = run(tmp_path, GENTLE, faults=[parse_fault(fault)])
    assert (outcome.status, outcome.exit_status) == ("complete", 0), outcome.reason
    found = open_run(outcome.runs[0])
    assert any(said in event.text for event in found.events), [event.text for event in found.events]
    assert found.gaps("controller") == []
