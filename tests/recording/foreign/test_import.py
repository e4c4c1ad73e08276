"""Foreign records: each dialect of docs/import.md gives the same numbers; nothing is guessed in silence."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.foreign.columns import split_header
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file
from bufferstand.recording.foreign.text.record import DelimitedRecord
from bufferstand.recording.foreign.times.stamps import examine
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.runfile.run import Run
from bufferstand.recording.sealing.verification import verify

SHARED = Path(__file__).parents[4] / "shared" / "data"

HEADER = ["time [s]", "stroke [mm]", "force [kN]", "stroke_2 [mm]", "temperature [°C]", "speed [mm/s]"]
ROWS = np.column_stack(
    [
        np.arange(60) * 0.001,
        20.0 + np.arange(60) * 0.125,
        -1.5 + np.arange(60) * 3.25,
        20.5 + np.arange(60) * 0.125,
        np.full(60, 21.75),
        np.full(60, 125.0),
    ]
)


def text_of(
    header: list[str], rows: Any, separator: str = ",", decimal: str = ".", end: str = "\n", quote: str = ""
) -> str:
    cells = [[f"{quote}{str(float(v)).replace('.', decimal)}{quote}" for v in row] for row in rows]
    return end.join([separator.join(header), *(separator.join(row) for row in cells)]) + end


def saved(tmp_path: Path, text: str, encoding: str = "utf-8", name: str = "record.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def imported(path: Path, **options: Any) -> Run:
    return open_run(import_file(path, path.parent / "out", ImportOptions(**options)).path)


def simple(tmp_path: Path, *lines: str, header: str = "time [s],stroke [mm],force [kN]") -> Path:
    return saved(tmp_path, "\n".join([header, *lines]) + "\n")


def refused(path: Path, **options: Any) -> str:
    with pytest.raises(BadInput) as caught:
        import_file(path, path.parent / "out", ImportOptions(**options))
    assert not (path.parent / "out").exists()  # nothing half-done is left
    return caught.value.message()


# --- dialects -----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"])
@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")]
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_every_dialect_reads_to_the_same_numbers(
    tmp_path: Path, encoding: str, separator: str, decimal: str, end: str
) -> None:
    path = saved(tmp_path, text_of(HEADER, ROWS, separator, decimal, end), encoding)
    run = imported(path, kind="harmonic")
    for column, name in enumerate(["stroke_1", "force", "stroke_2", "temperature_1", "speed"], start=1):
        series = run.series(name)
        assert np.array_equal(series.time_s, ROWS[:, 0])
        assert np.array_equal(series.value, ROWS[:, column])
    assert run.series("temperature_1").unit == "°C"
    assert np.array_equal(run.stroke().value, ROWS[:, 1] + 0.25)
    original = run.metadata["original"]
    names = {"utf-8": "UTF-8", "utf-8-sig": "UTF-8 with BOM", "latin-1": "Latin-1"}
    assert original["encoding"] == names.get(encoding, "UTF-16")
    assert original["separator"] == {"\t": "tab"}.get(separator, separator)
    assert original["decimal"] == decimal
    assert original["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert original["file"] == "record.csv"
    assert original["findings"] == []
    assert verify(run.path) == []


@pytest.mark.parametrize("decimal", [".", ","])
def test_quoted_cells(tmp_path: Path, decimal: str) -> None:
    run = imported(saved(tmp_path, text_of(HEADER, ROWS, ";", decimal, quote='"')))
    assert np.array_equal(run.series("force").value, ROWS[:, 2])


def test_spaces_blank_lines_and_remarks_before_the_header(tmp_path: Path) -> None:
    path = saved(
        tmp_path,
        "# made by x\n\n time [s] , stroke [mm] , force [kN] \n 0 , 1.5 , 2 \n\n   \n0.1,2.5 , 3e2\n",
    )
    run = imported(path)
    assert run.series("stroke").value.tolist() == [1.5, 2.5]
    assert run.series("force").value.tolist() == [2.0, 300.0]
    assert run.metadata["original"]["header_line"] == 3


def test_whole_numbers_need_no_decimal_sign(tmp_path: Path) -> None:
    run = imported(simple(tmp_path, "0;1;2", "1;2;3", header="time [s];stroke [mm];force [kN]"))
    assert run.series("force").value.tolist() == [2.0, 3.0]


@given(st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 2), min_size=1, max_size=20))
def test_numbers_are_kept_to_the_last_bit(pairs: list[tuple[float, float]]) -> None:
    import tempfile

    for separator, decimal in ((",", "."), (";", ",")):
        with tempfile.TemporaryDirectory() as folder:
            text = text_of(["stroke [mm]", "force [kN]"], pairs, separator, decimal)
            numbers = DelimitedRecord(saved(Path(folder), text)).read([0, 1])[0]
        assert numbers.columns[0].tolist() == [stroke for stroke, _ in pairs]
        assert numbers.columns[1].tolist() == [force for _, force in pairs]


# --- columns and units --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "row", "expected"),
    [
        ("Time [ms],STROKE (in),Force (kip)", "1000,1,1", (1.0, 25.4, 4.4482216152605)),
        ("time [min],stroke [m],force [N]", "2,0.01,1500", (120.0, 10.0, 1.5)),
        ("time (s),stroke_1 [mm],force [lbf]", "1,1,1000", (1.0, 1.0, 4.4482216152605)),
    ],
)
def test_units_of_the_header(
    tmp_path: Path, header: str, row: str, expected: tuple[float, float, float]
) -> None:
    run = imported(simple(tmp_path, row, header=header))
    stroke, force = run.series("stroke"), run.series("force")
    found = (stroke.time_s[0], stroke.value[0], force.value[0])
    assert found == pytest.approx(expected, rel=1e-14)
    assert (stroke.unit, force.unit) == ("mm", "kN")


@pytest.mark.parametrize(
    ("unit", "number", "celsius"),
    [("°C", 20, 20), ("C", 20, 20), ("K", 293.15, 20), ("°F", 68, 20), ("ºC", 20, 20), ("℃", 20, 20)],
)
def test_temperatures(tmp_path: Path, unit: str, number: float, celsius: float) -> None:
    header = f"time [s],stroke [mm],force [kN],temperature_2 [{unit}]"
    run = imported(simple(tmp_path, f"0,1,2,{number}", header=header))
    assert run.series("temperature_2").value[0] == pytest.approx(celsius, abs=1e-9)


def test_raw_numbers_and_unit_stay_what_they_were(tmp_path: Path) -> None:
    run = imported(simple(tmp_path, "0,1.5,-2", header="time [s],stroke [in],force [N]"), invert=["force"])
    record = run.streams["record"]
    assert record.counts["stroke_1"].tolist() == [1.5]
    assert record.counts["force"].tolist() == [-2.0]
    assert record.channels["force"].calibration.coefficients == (0.0, -0.001)
    assert run.series("force").value.tolist() == [0.002]
    assert run.metadata["datasets"]["entry/record/stroke_1"]["units"] == "in"
    assert run.metadata["original"]["columns"]["force"]["inverted"] is True


def test_columns_and_units_by_option(tmp_path: Path) -> None:
    path = simple(
        tmp_path, "0,7,1,2,3", header="T,stroke [in],Weg links,Weg rechts (mm),Kraft (ungefiltert) [kN]"
    )
    run = imported(
        path,
        column={
            "time": "T",
            "stroke": "weg links",
            "stroke_2": "Weg rechts",
            "force": "Kraft (ungefiltert) [kN]",
        },
        unit={"time": "ms", "stroke": "mm"},
    )
    assert run.series("stroke_1").value.tolist() == [1.0]
    assert run.series("stroke_2").value.tolist() == [2.0]
    assert run.series("force").value.tolist() == [3.0]
    original = run.metadata["original"]
    assert original["ignored"] == ["stroke [in]"]
    assert original["columns"]["time"] == {
        "header": "T", "position": 1, "unit": "ms", "unit_from": "option", "inverted": False
    }  # fmt: skip


def test_a_record_without_time(tmp_path: Path) -> None:
    path = simple(tmp_path, "1,2", "3,4", "5,6", header="stroke [mm],force [kN]")
    run = imported(path, sample_rate_hz=200.0)
    assert run.series("force").time_s.tolist() == [0.0, 0.005, 0.01]
    assert run.streams["record"].rate_Hz == 200.0
    assert run.gaps("record") == []


def test_headers() -> None:
    assert split_header("stroke [mm]") == ("stroke", "mm")
    assert split_header("Force (ch 1) [kN]") == ("Force (ch 1)", "kN")
    assert split_header("force") == ("force", None)
    assert split_header("force []") == ("force", None)
    assert split_header("speed(mm/s) ") == ("speed", "mm/s")


# --- specimen and kind --------------------------------------------------------------------------------

SPECIMEN = """
[specimen]
id = "B-9"
category = "A"
max_stroke_mm = 105.0
assembled = 2026-01-02T03:04:05Z
[test]
kind = "static"
started = "2026-02-03T04:05:06+00:00"
operator = "K. Test"
"""


def test_specimen_file_beside_the_record(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,1,2")
    path.with_suffix(".toml").write_text(SPECIMEN)
    result = import_file(path, tmp_path / "out")
    run = open_run(result.path)
    assert (run.kind, run.status, run.specimen["id"]) == ("static", "imported", "B-9")
    assert run.specimen["assembled"] == "2026-01-02T03:04:05Z"
    assert run.metadata["run"]["kind_source"] == "specimen file"
    assert run.metadata["run"]["started_utc"].startswith("2026-02-03T04:05:06")
    assert run.metadata["run"]["operator"] == "K. Test"
    assert result.warnings == ()


def test_options_go_before_the_specimen_file(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,1,2")
    path.with_suffix(".toml").write_text("not read = at all")
    given_file = tmp_path / "given.toml"
    given_file.write_text(SPECIMEN)
    run = imported(path, kind="impact", specimen=given_file)
    assert run.kind == "impact"
    assert run.metadata["original"]["specimen_file"] == "given.toml"


def test_a_kind_that_nobody_gave_is_said(tmp_path: Path) -> None:
    result = import_file(simple(tmp_path, "0,1,2"), tmp_path / "out")
    run = open_run(result.path)
    assert run.kind == "harmonic"
    assert run.metadata["run"]["kind_source"] == "default"
    assert "kind of run not given" in result.warnings[0]


# --- what is kept and reported ------------------------------------------------------------------------


def warned(path: Path, **options: Any) -> tuple[Run, list[str]]:
    result = import_file(path, path.parent / "out", ImportOptions(kind="harmonic", **options))
    run = open_run(result.path)
    assert run.metadata["original"]["findings"] == list(result.warnings)
    return run, list(result.warnings)


def test_empty_and_nan_cells_are_kept(tmp_path: Path) -> None:
    run, warnings = warned(simple(tmp_path, "0,1,2", "1,,3", "2,3,NaN", "3,4,nan"))
    assert np.array_equal(run.series("stroke").value, [1, np.nan, 3, 4], equal_nan=True)
    assert np.array_equal(run.series("force").value, [2, 3, np.nan, np.nan], equal_nan=True)
    assert warnings == [
        "stroke_1: 1 empty or NaN cell(s), the first in line 3",
        "force: 2 empty or NaN cell(s), the first in line 4",
    ]


def test_an_empty_column_is_said(tmp_path: Path) -> None:
    header = "time [s],stroke [mm],force [kN],speed [mm/s]"
    _, warnings = warned(simple(tmp_path, "0,1,2,", "1,1,3,", header=header))
    assert warnings == ["speed: the column is empty"]


def test_gaps_repeated_and_backward_stamps_are_kept(tmp_path: Path) -> None:
    times = [0, 1, 2, 3, 6, 7, 8, 8, 9, 8.5, 10, 11, 12]
    run, warnings = warned(simple(tmp_path, *(f"{time},{row},2" for row, time in enumerate(times))))
    assert run.series("force").time_s.tolist() == times
    assert [row for row, _ in run.gaps("record")] == [3, 6, 8]
    assert run.gaps("record")[0] == (3, 2)
    assert (
        warnings
        == [
            "1 gap(s), about 2 sample(s) missing, the longest 3 s; the first before line 6",
            "1 repeated time stamp(s), the first in line 9",
            "1 backward time stamp(s), the first in line 11",
        ]
        or "uneven" in warnings[0]
    )


def test_a_missing_time_is_an_interruption(tmp_path: Path) -> None:
    run, warnings = warned(simple(tmp_path, "0,1,2", "1,1,2", ",1,2", "3,1,2", "4,1,2"))
    assert "1 missing time stamp(s), the first in line 4" in warnings
    assert run.gaps("record") == [(1, 0), (2, 0)]


def test_a_file_that_may_be_cut_short_is_said(tmp_path: Path) -> None:
    path = saved(tmp_path, "time [s],stroke [mm],force [kN]\n0,1,2\n1,2,3")
    run, warnings = warned(path)
    assert run.series("force").value.tolist() == [2.0, 3.0]
    assert "the last line is not ended" in warnings[0]


def test_a_record_with_the_other_sign_is_said(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,1,-2", "1,2,-30")
    _, warnings = warned(path)
    assert "force: mostly negative" in warnings[0]
    assert "--invert force" in warnings[0]
    result = import_file(path, tmp_path / "turned", ImportOptions(kind="harmonic", invert=["force"]))
    assert result.warnings == ()


@pytest.mark.parametrize("rate_hz", [333.0, 510.0, 600.0, 700.0, 900.0, 1000.0])
def test_rounded_stamps_are_no_gaps_and_hide_none(rate_hz: float) -> None:
    """A logger that writes whole milliseconds makes uneven stamps, and no gap."""
    time_s = np.round(np.arange(3000) / rate_hz, 3)
    found = examine(time_s, np.arange(3000))
    assert len(found.segments) == 1
    assert found.rate_Hz == pytest.approx(rate_hz, rel=0.01)
    with_gap = np.delete(time_s, slice(1000, 1050))
    found = examine(with_gap, np.arange(2950))
    assert [segment.first_row for segment in found.segments] == [0, 1000]
    assert found.segments[1].lost == pytest.approx(50, abs=1)


def test_irregular_stamps_are_said_and_are_no_gaps() -> None:
    steps = np.random.default_rng(5).uniform(0.5e-3, 2e-3, 5000)
    found = examine(np.cumsum(steps), np.arange(5000))
    assert len(found.segments) == 1
    assert found.findings == (f"uneven time stamps, {steps[1:].mean():.6g} s apart in the mean",)


def test_many_lost_samples_are_gaps_and_no_unevenness() -> None:
    """A bad line that loses every tenth sample or so: each loss is an interruption."""
    keep = np.random.default_rng(6).random(5000) > 0.1
    time_s = np.arange(5000)[keep] * 1e-3
    found = examine(time_s, np.arange(len(time_s)))
    inside = np.flatnonzero(keep)
    assert sum(segment.lost for segment in found.segments) == inside[-1] - inside[0] + 1 - keep.sum()
    assert len(found.segments) == 1 + int((np.diff(inside) > 1).sum())


@given(
    st.floats(0.1, 5000.0),
    st.floats(-1e3, 1e3),
    st.lists(st.tuples(st.integers(10, 100), st.integers(1, 50)), min_size=1, max_size=3),
)
def test_samples_that_are_missing_are_counted(
    rate_hz: float, start_s: float, stretches: list[tuple[int, int]]
) -> None:
    numbers, number = [], 0
    for rows, lost in stretches:
        numbers += range(number, number + rows)
        number += rows + lost
    numbers += range(number, number + 50)
    time_s = start_s + np.array(numbers) / rate_hz
    found = examine(time_s, np.arange(len(time_s)) + 2)
    assert [segment.lost for segment in found.segments[1:]] == [lost for _, lost in stretches]
    assert found.rate_Hz == pytest.approx(rate_hz, rel=1e-6)
    # Each row has the number that it had before any was lost.
    rows_of = np.array([segment.first_row for segment in found.segments])
    assert [numbers[row] for row in rows_of] == [segment.first_sequence for segment in found.segments]


# --- refusals: file, line, column, remedy ----------------------------------------------------------------


def test_a_cell_that_is_no_number(tmp_path: Path) -> None:
    message = refused(simple(tmp_path, "0,1,2", "", "1,2,n/a"))
    assert message.startswith(str(tmp_path / "record.csv"))
    assert "line 4, column 3 “force [kN]”: “n/a” is no number (decimal sign “.”); mend it" in message


@pytest.mark.parametrize("cell", ["1 000", "0x10", "1_0", "True", "--", "1.2.3", "1e", "12abc", "1.234,5"])
def test_cells_that_look_like_numbers(tmp_path: Path, cell: str) -> None:
    path = simple(tmp_path, "0.5;1.5;2.5", f"1.5;2.5;{cell}", header="time [s];stroke [mm];force [kN]")
    message = refused(path)
    assert f"line 3, column 3 “force [kN]”: “{cell}” is no number" in message


def test_mixed_decimal_signs(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,5;1,5;2,5", "1,5;2,5;3.5", header="time [s];stroke [mm];force [kN]")
    assert "line 3, column 3 “force [kN]”: “3.5” is no number (decimal sign “,”)" in refused(path)


def test_infinite_values(tmp_path: Path) -> None:
    assert "line 3, column 2 “stroke [mm]”: an infinite value" in refused(
        simple(tmp_path, "0,1,2", "1,inf,3")
    )


@pytest.mark.parametrize(("line", "cells"), [("1,2", 2), ("1,2,3,4", 4), ("stopped by operator", 1)])
def test_lines_of_another_width(tmp_path: Path, line: str, cells: int) -> None:
    message = refused(simple(tmp_path, "0,1,2", "", line, "2,2,2"))
    assert f"line 4: {cells} cell(s) where the header row has 3" in message


def test_lines_of_another_width_in_a_quoted_file(tmp_path: Path) -> None:
    assert "line 3: 2 cell(s) where the header row has 3" in refused(simple(tmp_path, '"0",1,2', "1,2"))


def test_decimal_comma_between_commas(tmp_path: Path) -> None:
    message = refused(simple(tmp_path, "0,5,1,5,2,5"))
    assert "line 2: 6 cell(s) where the header row has 3" in message


def test_headers_that_say_nothing(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,1,2", header="Time [s],Displacement [in],Friction Force [kip]")
    message = refused(path)
    assert "line 1: no column is named “stroke”; say which it is with --column stroke=HEADER" in message
    assert "“Time [s]”, “Displacement [in]”, “Friction Force [kip]”" in message


@pytest.mark.parametrize(
    ("header", "options", "message"),
    [
        ("time [s],stroke,force [kN]", {}, "line 1, column 2 “stroke”: this column has no unit"),
        (
            "time [s],stroke [ft],force [kN]",
            {},
            "unit “ft” is not understood for stroke; use one of mm, m, in",
        ),
        ("time [s],stroke [mm],force [t]", {}, "unit “t” is not understood for force"),
        ("stroke [mm],x,force [kN]", {}, "no column is named “time”; say --sample-rate HZ"),
        ("time [s],stroke [mm],force [kN]", {"sample_rate_hz": 9.0}, "there is a time column “time [s]”"),
        ("time [s],stroke [mm],Stroke_1 [mm]", {}, "two columns mean “stroke_1”"),
        (
            "time [s],stroke [mm],x",
            {"column": {"force": "y"}},
            "--column force: no header is “y”; the headers",
        ),
        ("time [s],x,x", {"column": {"force": "x"}}, "--column force: 2 headers are “x”"),
        ("time [s],stroke [mm],x", {"column": {"kraft": "x"}}, "“kraft” is no name of a channel; use one of"),
        (
            "time [s],x,force [kN]",
            {"column": {"stroke": "x", "stroke_2": "x"}},
            "one header is given two names",
        ),
        (
            "time [s],stroke [mm],force [kN]",
            {"unit": {"speed": "m/s"}},
            "--unit speed: the record has no such",
        ),
        ("time [s],stroke [mm],force [kN]", {"invert": ["time"]}, "time runs forward only"),
        ("time [s],stroke [mm],force [kN]", {"invert": ["speed"]}, "--invert speed: the record has no such"),
        ("time [s],stroke [mm],force [kN]", {"kind": "sine"}, "--kind sine: no such kind; use one of static"),
        ("0,1,2", {}, "line 1: no header row: this line holds numbers only"),
        ("time stroke force", {}, "line 1: the header row “time stroke force” has only one column"),
    ],
)
def test_columns_that_cannot_be_told(
    tmp_path: Path, header: str, options: dict[str, Any], message: str
) -> None:
    assert message in refused(simple(tmp_path, "0,1,2", "1,2,3", header=header), **options)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan"), float("inf")])
def test_sample_rates_that_are_none(tmp_path: Path, rate_hz: float) -> None:
    path = simple(tmp_path, "1,2", header="stroke [mm],force [kN]")
    assert "must be positive" in refused(path, sample_rate_hz=rate_hz)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"\n\n  \n", "the file is empty"),
        (b"# only a remark\n", "the file has no header row"),
        (b"time [s],stroke [mm],force [kN]\n", "line 1: no numbers below the header row"),
        (b"\x7fELF\x00\x00\x00\x00binary", "this is no text file"),
        ("time [s],stroke [mm],force [kN]\n0,1,2\n".encode("utf-16") + b"\xd8", "no UTF-16"),
    ],
)
def test_files_that_are_no_records(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "record.csv"
    path.write_bytes(content)
    assert message in refused(path)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    assert "none.csv: cannot be read: No such file" in refused(tmp_path / "none.csv")


def test_a_bad_specimen_file_is_named(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,1,2")
    path.with_suffix(".toml").write_text('[specimen]\nid = "x"\ncolour = "red"\n')
    assert "record.toml: line 3: specimen.colour: unknown key" in refused(path)


def test_importing_twice_and_over_another_record(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,1,2")
    first = import_file(path, tmp_path / "out")
    content = first.path.read_bytes()
    again = import_file(path, tmp_path / "out")
    assert again.path == first.path
    assert "imported before" in again.warnings[-1]
    with pytest.raises(BadInput, match=r"record\.h5: a run file of this name is there already"):
        import_file(path, tmp_path / "out", ImportOptions(invert=["force"]))
    path.write_text(path.read_text() + "1,2,3\n")
    with pytest.raises(BadInput, match="another record or other options"):
        import_file(path, tmp_path / "out")
    assert first.path.read_bytes() == content


def test_names_of_files_become_names_of_runs(tmp_path: Path) -> None:
    path = simple(tmp_path, "0,1,2").rename(tmp_path / "Prüfung 7 (neu).CSV")
    assert import_file(path, tmp_path / "out").path.name == "Pr_fung_7_neu.h5"


# --- records that nobody here made --------------------------------------------------------------------


@pytest.mark.parametrize(("name", "rows"), [("friction_damper_1Hz", 7169), ("friction_damper_0.5Hz", 14337)])
def test_real_records(tmp_path: Path, name: str, rows: int) -> None:
    path = SHARED / f"{name}.csv"
    if not path.is_file():
        pytest.skip(f"the real records are not beside the repository: {path.name}")
    options = {"column": {"stroke": "Displacement [in]", "force": "Friction Force [kip]"}}
    result = import_file(path, tmp_path, ImportOptions(kind="harmonic", **options))  # type: ignore[arg-type]
    run = open_run(result.path)
    stroke, force = run.series("stroke"), run.series("force")
    independent = np.loadtxt(path, delimiter=",", skiprows=1)
    assert len(stroke.value) == rows == len(independent)
    assert stroke.value == pytest.approx(independent[:, 1] * 25.4, rel=1e-14)
    assert force.value == pytest.approx(independent[:, 2] * 4.4482216152605, rel=1e-14)
    assert abs(stroke.value).max() == pytest.approx(25.4, abs=0.3)  # “1 in nominal amplitude”
    assert run.streams["record"].rate_Hz == pytest.approx(1024.0, rel=1e-5)
    assert run.gaps("record") == []
    assert result.warnings == ()
    with pytest.raises(BadInput, match="no column is named “stroke”"):
        import_file(path, tmp_path / "plain")


@pytest.mark.long
def test_a_hundred_megabytes(tmp_path: Path) -> None:
    rows = 3_300_000
    path = tmp_path / "long.csv"
    with path.open("wb") as stream:
        stream.write(b"time [s],stroke [mm],force [kN]\n")
        for i in range(0, rows, 1000):
            stream.write(
                b"".join(b"%.6f,%.5f,%.5f\n" % (j * 1e-3, j * 1e-5, j * 1e-4) for j in range(i, i + 1000))
            )
    assert path.stat().st_size > 90_000_000
    run = imported(path, kind="harmonic")
    assert len(run.series("force").value) == rows
    assert run.series("force").value[-1] == pytest.approx((rows - 1) * 1e-4, abs=1e-5)
