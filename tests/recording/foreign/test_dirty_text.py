"""Text files as they come from real rigs: each kind of dirt is read right, or refused with file and line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput

from .attempts import read, refused
from .texts import HEADER, lines, values, write

# --- headings -----------------------------------------------------------------------------------------


def test_a_heading_of_many_lines_is_kept_and_not_read_as_data(tmp_path: Path, block_size: str) -> None:
    head = ["Rig 3; release 2.1", "Sample rate;500", "", "# remark", "time;stroke;force;alarm", "s;mm;kN;-"]
    run, warnings = read(write(tmp_path, lines(*head, "0;1,5;2;0", "0,002;2,5;3;0")))
    assert values(run, "stroke") == [1.5, 2.5]
    assert warnings == ()
    original = run.metadata["original"]
    assert (original["header_line"], original["units_line"]) == (5, 6)
    assert original["preamble"] == ["Rig 3; release 2.1", "Sample rate;500", "# remark"]
    assert original["columns"]["force"]["unit_from"] == "units row"
    assert original["ignored"] == ["alarm"]


def test_headers_of_other_names_are_found_above_the_first_numbers(tmp_path: Path) -> None:
    path = write(tmp_path, lines("Export of test 7", "Zeit [s]\tWeg [mm]\tKraft [kN]", "0\t1\t2", "1\t2\t3"))
    assert "line 2: no column is named “stroke”" in refused(path)
    run, _ = read(path, column={"time": "Zeit", "stroke": "Weg", "force": "Kraft"})
    assert values(run, "force") == [2.0, 3.0]


def test_heading_blocks_inside_the_data_are_left_out_where_time_goes_on(
    tmp_path: Path, block_size: str
) -> None:
    block = ["Logger started anew", "time;stroke;force", "s;mm;kN"]
    rows = [f"{i / 10};{i};{2 * i}" for i in range(9)]
    run, warnings = read(write(tmp_path, lines(*block, *rows[:3], "", *block, *rows[3:6], *block, *rows[6:])))
    assert values(run, "stroke") == list(range(9))
    assert warnings == ("2 header row(s) inside the data, the first in line 9",)
    assert run.gaps("record") == []


def test_records_one_below_the_other_are_imported_one_by_one(tmp_path: Path, block_size: str) -> None:
    rows = [f"{i / 10},{i},{2 * i}" for i in range(5)]
    path = write(tmp_path, lines(HEADER, *rows, HEADER, *rows[:3]))
    message = refused(path)
    assert "line 8: its time starts anew here: the file holds 2 records" in message
    assert "--block 1" in message
    run, _ = read(path, block=2)
    assert values(run, "stroke") == [0.0, 1.0, 2.0]
    assert run.id == "record-block-2"
    assert run.metadata["original"]["block"] == 2
    with pytest.raises(BadInput, match="--block 3: the file holds 2"):
        read(path, block=3)


def test_without_time_a_heading_inside_the_data_is_an_interruption(tmp_path: Path, block_size: str) -> None:
    path = write(
        tmp_path, lines("stroke [mm],force [kN]", "1,2", "2,3", "stroke [mm],force [kN]", "3,4", "4,5")
    )
    run, _ = read(path, sample_rate_hz=10.0)
    assert run.gaps("record") == [(1, 0)]
    assert values(run, "stroke") == [1.0, 2.0, 3.0, 4.0]


def test_a_file_without_headers_by_a_mapping(tmp_path: Path) -> None:
    path = write(tmp_path, lines("0 s?;x", "0,0;1,5;7;2", "0,1;2,5;7;3"))
    mapping = write(
        tmp_path,
        lines(
            "[file]", "header_line = 0", 'separator = ";"', "first_line = 2",
            "[columns.time]", "number = 1", 'unit = "s"',
            "[columns.stroke]", "number = 2", 'unit = "mm"',
            "[columns.force]", "number = 4", 'unit = "kN"',
        ),
        "lab.toml",
    )  # fmt: skip
    run, _ = read(path, mapping=mapping)
    assert values(run, "stroke") == [1.5, 2.5]
    assert values(run, "force") == [2.0, 3.0]


# --- lines ------------------------------------------------------------------------------------------------


def test_a_last_line_cut_short_is_left_out_and_said(tmp_path: Path, block_size: str) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER, "0,1,2", "0.1,2,3", "0.2,3,4") + "0.3,4"))
    assert values(run, "force") == [2.0, 3.0, 4.0]
    assert warnings == (
        "1 line(s) at the end not written whole and left out (the file is cut short), the first in line 5",
    )


def test_zeros_at_the_end_are_left_out_and_said(tmp_path: Path, block_size: str) -> None:
    text = lines(HEADER, "0,1,2", "0.1,2,3", "0.2,3,4").encode()
    run, warnings = read(write(tmp_path, text + b"\0" * 5000))
    assert values(run, "force") == [2.0, 3.0, 4.0]
    assert warnings == ("the file ends in 5000 zero byte(s): its end was not written",)


def test_zeros_after_half_a_line(tmp_path: Path, block_size: str) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER, "0,1,2", "0.1,2,3").encode() + b"0.2," + b"\0" * 70))
    assert values(run, "force") == [2.0, 3.0]
    assert any("at the end not written whole" in text for text in warnings)
    assert any("ends in 70 zero byte(s)" in text for text in warnings)


def test_a_line_of_text_inside_the_data(tmp_path: Path, block_size: str) -> None:
    path = write(tmp_path, lines(HEADER, "0,1,2", "0.1,2,3", "stopped by operator", "0.2,3,4", "0.3,4,5"))
    assert "line 4: 1 cell(s) where the header row has 3; mend or remove this line" in refused(path)
    run, warnings = read(path, salvage=True)
    assert values(run, "force") == [2.0, 3.0, 4.0, 5.0]
    assert warnings == ("1 line(s) could not be read and were left out, the first in line 4",)
    assert run.metadata["original"]["salvaged"] is True


def test_a_line_of_text_at_the_end(tmp_path: Path, block_size: str) -> None:
    assert "line 4: 2 cell(s)" in refused(write(tmp_path, lines(HEADER, "0,1,2", "1,2,3", "end,of test")))


def test_a_line_of_text_of_the_right_width(tmp_path: Path) -> None:
    path = write(tmp_path, lines(HEADER, "0,1,2", "a,b,c", "1,2,3"))
    assert "line 3: a line of text inside the data" in refused(path)


def test_remarks_inside_the_data(tmp_path: Path, block_size: str) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER, "0,1,2", "# valve, opened", "1,2,3", "# x", "2,3,4")))
    assert values(run, "force") == [2.0, 3.0, 4.0]
    assert warnings == ("2 remark(s) (#) inside the data, the first in line 3",)


def test_separators_at_the_ends_of_lines(tmp_path: Path) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER, "0,1,2,", "1,2,3,", "2,3,4,")))
    assert values(run, "force") == [2.0, 3.0, 4.0]
    assert warnings == ()
    tailed = tmp_path / "tailed"
    tailed.mkdir()
    run, _ = read(write(tailed, lines(HEADER + ",,", "0,1,2", "1,2,3")))
    assert values(run, "force") == [2.0, 3.0]


@pytest.mark.parametrize("end", ["\r", "\r\n"])
def test_other_line_ends(tmp_path: Path, end: str, block_size: str) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER, "0,1,2", "1,2,3", "", "2,3,4").replace("\n", end)))
    assert values(run, "force") == [2.0, 3.0, 4.0]
    assert warnings == ()


# --- cells ------------------------------------------------------------------------------------------------


def test_decimal_commas_quoted_between_commas(tmp_path: Path, block_size: str) -> None:
    run, _ = read(write(tmp_path, lines(HEADER, '"0","1,5","2,5"', '"0,1","2,5","3"')))
    assert values(run, "stroke") == [1.5, 2.5]
    assert run.metadata["original"]["decimal"] == ","


def test_a_column_of_remarks_with_separators_in_quotes(tmp_path: Path, block_size: str) -> None:
    run, _ = read(write(tmp_path, lines(HEADER + ",note", '0,1,2,"ok, go"', '1,2,3,""', '2,3,4,"a ""b"""')))
    assert values(run, "force") == [2.0, 3.0, 4.0]


def test_cells_that_mean_no_value(tmp_path: Path, block_size: str) -> None:
    path = write(tmp_path, lines(HEADER, "0,1,2", "1,n/a,3", "2,---,4", "3,4,5"))
    assert "line 3, column 2 “stroke [mm]”: “n/a” is no number" in refused(path)
    mapping = write(tmp_path, '[file]\nmissing = ["n/a", "---"]\n', "lab.toml")
    run, warnings = read(path, mapping=mapping)
    assert np.array_equal(run.series("stroke").value, [1.0, np.nan, np.nan, 4.0], equal_nan=True)
    assert warnings == ("stroke_1: 2 empty or NaN cell(s), the first in line 3",)


def test_bad_cells_are_salvaged_one_by_one(tmp_path: Path, block_size: str) -> None:
    path = write(tmp_path, lines(HEADER.replace(",", ";"), "0;1,5;2", "1;2,x;3", "2;3,5;####", "3;inf;5"))
    run, warnings = read(path, salvage=True)
    assert run.metadata["original"]["decimal"] == ","
    assert np.array_equal(run.series("stroke").value, [1.5, np.nan, 3.5, np.nan], equal_nan=True)
    assert np.array_equal(run.series("force").value, [2.0, 3.0, np.nan, 5.0], equal_nan=True)
    assert warnings[0] == "3 cell(s) that are no number, taken as no value, the first in line 3"


def test_decimal_signs_that_change_within_the_file(tmp_path: Path, block_size: str) -> None:
    path = write(
        tmp_path, lines("time [s];stroke [mm];force [kN]", "0,5;1,5;2,5", "1,5;2,5;3,5", "2,5;3.5;4,5")
    )
    assert "line 4, column 2 “stroke [mm]”: “3.5” is no number (decimal sign “,”)" in refused(path)


def test_a_decimal_comma_that_comes_late(tmp_path: Path, block_size: str) -> None:
    rows = [f"{i};{i};{i}" for i in range(50)]
    run, _ = read(write(tmp_path, lines("time [s];stroke [mm];force [kN]", *rows, "50;50,5;50")))
    assert values(run, "stroke")[-1] == 50.5


# --- time -------------------------------------------------------------------------------------------------


def test_stamps_that_are_missing_repeated_or_backward(tmp_path: Path, block_size: str) -> None:
    rows = [
        "0,0,0",
        "1,1,1",
        ",2,2",
        "3,3,3",
        "4,4,4",
        "4,5,5",
        "5,6,6",
        "2,7,7",
        "6,8,8",
        "10,9,9",
        "11,1,1",
    ]
    run, warnings = read(write(tmp_path, lines(HEADER, *rows)))
    assert "1 missing time stamp(s), the first in line 4" in warnings
    assert "1 repeated time stamp(s), the first in line 7" in warnings
    assert "1 backward time stamp(s), the first in line 9" in warnings
    assert len(run.series("force").value) == len(rows)
    assert [row for row, _ in run.gaps("record")] == [1, 2, 4, 6, 7, 8]


@pytest.mark.parametrize("zone", [None, "Europe/Vienna"])
def test_dates_and_times(tmp_path: Path, zone: str | None, block_size: str) -> None:
    path = write(
        tmp_path,
        lines(
            "Datum;Weg;Kraft",
            ";mm;kN",
            "05.03.2026 14:02:11,500;1;2",
            "05.03.2026 14:02:11,502;2;3",
            "05.03.2026 14:02:11,504;3;4",
        ),
    )
    text = [
        '[columns.time]\nheader = "Datum"\nunit = "date-time"\nformat = "%d.%m.%Y %H:%M:%S,%f"',
        '[columns.stroke]\nheader = "Weg"\n[columns.force]\nheader = "Kraft"',
    ]
    mapping = write(tmp_path, lines(f'time_zone = "{zone}"' if zone else "", *text), "lab.toml")
    run, warnings = read(path, mapping=mapping)
    assert run.series("force").time_s == pytest.approx([0.0, 0.002, 0.004], abs=1e-12)
    hour = 13 if zone else 14
    assert run.metadata["run"]["started_utc"] == f"2026-03-05T{hour}:02:11.500000+00:00"
    assert ("no zone" in " ".join(warnings)) == (zone is None)


def test_iso_stamps_by_an_option(tmp_path: Path) -> None:
    rows = ["2026-03-05T14:02:11.500Z,1,2", "2026-03-05T14:02:11.600Z,2,3", "x,3,4"]
    path = write(tmp_path, lines("time,stroke [mm],force [kN]", *rows))
    assert "line 1, column 1 “time”: this column has no unit" in refused(path)
    message = refused(path, unit={"time": "date-time"})
    assert "line 4, column 1 “time”: “x” is no date and time" in message
    path.write_text(lines("time,stroke [mm],force [kN]", *rows[:2]))
    run, _ = read(path, unit={"time": "date-time"})
    assert run.series("force").time_s == pytest.approx([0.0, 0.1], abs=1e-12)
    assert run.metadata["run"]["started_utc"] == "2026-03-05T14:02:11.500000+00:00"


def test_a_clock_set_back_for_winter_shows_and_is_not_corrected(tmp_path: Path) -> None:
    rows = [f"2026-10-25 02:59:59.{i}00,1,2" for i in range(9)] + ["2026-10-25 02:00:00.000,1,2"]
    path = write(tmp_path, lines("time,stroke [mm],force [kN]", *rows))
    mapping = write(tmp_path, 'time_zone = "Europe/Vienna"\n[columns.time]\nunit = "date-time"\n', "lab.toml")
    run, warnings = read(path, mapping=mapping)
    assert "1 backward time stamp(s), the first in line 11" in warnings
    assert run.metadata["run"]["started_utc"] == "2026-10-25T00:59:59+00:00"


# --- encodings ----------------------------------------------------------------------------------------


def test_a_degree_sign_of_windows_in_the_middle_of_an_ascii_file(tmp_path: Path) -> None:
    rows = [f"{i},{i},{i},ok" for i in range(300_00)]
    text = lines(HEADER + ",note", *rows, "30000,1,1,30 °C")
    run, _ = read(write(tmp_path, text.encode("latin-1")))
    assert run.metadata["original"]["encoding"] == "Latin-1"
    assert len(run.series("force").value) == 30_001


def test_half_a_character_of_utf_16(tmp_path: Path) -> None:
    message = refused(write(tmp_path, lines(HEADER, "0,1,2").encode("utf-16") + b"\x31"))
    assert "bytes that are no UTF-16" in message


def test_an_encoding_that_a_mapping_states_wrongly(tmp_path: Path) -> None:
    path = write(tmp_path, lines(HEADER + ",Höhe", "0,1,2,3").encode("latin-1"))
    mapping = write(tmp_path, '[file]\nencoding = "UTF-8"\n', "lab.toml")
    assert "record.csv: line 1: bytes that are no UTF-8" in refused(path, mapping=mapping)
