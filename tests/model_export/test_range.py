"""Where a model was identified, in everything that is exported of it."""

from __future__ import annotations

import ctypes
import json
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from bufferstand.foundation import BadInput
from bufferstand.model.export import FmuOptions, export_c, export_fmu, export_tables
from bufferstand.model.identified_range import IdentifiedRange
from tests.model_export.cases import springs, unpack
from tests.model_export.host import CO_SIMULATION, ERROR, MODEL_EXCHANGE, EventInfo, Host

RANGE = IdentifiedRange((0.0, 98.4), (5.0, 85.0), (0.024, 1.3), "own-shape", (775.0, 790.0))
WITHIN = np.linspace(0.0, 98.0, 2000)


def known():
    return replace(springs()["buffer"], identified=RANGE)


@pytest.fixture
def unpacked(tmp_path):
    def give(units="mm-kN", model=None):
        export_fmu(model or known(), tmp_path / "spring.fmu", FmuOptions(units))
        assert validate_fmu(str(tmp_path / "spring.fmu")) == []
        return unpack(tmp_path / "spring.fmu", tmp_path / "content")

    return give


@pytest.mark.parametrize(
    ("units", "expected"),
    [
        (
            "SI",
            {
                "identified_stroke_max_m": 0.0984,
                "identified_rate_max_m_per_s": 0.085,
                "identified_frequency_max_Hz": 1.3,
                "identified_temperature_min_C": 15.0,
                "curves_end_m": 0.105,
                "loading_at_end_max_N": 790e3,
            },
        ),
        (
            "mm-kN",
            {
                "identified_stroke_max_mm": 98.4,
                "identified_rate_min_mm_per_s": 5.0,
                "identified_frequency_min_Hz": 0.024,
                "identified_temperature_max_C": 75.0,
                "curves_end_mm": 105.0,
                "loading_at_end_min_kN": 775.0,
            },
        ),
    ],
)
def test_an_fmu_has_it_as_constants_in_its_own_units(unpacked, units, expected):
    folder = unpacked(units)
    root = ET.parse(folder / "modelDescription.xml").getroot()
    constants = {v.get("name"): v for v in root.iter("ScalarVariable") if v.get("variability") == "constant"}
    host = Host(folder, CO_SIMULATION).start()
    for name, value in expected.items():
        assert float(constants[name].find("Real").get("start")) == pytest.approx(value)
        assert host.get(name) == pytest.approx(value)
    assert len(constants) == 11
    host.close()


def test_a_constant_cannot_be_set(unpacked):
    host = Host(unpacked(), CO_SIMULATION)
    assert host.set_status("identified_stroke_max_mm", 200.0) == ERROR
    host.close()


def test_what_nobody_states_is_no_variable(unpacked):
    bare = unpacked(model=springs()["bare"])
    assert "identified" not in (bare / "modelDescription.xml").read_text(encoding="utf-8")
    assert "identified" not in (bare / "documentation" / "index.html").read_text(encoding="utf-8")


def test_the_page_says_what_stands_beyond(unpacked):
    page = (unpacked() / "documentation" / "index.html").read_text(encoding="utf-8")
    assert "from 98.4 to 105 mm the curves are continued by their own shape, not measured" in page
    assert "775 … 790 kN" in page


class TestTold:
    """By the logger, once of each."""

    def test_nothing_within_the_range(self, unpacked):
        host = Host(unpacked(), CO_SIMULATION).start()
        host.run(WITHIN, 0.01)
        host.run(WITHIN[::-1], 0.01)
        assert host.messages == []
        host.close()

    def test_stroke_speed_and_stop_once_each(self, unpacked):
        host = Host(unpacked(), CO_SIMULATION).start()
        for _ in range(2):
            host.run(np.linspace(0.0, 106.0, 200), 0.1)
            host.run(np.linspace(106.0, 0.0, 200), 0.001)
        assert [m.split(" mm")[0] for m in host.messages] == [
            "the stroke of 98.5",
            "the stroke of 105.5",
            "the speed of 533",
        ]
        assert "continued there, not measured" in host.messages[0]
        assert "the end of the curves at 105 mm into the stop of 500 kN/mm" in host.messages[1]
        host.close()

    def test_a_spring_that_is_not_touched_has_no_speed(self, unpacked):
        host = Host(unpacked(), CO_SIMULATION).start()
        host.run(np.linspace(0.0, -500.0, 100), 0.001)
        assert host.messages == []
        host.close()

    def test_a_spring_of_unknown_range_tells_nothing_of_it(self, unpacked):
        host = Host(unpacked(model=springs()["bare"]), CO_SIMULATION).start()
        host.run(np.linspace(0.0, 120.0, 100), 0.001)
        assert host.messages == []
        host.close()

    def test_in_model_exchange_at_completed_steps_and_a_jump_is_no_speed(self, unpacked):
        host = Host(unpacked(), MODEL_EXCHANGE).start("stroke_mm", 0.0)
        event, end = ctypes.c_int(), ctypes.c_int()
        host.set("stroke_mm", 90.0)
        host.call("fmi2NewDiscreteStates", ctypes.byref(EventInfo()))
        assert host.messages == []
        host.call("fmi2EnterContinuousTimeMode")
        host.call("fmi2SetTime", ctypes.c_double(0.1))
        host.set("stroke_mm", 99.0)
        assert host.messages == []
        host.call("fmi2CompletedIntegratorStep", 1, ctypes.byref(event), ctypes.byref(end))
        assert [m.split(" mm")[0] for m in host.messages] == ["the stroke of 99.0", "the speed of 90"]
        host.close()


def test_a_header_has_it_as_macros_and_in_words(tmp_path):
    header = export_c(known(), tmp_path, "buffer")[0].read_text(encoding="utf-8")
    assert "#define BUFFER_IDENTIFIED_STROKE_MAX_MM 98.4 " in header
    assert "#define BUFFER_LOADING_AT_END_MAX_KN 790.0 " in header
    assert " * Range: beyond 105 mm stands a stop of 500 kN/mm (assumed, not measured)" in header
    assert "IDENTIFIED" not in export_c(springs()["bare"], tmp_path, "bare")[0].read_text(encoding="utf-8")


def test_tables_have_it_in_their_head_and_as_json(tmp_path):
    table, content, fancher = (p.read_text(encoding="utf-8") for p in export_tables(known(), tmp_path, "b"))
    for text in (table, fancher):
        assert "# Range: from 98.4 to 105 mm the curves are continued by their own shape" in text
    found = json.loads(content)["identified"]
    assert found["stroke_mm"] == [0.0, 98.4]
    assert found["valid_C"] == [15.0, 75.0]
    assert (found["continuation"], found["stop"], found["curves_end_mm"]) == ("own-shape", "assumed", 105.0)
    export_tables(springs()["bare"], tmp_path, "bare")
    assert json.loads((tmp_path / "bare-tables.json").read_text(encoding="utf-8"))["identified"] is None


def test_curves_that_end_before_the_range_are_refused():
    with pytest.raises(BadInput, match="before the identified 110 mm"):
        replace(known(), identified=replace(RANGE, stroke_mm=(0.0, 110.0)))
