"""The public Python API: its page runs as it stands, its tables agree with the run files."""

from __future__ import annotations

import doctest
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bufferstand.evaluation.document import python_api as api
from bufferstand.foundation import how_to_add
from bufferstand.recording.content import Segment, StreamContent
from bufferstand.recording.runfile.file import write_run
from tests.recording import samples

ROOT = Path(__file__).resolve().parents[2]
RUNS = ROOT / "sample_runs" / "runs"
RUN = RUNS / "004-harmonic-20mm-20mm-0.637Hz.h5"
PAGE = ROOT / "docs" / "python-api.md"


@pytest.mark.slow
def test_the_page_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "sample_runs", tmp_path / "sample_runs")
    monkeypatch.chdir(tmp_path)
    text = "\n".join(re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL))
    test = doctest.DocTestParser().get_doctest(text, {}, PAGE.name, str(PAGE), 0)
    assert len(test.examples) > 20
    with pd.option_context("display.width", 200):
        result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(
            test, out=sys.stdout.write
        )
    assert result.failed == 0


def test_channels_are_the_series_of_the_run() -> None:
    run = api.open_run(RUN)
    frame = api.channels(RUN)
    force = run.series("force")
    assert np.array_equal(frame["force_kN"].to_numpy(), force.value)
    delay_s = frame.attrs["delay_s"]["force_kN"]
    assert frame.index.to_numpy() - delay_s == pytest.approx(force.time_s, abs=1e-12)
    assert frame.attrs["sha256"] == run.sha256
    amplifier = api.channels(run, "amplifier")
    assert list(amplifier.columns) == ["force_2_kN", "segment"]
    with pytest.raises(api.BadInput, match="no stream “x”; it has amplifier, controller"):
        api.channels(run, "x")


def test_segments_count_the_interruptions(tmp_path: Path) -> None:
    content = samples.content()
    cut = content["controller"]
    content["controller"] = StreamContent(cut.time, cut.counts, (Segment(0, 0, 0), Segment(40, 50, 10)))
    path = write_run(tmp_path / "run.h5", samples.metadata("run", status="complete"), content)
    assert api.channels(path)["segment"].value_counts().to_dict() == {0: 40, 1: 60}


@pytest.mark.slow
def test_a_dataset_holds_every_stream_and_can_be_written(tmp_path: Path) -> None:
    run = api.open_run(RUN)
    data = api.dataset(run)
    for stream in run.streams.values():
        for name in stream.channels:
            series = run.series(name)
            variable = data[name]
            assert np.array_equal(variable.to_numpy(), series.value)
            assert variable.attrs["units"] == series.unit
            (dimension,) = variable.dims
            stamps = data[dimension].to_numpy() - variable.attrs["delay_s"]
            assert stamps == pytest.approx(series.time_s, abs=1e-12)
    assert next(iter(data.coords)) == "time_s"
    assert all(isinstance(value, str | float | int) for value in data.attrs.values())


def test_a_missing_xarray_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(api.BadInput) as caught:
        api.dataset(RUN)
    assert str(caught.value).endswith(f"xarray, which is not installed; install it: {how_to_add('xarray')}")


def test_runs_that_cannot_be_read_are_listed_with_their_problem(tmp_path: Path) -> None:
    shutil.copy(RUN, tmp_path / "good.h5")
    (tmp_path / "bad.h5").write_bytes(b"nothing")
    table = api.runs([tmp_path])
    assert table.set_index("id").loc[RUN.stem, "frequency_Hz"] == pytest.approx(0.6366, abs=1e-4)
    assert "no HDF5 file" in table.set_index("path").loc[str(tmp_path / "bad.h5"), "problem"]
    with pytest.raises(api.BadInput, match="no such file"):
        api.runs(tmp_path / "none")


def test_loops_hold_the_cycles_of_the_evaluation() -> None:
    table = api.loops(RUN)
    document = api.evaluate(RUN, draws=100)
    (entry,) = document["runs"]
    for cycle in entry["cycles"]:
        loop = table[table["cycle"] == cycle["index"]]
        assert loop["time_s"].min() >= cycle["start_s"]
        assert loop["time_s"].max() < cycle["end_s"]
        assert loop["complete"].all() == cycle["complete"]
        assert loop["steady"].all() == cycle["steady"]
    assert table["cycle"].max() == len(entry["cycles"])
    assert table["stroke_mm"].to_numpy().max() == pytest.approx(39.27, abs=0.1)


def test_requirements_carry_their_run() -> None:
    table = api.requirements(api.evaluate(RUNS / "001-static-5mm_s.h5", draws=100))
    assert set(table["run"]) == {"001-static-5mm_s"}
    assert {"id", "verdict", "lower_limit", "measured", "unit"} <= set(table.columns)
