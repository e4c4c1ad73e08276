"""The model file: what is written is read again; what is wrong is refused with its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.model.file import load_model, save_model
from bufferstand.model.spring import HeatBalance, TemperatureLaw, ViscousBranch
from tests.model.cases import spring, valid_curves
from tests.model.recipes import FOLDER, category_a

positive = st.floats(1e-6, 1e6)


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    curves=valid_curves(),
    law=st.builds(
        TemperatureLaw, st.floats(-40.0, 80.0), st.floats(0.0, 0.1), positive, st.floats(0.0, 0.1),
        st.floats(0.001, 1.0), st.none() | st.just((-10.5, 60.25)),
    ),
    heat=st.builds(
        HeatBalance, positive, st.floats(0.0, 1e3), st.sampled_from(["loop-exact", "paper"]),
        st.floats(0.0, 100.0), st.floats(0.0, 2.0),
    ),
    viscous=st.builds(ViscousBranch, st.floats(0.0, 1.0), positive),
    origin=st.sampled_from(["", "one line", 'two "lines"\nwith \\ in them\n', "end\n"]),
    sense=st.sampled_from(["compression", "extension"]),
)  # fmt: skip
def test_what_is_written_is_read_again(tmp_path, curves, law, heat, viscous, origin, sense):
    model = replace(
        spring(curves, temperature=law, heat=heat, viscous=viscous), origin=origin, sense=sense, name="Bö 1"
    )
    save_model(model, tmp_path / "model.toml")
    assert load_model(tmp_path / "model.toml") == model


def test_numbers_of_numpy_are_written_as_numbers(tmp_path):
    curves = replace(spring().curves, loading_kN=tuple(np.array(spring().curves.loading_kN)))
    save_model(spring(curves), tmp_path / "model.toml")
    assert load_model(tmp_path / "model.toml").curves == curves


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("beta = 0", "betta = 0", ["line", "viscous.betta", "did you mean “beta”?"]),
        ("capacity_J_per_K = 15000.0\n", "", ["capacity_J_per_K", "missing"]),
        (
            "capacity_J_per_K = 15000.0",
            "capacity_J_per_K = -1.0",
            ["line 54: heat.capacity_J_per_K", "from 1e-06 to"],
        ),
        ("depth_mm = 20.0", "depth_mm = 0.0", ["line 48: temperature.depth_mm", "from 1e-06 to"]),
        ("floor = 0.05", "floor = 1.5", ["line 50: temperature.floor", "from 0 to 1"]),
        ("tau_s = 9.64", "tau_s = 0.0", ["line 62: viscous.tau_s", "from 1e-06 to"]),
        (
            "sensitivity_per_K = 0.01",
            "sensitivity_per_K = -0.01",
            ["line 47: temperature.sensitivity_per_K", "from 0 to 10"],
        ),
        ("valid_C = [15.0, 75.0]", "valid_C = [75.0, 15.0]", ["temperature.valid_C", "must not exceed"]),
        ("valid_C = [15.0, 75.0]", "valid_C = [75.0]", ["temperature.valid_C"]),
        ('rule = "loop-exact"', 'rule = "exact"', ["heat.rule", "loop-exact"]),
        ("format_version = 1", "format_version = 2", ["model.format_version"]),
        ("transition_length_mm = 4.0\n", "", ["transition", "either its length or its stiffness"]),
        ("12.519, ", "16.0, ", ["unloading_kN", "above the loading curve at 0.00 mm"]),
        ("[curves]", "[curves", ["not valid TOML"]),
    ],
)
def test_what_is_wrong_is_refused_with_file_and_place(tmp_path, old, new, says):
    text = (FOLDER / "category-a-elastomer.toml").read_text(encoding="utf-8")
    assert old in text
    bad = tmp_path / "bad.toml"
    bad.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(BadInput) as refusal:
        load_model(bad)
    message = str(refusal.value)
    assert message.startswith(str(bad))
    assert all(part in message for part in says), message


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(BadInput, match="no such file"):
        load_model(tmp_path / "none.toml")
    (tmp_path / "none").write_text("a file stands where the folder should")
    with pytest.raises(BadInput, match="cannot be written"):
        save_model(category_a(), tmp_path / "none" / "model.toml")
