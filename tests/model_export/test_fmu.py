"""The FMU as a foreign tool sees it: fmpy validates it and simulates both interfaces."""

from __future__ import annotations

import zipfile
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from bufferstand.foundation.errors import BadInput
from bufferstand.model.export.fmu import export_fmu
from bufferstand.model.export.losses import FMU
from bufferstand.model.export.options import FmuOptions
from bufferstand.model.file import load_model
from bufferstand.model.simulation import simulate
from tests.model_export.cases import springs

OUTPUTS = ["temperature_C", "sensor_temperature_C", "heat_J", "work_J", "band"]


def drive(model, seconds, mean, amplitude, frequency, unit_mm, rate):
    """Stroke from 0 to a sine about a mean; time, stroke [mm], and the FMU's inputs in its unit."""
    time = np.arange(round(seconds * 1000) + 1) / 1000.0
    x = mean * -np.expm1(-2.0 * time) + amplitude * -np.expm1(-time) * np.sin(2.0 * np.pi * frequency * time)
    speed = np.append(np.diff(x) / 0.001, 0.0) if rate == "forward" else np.gradient(x, 0.001, edge_order=2)
    length = "m" if unit_mm == 1000.0 else "mm"
    names = ("time", f"stroke_{length}", f"stroke_rate_{length}_per_s")
    columns = (time, x / unit_mm, speed / unit_mm)
    signal = np.zeros(len(time), dtype=[(name, float) for name in names])
    for name, column in zip(names, columns, strict=True):
        signal[name] = column
    return time, x, signal


@pytest.mark.parametrize(("name", "units"), [("spectrum", "SI"), ("buffer", "mm-kN")])
def test_fmpy_finds_no_fault(exported, name, units):
    assert validate_fmu(str(exported(name, units=units)[0])) == []


@pytest.mark.parametrize(
    ("name", "units", "unit"),
    [("buffer", "SI", 1000.0), ("buffer", "mm-kN", 1.0), ("hook", "SI", 1000.0), ("spectrum", "SI", 1000.0)],
)
def test_co_simulation_in_fmpy_at_1_khz(exported, name, units, unit):
    """Must show 5: force within 1e-6 of its range (measured: 2e-14)."""
    model = springs()[name]
    end = model.curves.end_mm
    time, x, signal = drive(model, 5.0, 0.45 * end, 0.4 * end, 0.85, unit, "forward")
    whole = simulate(model, time, x, temperature_C=27.0, ambient_C=18.0)
    force = "force_N" if units == "SI" else "force_kN"
    result = simulate_fmu(
        str(exported(name, units=units)[0]),
        fmi_type="CoSimulation",
        stop_time=5.0,
        step_size=0.001,
        output_interval=0.001,
        input=signal,
        output=[force, *OUTPUTS],
        start_values={"initial_temperature_C": 27.0, "ambient_C": 18.0},
    )
    assert result["time"] == pytest.approx(time, abs=1e-9)
    assert np.abs(result[force] / unit - whole.force_kN).max() < 1e-10 * np.ptp(whole.force_kN)
    for name_, expected in (
        ("temperature_C", whole.temperature_C),
        ("sensor_temperature_C", whole.sensor_temperature_C),
        ("heat_J", whole.heat_J),
        ("work_J", whole.work_J),
        ("band", whole.band),
    ):
        assert np.abs(result[name_] - expected).max() < 1e-9 * max(np.ptp(expected), 1.0), name_


def test_without_the_rate_the_force_is_one_step_late(exported):
    """As the FMU says of itself."""
    model = springs()["buffer"]
    time, x, signal = drive(model, 2.0, 45.0, 40.0, 0.85, 1000.0, "forward")
    whole = simulate(model, time, x, temperature_C=25.0)
    late = simulate_fmu(
        str(exported()[0]),
        fmi_type="CoSimulation",
        stop_time=2.0,
        step_size=0.001,
        output_interval=0.001,
        input=signal[["time", "stroke_m"]],
        output=["force_N"],
    )["force_N"]
    assert np.abs(late / 1000.0 - whole.force_kN).max() > 0.1
    assert np.abs(late[2:] / 1000.0 - whole.force_kN[1:-1]).max() < 0.01


@pytest.mark.parametrize(
    ("name", "solver", "tolerance", "bound"),
    [
        ("buffer", "CVode", 1e-5, 1e-3),
        ("buffer", "CVode", 1e-8, 3e-5),
        ("buffer", "Euler", None, 3e-5),
        ("hook", "CVode", 1e-5, 1e-6),
        pytest.param("spectrum", "CVode", 1e-8, 1e-4, marks=pytest.mark.long),
    ],
)
def test_model_exchange_in_fmpy(exported, name, solver, tolerance, bound):
    """Share of the force's range. Only the inner stroke depends on the solver (the hook has none)."""
    model = springs()[name]
    end = model.curves.end_mm
    time, x, signal = drive(model, 2.5, 0.45 * end, 0.4 * end, 0.85, 1000.0, "central")
    whole = simulate(model, time, x, temperature_C=25.0)
    result = simulate_fmu(
        str(exported(name)[0]),
        fmi_type="ModelExchange",
        solver=solver,
        step_size=0.001,
        relative_tolerance=tolerance,
        stop_time=2.5,
        output_interval=0.001,
        input=signal,
        output=["force_N", *OUTPUTS],
    )
    at = np.round(result["time"] * 1000.0).astype(int)
    kept = np.abs(result["time"] - at / 1000.0) < 1e-9  # without the events between
    assert kept.sum() > 2490
    result, at = result[kept], at[kept]
    assert np.abs(result["force_N"] / 1000.0 - whole.force_kN[at]).max() < bound * np.ptp(whole.force_kN)
    assert np.abs(result["band"] - whole.band[at]).max() < 1e-9
    assert np.abs(result["temperature_C"] - whole.temperature_C[at]).max() < 1e-3
    assert np.abs(result["heat_J"] - whole.heat_J[at]).max() < 3e-4 * whole.heat_J[-1]


@pytest.mark.parametrize(
    ("name", "positive", "inverted"),
    [
        ("buffer", "loading", "false"),
        ("buffer", "tension", "true"),
        ("buffer", "compression", "false"),
        ("hook", "loading", "false"),
        ("hook", "tension", "false"),
        ("hook", "compression", "true"),
    ],
)
def test_the_sign_is_chosen_at_the_export(exported, name, positive, inverted):
    root = ET.parse(exported(name, positive=positive)[1] / "modelDescription.xml").getroot()
    switch = next(v for v in root.iter("ScalarVariable") if v.attrib["name"] == "sign_inverted")
    assert switch.find("Boolean").attrib["start"] == inverted


def test_the_same_model_gives_the_same_bytes_and_another_one_another_guid(tmp_path, exported):
    first, content = exported()
    export_fmu(springs()["buffer"], tmp_path / "again.fmu")
    assert (tmp_path / "again.fmu").read_bytes() == first.read_bytes()
    guids = {
        ET.parse(folder / "modelDescription.xml").getroot().attrib["guid"]
        for folder in (content, exported("hook")[1], exported(units="mm-kN")[1], exported(ambient_C=5.0)[1])
    }
    assert len(guids) == 4


def test_what_is_inside(exported):
    fmu, content = exported()
    with zipfile.ZipFile(fmu) as archive:
        names = archive.namelist()
    assert names == sorted(names)
    assert {
        "modelDescription.xml",
        "binaries/linux64/bufferstand_spring.so",
        "binaries/win64/bufferstand_spring.dll",
        "sources/bufferstand_spring_fmu.c",
        "resources/spring.bin",
        "documentation/index.html",
    } < set(names)
    assert load_model(content / "documentation" / "model.toml") == springs()["buffer"]
    page = (content / "documentation" / "index.html").read_text(encoding="utf-8")
    described = ET.parse(content / "modelDescription.xml").getroot().attrib["description"]
    for sentence in FMU:
        assert sentence in described
        assert sentence.replace("'", "&#x27;") in page
    assert fmu.stat().st_size < 400_000


def test_what_cannot_be_written_or_chosen_is_refused(tmp_path):
    with pytest.raises(BadInput, match="cannot be written"):
        export_fmu(springs()["buffer"], tmp_path / "missing" / "a.fmu")
    (tmp_path / "taken.fmu").mkdir()
    with pytest.raises(BadInput, match="cannot be written"):
        export_fmu(springs()["buffer"], tmp_path / "taken.fmu")
    assert [p.name for p in tmp_path.iterdir()] == ["taken.fmu"]
    with pytest.raises(BadInput, match="ambient_C"):
        FmuOptions(ambient_C=float("nan"))
