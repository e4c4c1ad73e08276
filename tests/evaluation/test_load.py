"""From run files to records and facts: delays, units, roles, gaps, runs without samples."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.loading.load import load_run, moving_mass_kg
from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import Anchor, Segment, StreamContent
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file
from bufferstand.recording.runfile.file import write_run
from tests.evaluation.signals import Ellipse, Floats, StaticTest

ELLIPSE = Ellipse()
RATE = 500.0
SKEW_S = 0.0008
STROKE_U = ChannelUncertainty(linearity=0.25, zero=0.05)


def channel(name: str, quantity: str, unit: str, **facts: Any) -> Channel:
    facts.setdefault("calibration", Calibration(coefficients=(0.0, 1e-4)))
    return Channel(name=name, quantity=quantity, unit=unit, **facts)  # type: ignore[arg-type]


FORCE = channel(
    "force", "force", "kN", delay_s=SKEW_S,
    uncertainty=ChannelUncertainty(accuracy_percent=0.5, reversibility_percent=0.5, zero=0.3, u_delay_s=2e-5),
)  # fmt: skip
WIRES = [channel(name, "stroke", "mm", uncertainty=STROKE_U) for name in ("stroke_1", "stroke_2")]


def write(
    path: Path, *, kept: Floats | None = None, channels: list[Channel] | None = None, rows: bool = True
) -> Path:
    """Write a harmonic run of the stand: the force channel is late by its delay, as filters make it."""
    time, stroke, _ = ELLIPSE.columns(2.0, RATE, 6.5)
    late = ELLIPSE.columns(2.0, RATE, 6.5, phase=1.0 - 2.0 * np.pi * 2.0 * SKEW_S)[2]
    kept = np.arange(time.size) if kept is None else kept
    segments = [Segment(0, 0, 0)]
    for row in np.flatnonzero(np.diff(kept) > 1):
        segments.append(Segment(int(row) + 1, int(kept[row + 1]), int(kept[row + 1] - kept[row] - 1)))  # noqa: PERF401
    counts = {
        "force": np.round(late[kept] * 1e4).astype(np.int32),
        "stroke_1": np.round((stroke[kept] + 1.0) * 1e4).astype(np.int32),
        "stroke_2": np.round((stroke[kept] - 1.0) * 1e4).astype(np.int32),
    }
    used = [FORCE, *WIRES] if channels is None else channels
    sensors = {
        name: [channel(name, "temperature", "°C", calibration=Calibration(), place="plate")]
        for name in ("temperature_1", "temperature_2")
    }
    heads = {"controller": ("device", used), **{name: ("host", own) for name, own in sensors.items()}}
    metadata = {
        "format": "bufferstand/run",
        "format_version": 1,
        "run": {
            "id": path.stem, "kind": "harmonic", "status": "complete", "campaign": "c", "step_index": 1,
            "started_utc": "2026-03-01T08:00:00+00:00", "operator": "o",
        },
        "software": {"name": "bufferstand", "version": "0"},
        "specimen": {"id": "B-17", "kind": "buffer"},
        "stand": {
            "temperature": {
                "sensor": [
                    {"name": "temperature_1", "role": "specimen"},
                    {"name": "temperature_2", "role": "ambient"},
                ]
            }
        },
        "step": {"name": "sine"},
        "streams": {
            name: {
                "clock": clock, "rate_Hz": 1.0, "device": "d",
                "channels": [c.model_dump(mode="json") for c in own],
            }
            for name, (clock, own) in heads.items()
        },
    }  # fmt: skip
    stamps = (np.round(time[kept] * 1e6) + 7e9).astype(np.int64)
    slow = 100_000_000 + 1_000_000 * np.arange(5, dtype=np.int64)
    content: Mapping[str, StreamContent] = {
        "controller": StreamContent(stamps, {c.name: counts[c.name] for c in used}, tuple(segments)),
        "temperature_1": StreamContent(slow, {"temperature_1": 22.0 + 0.5 * np.arange(5)}),
        "temperature_2": StreamContent(slow, {"temperature_2": np.full(5, 50.0)}),
    }
    anchors = [
        Anchor(7_000_000_000 + 1_000_000 * k, 100.0 + k, f"2026-03-01T08:00:0{k}+00:00") for k in range(4)
    ]
    return write_run(path, metadata, content if rows else {}, (), anchors)


def test_record_and_facts(tmp_path: Path) -> None:
    record, facts = load_run(write(tmp_path / "r1.h5"))
    assert record.breaks == ()
    assert record.defects == ()
    # The mean of both wires, and the force at the stroke's own instants: the delay is undone.
    time, stroke, force = ELLIPSE.columns(2.0, RATE, 6.5)
    np.testing.assert_allclose(record.time_s, time, atol=1e-9)
    np.testing.assert_allclose(record.stroke_mm, stroke, atol=1e-4)
    np.testing.assert_allclose(record.force_kN, force, atol=2e-3)
    assert (facts.id, facts.kind, facts.status) == ("r1", "harmonic", "complete")
    assert facts.sha256 is not None
    assert facts.specimen["id"] == "B-17"
    assert facts.started is not None
    assert facts.force_uncertainty == FORCE.uncertainty
    assert facts.stroke_uncertainty == (STROKE_U, STROKE_U)
    assert [(s.name, s.role) for s in record.temperatures] == [
        ("temperature_1", "specimen"),
        ("temperature_2", "ambient"),
    ]


def test_moving_mass_of_the_stand() -> None:
    assert moving_mass_kg({"stand": {"stand": {"id": "s", "moving_mass_kg": 150}}}) == 150.0
    assert moving_mass_kg({"stand": {"stand": {"id": "s", "moving_mass_kg": None}}}) is None
    assert moving_mass_kg({}) is None


def test_delay_matters_and_is_undone(tmp_path: Path) -> None:
    """0.8 ms at 2 Hz would change the loss factor by ω τ = 0.01 of 0.15."""
    document = evaluate_paths([write(tmp_path / "r1.h5")], Options(draws=100))
    (run,) = document["runs"]
    assert run["summary"]["loss_factor"]["value"] == pytest.approx(0.15, rel=1e-3)
    assert run["summary"]["damping"]["value"] == pytest.approx(ELLIPSE.absorbed / ELLIPSE.stored, rel=1e-3)
    assert run["summary"]["damping"]["expanded_uncertainty"] > 0.0
    late = FORCE.model_copy(update={"delay_s": 0.0})
    wrong = evaluate_paths([write(tmp_path / "r2.h5", channels=[late, *WIRES])], Options(draws=100))["runs"][
        0
    ]
    assert wrong["summary"]["loss_factor"]["value"] == pytest.approx(0.15 - 4.0 * np.pi * SKEW_S, rel=0.02)


def test_temperature_is_the_specimens(tmp_path: Path) -> None:
    (run,) = evaluate_paths([write(tmp_path / "r1.h5")], Options(draws=100))["runs"]
    first = run["cycles"][1]["temperature_C"]
    assert first["start"] == pytest.approx(22.0 + 0.5 * run["cycles"][1]["start_s"], abs=0.01)


def test_lost_samples_break_the_record(tmp_path: Path) -> None:
    size = ELLIPSE.columns(2.0, RATE, 6.5)[0].size
    kept = np.delete(np.arange(size), slice(700, 720))
    record, _ = load_run(write(tmp_path / "r1.h5", kept=kept))
    assert record.breaks == (700,)
    assert [d.text for d in record.defects] == ["20 samples lost after 1.398 s"]
    (run,) = evaluate_paths([tmp_path / "r1.h5"], Options(draws=100))["runs"]
    assert sum(not c["complete"] for c in run["cycles"]) >= 1
    assert run["summary"]["loss_factor"]["value"] == pytest.approx(0.15, rel=1e-3)


def test_uncertainty_that_nobody_states(tmp_path: Path) -> None:
    silent = [c.model_copy(update={"uncertainty": ChannelUncertainty()}) for c in (FORCE, *WIRES)]
    _, facts = load_run(write(tmp_path / "r1.h5", channels=silent))
    assert facts.force_uncertainty is None
    assert facts.stroke_uncertainty == ()


def test_run_without_samples(tmp_path: Path) -> None:
    (run,) = evaluate_paths([write(tmp_path / "r1.h5", rows=False)], Options(draws=100))["runs"]
    assert run["cycles"] == []
    assert any("nothing to evaluate" in w for w in run["warnings"])


def test_run_without_force_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "r1.h5", channels=WIRES)
    with pytest.raises(BadInput, match=r"r1.h5: .*no samples of the channel “force”"):
        load_run(path)


@pytest.mark.slow
def test_what_is_no_run_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.h5").write_text("no")
    with pytest.raises(BadInput, match=r"x\.h5"):
        load_run(tmp_path / "x.h5")


@pytest.mark.slow
def test_imported_static_test(tmp_path: Path) -> None:
    """The whole way of a foreign record: import, cycles, requirements that it can and cannot show."""
    time, stroke, force = StaticTest(rate_Hz=50.0).columns()
    table = np.column_stack((time, stroke, force, np.full(time.size, 20.0)))
    source = tmp_path / "static.csv"
    np.savetxt(
        source, table, delimiter=",", fmt="%.6f", comments="",
        header="time [s],stroke [mm],force [kN],temperature [°C]", encoding="utf-8",
    )  # fmt: skip
    (tmp_path / "static.toml").write_text(
        '[specimen]\nid = "B"\nmax_stroke_mm = 105.0\nelastic_system = "elastomer"\n'
        'assembled = 2026-01-01T00:00:00Z\n[test]\nkind = "static"\nstarted = 2026-02-01T00:00:00Z\n',
        encoding="utf-8",
    )
    imported = import_file(source, tmp_path / "out", ImportOptions())
    (run,) = evaluate_paths([imported.path], Options(draws=100))["runs"]
    assert run["run"]["kind"] == "static"
    assert [c["complete"] for c in run["cycles"]] == [True] * 3
    assert run["verdict"] == "pass"
    assert all(row["expanded_uncertainty"] is None for row in run["requirements"] if row["unit"] == "kN")
    assert any("no expanded uncertainties" in w for w in run["warnings"])


SAMPLES = 400
NOTHING = np.full(SAMPLES, np.nan)


def csv_of(path: Path, **columns: Floats) -> Path:
    """Import a record of the ellipse with columns replaced; returns the run file."""
    time, stroke, force = (column[:SAMPLES] for column in ELLIPSE.columns(2.0, 100.0, 8.5))
    given = {"time [s]": time, "stroke [mm]": stroke, "force [kN]": force}
    given |= {name.replace("__", " [") + "]": values for name, values in columns.items()}
    lines = [",".join(given), *(",".join("" if np.isnan(v) else repr(float(v)) for v in row)
             for row in zip(*given.values(), strict=True))]  # fmt: skip
    path.write_text("\n".join(lines))
    return import_file(path, path.parent, ImportOptions(kind="harmonic")).path


@pytest.mark.slow
def test_an_empty_wire_is_a_wire_that_was_not_there(tmp_path: Path) -> None:
    """The other one alone is the stroke: the same figures as of a record without the column, and said."""
    both, one = csv_of(tmp_path / "both.csv", stroke_2__mm=NOTHING), csv_of(tmp_path / "one.csv")
    record, facts = load_run(both)
    alone, _ = load_run(one)
    np.testing.assert_array_equal(record.stroke_mm, alone.stroke_mm)
    assert record.wire_difference_mm is None
    assert "stroke_2: none of its 400 samples is a number; stroke_1 alone is the stroke" in facts.problems


@pytest.mark.slow
def test_a_column_without_a_number_is_named_with_its_count_and_remedy(tmp_path: Path) -> None:
    single = NOTHING.copy()
    single[7] = 1.0
    for name, column, count in (("force__kN", NOTHING, "none"), ("stroke__mm", single, "only 1")):
        run = csv_of(tmp_path / f"{count[:4]}.csv", **{name: column})
        with pytest.raises(BadInput, match=f"{count} of its 400 samples is a number") as caught:
            load_run(run)
        assert caught.value.file == str(run)
        assert caught.value.place == ("channel force" if name == "force__kN" else "channel stroke_1")
        assert "--column" in caught.value.remedy


@pytest.mark.slow
def test_time_that_runs_backwards_is_said_to(tmp_path: Path) -> None:
    run = csv_of(tmp_path / "back.csv", time__s=np.linspace(4.0, 0.0, SAMPLES))
    with pytest.raises(BadInput, match="399 of its 400 time stamps do not advance") as caught:
        load_run(run)
    assert caught.value.place == "time"
