"""The twin beside a campaign: from packets as they are told to alarms, to the folder, and to the page."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bufferstand.daq.monitor.campaign_view import TWIN_NAME, FolderWatch
from bufferstand.daq.operator import StopRequest
from bufferstand.daq.operator.control_socket import ask, listening
from bufferstand.daq.twin.beside import demand_known
from bufferstand.daq.twin.live_twin import LiveTwin
from bufferstand.foundation.errors import BadInput
from bufferstand.model.file import save_model
from bufferstand.model.simulation import simulate
from tests.model.cases import spring
from tests.model.twin.specimens import AIR_C, RATE_Hz, Step, drawn_spring, known_model, strokes

STEP = Step(45.0, 20.0, 0.8, 12)
GUARDS = {
    "temperatures": [
        {"stream": "plate", "resume_C": 30.0, "stop_C": 40.0},
        {"stream": "air", "resume_C": None, "stop_C": None},
    ]
}


def packets(time, stroke, force, number=2):
    """What a campaign would tell of one recorded step, twenty packets a second, and that it is over."""
    first = {
        "channels": [
            {"name": "stroke_1", "quantity": "stroke", "unit": "mm", "delay_s": 0.001},
            {"name": "force", "quantity": "force", "unit": "kN", "delay_s": 0.003},
        ],
        "guards": GUARDS,
        "readings": {"plate": [[0.0, AIR_C]], "air": [[0.0, AIR_C]]},
    }
    size = round(RATE_Hz / 20.0)
    for begin in range(0, time.size, size):
        part = slice(begin, begin + size)
        rows = {
            "t0_us": round(1e6 * time[begin]),
            "t": np.round(1e4 * (time[part] - time[begin])).tolist(),
            "s": np.round(1e3 * stroke[part]).tolist(),
            "f": np.round(1e3 * force[part]).tolist(),
        }
        progress = {"step": number, "phase": "motion"}
        yield {**first, "at_s": time[begin], "rows": rows, "recording": True, "progress": progress}
        first = {}
    yield {"at_s": time[-1], "rows": {}, "recording": False, "progress": {"step": number, "phase": "ramp"}}


def told(twin, step, seed=3, gain=1.0, begin_s=100.0):
    """Tell a step of a specimen whose force is ``gain`` times what it should be; return the alarms."""
    random = np.random.default_rng(seed)
    time, stroke, _ = strokes(step)
    force = gain * simulate(drawn_spring(random), time, stroke, temperature_C=AIR_C).force_kN
    # Each value was true so long before its stamp: stroke by 1 ms, force by 3 ms.
    force = np.interp(time - 0.003, time, force) + random.normal(0.0, 0.3, time.size)
    stroke = np.interp(time - 0.001, time, stroke) + random.normal(0.0, 0.01, time.size)
    alarms = []
    for number, packet in enumerate(packets(begin_s + time, stroke, force)):
        twin.hear(packet)
        if number % 20 == 19:
            alarms += twin.judge()
    return alarms + twin.judge()


def test_cycles_are_judged_as_they_come_each_once():
    twin = LiveTwin(known_model())
    assert told(twin, STEP) == []
    document = twin.document()
    assert document["judged"] == STEP.cycles - 2  # the first and the last have the way there and back
    starts = [one["start_s"] for one in document["cycles"]]
    assert np.diff(starts) == pytest.approx(1.0 / STEP.frequency_Hz, abs=0.05)
    assert max(abs(one["alone"]["delay_s"]) for one in document["cycles"]) < 0.001  # of channels: taken off
    band = document["band"]
    assert np.all(np.array(band["high"]) > np.array(band["low"]))
    assert document["alarms"] == []
    json.dumps(document, allow_nan=False)


@pytest.mark.slow
def test_a_force_that_reads_too_little_is_said_once_also_in_the_next_step():
    twin = LiveTwin(known_model())
    assert told(twin, STEP) == []
    (alarm,) = told(twin, STEP, gain=0.94, begin_s=9000.0)  # cold again
    assert alarm.moved[0].kind.name == "stiffness"
    assert alarm.moved[0].change == pytest.approx(-0.06, abs=0.015)
    assert "gain of the force channel" in alarm.sentence
    further = told(twin, STEP, gain=0.94, begin_s=18000.0)
    assert all(len(one.moved) < len(alarm.moved) for one in further)
    assert twin.document()["alarms"][0]["sentence"] == alarm.sentence


def test_what_was_found_reaches_the_campaign(tmp_path):
    request = StopRequest()
    with listening(tmp_path, request):
        assert ask(tmp_path, {"finding": "stiffness -5 %", "by": "twin"}) == "taken"
        with pytest.raises(BadInput):
            ask(tmp_path, {"finding": "  ", "by": "twin"})
    assert request.take_findings() == [("twin", "stiffness -5 %")]
    assert request.take_findings() == []
    assert request.take_notes() == []


def test_the_page_is_told_what_the_twin_wrote(tmp_path):
    watch = FolderWatch(tmp_path)
    assert watch.look().twin is None
    (tmp_path / TWIN_NAME).write_text('{"schema": "bufferstand/twin/1", "judged": 3}')
    assert watch.look().twin == {"schema": "bufferstand/twin/1", "judged": 3}
    assert watch.look().twin is None  # nothing new
    (tmp_path / TWIN_NAME).write_text('{"schema": "bufferstand/twin/1", "jud')
    assert watch.look().twin is None


def test_a_model_that_does_not_know_its_uncertainty_is_refused_with_its_file(tmp_path):
    save_model(spring(), tmp_path / "m.toml")
    with pytest.raises(BadInput) as caught:
        demand_known(tmp_path / "m.toml")
    assert str(caught.value).startswith(str(tmp_path / "m.toml"))
    assert "model fit" in str(caught.value)
