"""Text that could be read in two ways: read in the one that is sure, or refused; nothing is lost unsaid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.foreign.decimal_signs import DecimalSignEvidence
from bufferstand.recording.foreign.text.cell_splitting import text_rows

from .attempts import read, refused
from .texts import HEADER, lines, values, write

NOTED = HEADER + ",note"
BY_NUMBER = lines(
    '[columns.time]\nnumber = 1\nunit = "s"',
    '[columns.stroke]\nnumber = 2\nunit = "mm"',
    '[columns.force]\nnumber = 3\nunit = "kN"',
)
ODD_QUOTE = "1 line(s) with a quote that is not closed, read as a character, the first in line {}"

# --- quotes -----------------------------------------------------------------------------------------------


def test_a_separator_in_quotes_separates_nothing(tmp_path: Path, block_size: str) -> None:
    rows = ["0,10,950,a", "1,11,980,b", '2,12,"1,234.5"', "3,13,1300.5,c"]
    message = refused(write(tmp_path, lines("time [s],stroke [mm],force [N],note", *rows)))
    assert "line 4, column 3 “force [N]”: “1,234.5” is no number" in message
    message = refused(write(tmp_path, lines(HEADER, "0,1,2", '"2,5",3', "3,4,5")))
    assert "line 3: 2 cell(s) where the header row has 3" in message


def test_half_a_pair_of_quotes_is_no_number(tmp_path: Path, block_size: str) -> None:
    message = refused(write(tmp_path, lines(HEADER, "0,1,2", '2,1",3')))
    assert 'line 3, column 2 “stroke [mm]”: “1"” is no number' in message


@pytest.mark.parametrize("remark", [(), ("# r",)], ids=["plain", "with a remark"])
def test_a_stray_quote_takes_in_no_samples(tmp_path: Path, remark: tuple[str, ...], block_size: str) -> None:
    rows = [f"{i},{i},{i},{'' if i != 7 else chr(34) + '2 inch stop set'}" for i in range(50)]
    run, warnings = read(write(tmp_path, lines(NOTED, *remark, *rows)))
    assert values(run, "force") == list(range(50))
    assert ODD_QUOTE.format(9 + len(remark)) in warnings


def test_stray_quotes_that_make_a_pair_take_in_no_samples(tmp_path: Path, block_size: str) -> None:
    rows = [f"{i},{i},{i},{'ok' if i not in (7, 9) else chr(34) + '2 inch'}" for i in range(50)]
    run, warnings = read(write(tmp_path, lines(NOTED, *rows)))
    assert values(run, "force") == list(range(50))
    assert "2 line(s) with a quote that is not closed" in warnings[0]


def test_a_stray_quote_in_a_number_is_refused_where_it_is(tmp_path: Path, block_size: str) -> None:
    path = write(tmp_path, lines(HEADER, "# r", "0,1,2", '"1,2,3', "2,3,4", "3,4,5"))
    assert 'line 4, column 1 “time [s]”: “"1” is no number' in refused(path)
    run, warnings = read(path, salvage=True)
    assert values(run, "force") == [2.0, 3.0, 4.0, 5.0]
    assert "1 cell(s) that are no number, taken as no value, the first in line 4" in warnings


def test_a_quoted_remark_of_several_lines_is_one_cell(tmp_path: Path) -> None:
    run, warnings = read(write(tmp_path, lines(NOTED, '0,1,2,"see line', 'after, all ok"', "1,2,3,b")))
    assert values(run, "force") == [2.0, 3.0]
    assert warnings == ()


def test_quotes_around_lines_that_look_like_rows_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, lines(NOTED, '0,1,2,"see row', '9,99,99,x"', "1,2,3,b"))
    assert "line 2: a quote is opened here and closed in a later line, with rows of numbers" in refused(path)


def test_a_header_with_a_line_break_in_quotes(tmp_path: Path, block_size: str) -> None:
    run, _ = read(write(tmp_path, lines('time [s],stroke [mm],"force', '[kN]"', "0,1,2", "1,2,3")))
    assert values(run, "force") == [2.0, 3.0]
    assert run.metadata["original"]["columns"]["force"]["header"] == "force [kN]"


def test_a_cell_longer_than_any_is(tmp_path: Path) -> None:
    rows = ["0,1,2," + "x" * 200_000, '1,2,3,"' + "y" * 200_000, "# r", "2,3,4,"]
    run, warnings = read(write(tmp_path, lines(NOTED, *rows)))
    assert values(run, "force") == [2.0, 3.0, 4.0]
    assert ODD_QUOTE.format(3) in warnings


def test_spaces_outside_of_quotes(tmp_path: Path) -> None:
    rows = list(text_rows([' "a","b,c", "d"\n', ' "1" ,"2","3"\n'], ","))
    assert [row.cells for row in rows] == [["a", "b,c", "d"], ["1", "2", "3"]]
    run, _ = read(write(tmp_path, lines(HEADER, ' "0" ,"1", "2"', '"1","2" ,"3"')))
    assert values(run, "force") == [2.0, 3.0]


# --- lines ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("remark", [(), ("# r",)], ids=["plain", "with a remark"])
def test_an_empty_row_keeps_its_time(tmp_path: Path, remark: tuple[str, ...], block_size: str) -> None:
    path = write(tmp_path, lines("stroke [mm],force [kN]", "1,2", ",", "3,4", *remark, "4,5"))
    run, warnings = read(path, sample_rate_hz=10.0)
    assert np.array_equal(run.series("force").value, [2.0, np.nan, 4.0, 5.0], equal_nan=True)
    assert "force: 1 empty or NaN cell(s), the first in line 3" in warnings


@pytest.mark.parametrize("remark", [(), ("# r",)], ids=["plain", "with a remark"])
def test_a_blank_line_interrupts_a_record_without_time(
    tmp_path: Path, remark: tuple[str, ...], block_size: str
) -> None:
    path = write(tmp_path, lines("stroke [mm],force [kN]", "1,2", "2,3", "", "3,4", *remark, "4,5", "", ""))
    run, warnings = read(path, sample_rate_hz=10.0)
    assert run.gaps("record") == [(1, 0)]
    assert any("1 interruption(s) of unknown length" in text and "before line 5" in text for text in warnings)


def test_lines_that_all_end_twice_interrupt_nothing(tmp_path: Path, block_size: str) -> None:
    text = lines("stroke [mm],force [kN]", "1,2", "2,3", "3,4").replace("\n", "\r\r\n")
    run, warnings = read(write(tmp_path, text), sample_rate_hz=10.0)
    assert (run.gaps("record"), warnings) == ([], ())


def test_a_remark_is_one_whatever_columns_are_used(tmp_path: Path, block_size: str) -> None:
    path = write(tmp_path, lines("Nr," + HEADER, "1,0,1,2", "#2,1,99,99", "3,2,3,4"))
    run, warnings = read(path)
    assert values(run, "force") == [2.0, 4.0]
    assert warnings == ("1 remark(s) (#) inside the data, the first in line 3",)


@pytest.mark.parametrize("remark", [(), ("# r",)], ids=["plain", "with a remark"])
def test_a_last_line_without_its_end_is_said(
    tmp_path: Path, remark: tuple[str, ...], block_size: str
) -> None:
    _, warnings = read(write(tmp_path, lines(HEADER, "0,1,2", *remark, "1,2,3", "2,3,4").rstrip("\n")))
    assert "the last line is not ended: the file may be cut short, and its last number with it" in warnings


def test_comments_that_are_left_out_where_they_are_empty(tmp_path: Path, block_size: str) -> None:
    """LabVIEW's .lvm: a comment in the first row only."""
    rows = ["0\t1\t2\tStart", "1\t2\t3", "2\t3\t4"]
    run, warnings = read(write(tmp_path, lines(NOTED.replace(",", "\t"), *rows)))
    assert values(run, "force") == [2.0, 3.0, 4.0]
    assert warnings == ("2 line(s) without the last columns, which are not used, the first in line 3",)


def test_a_row_without_the_last_column_that_is_used_is_refused(tmp_path: Path, block_size: str) -> None:
    assert "line 3: 2 cell(s)" in refused(write(tmp_path, lines(HEADER, "0,1,2", "1,2", "2,3,4")))


@pytest.mark.parametrize("end", ["\x1a", "\x1a\r\n"])
def test_an_end_of_file_mark_of_dos(tmp_path: Path, end: str) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER, "0,1,2", "1,2,3").replace("\n", "\r\n") + end))
    assert (values(run, "force"), warnings) == ([2.0, 3.0], ())


# --- headings -------------------------------------------------------------------------------------------


def test_a_first_row_with_a_comment_is_no_header(tmp_path: Path) -> None:
    mapping = write(tmp_path, BY_NUMBER, "lab.toml")
    rows = ["0,000\t0,0\t1,5\tStart", "0,001\t1,0\t2,5\t", "0,002\t2,0\t3,5\t"]
    run, _ = read(write(tmp_path, lines("X_Value\tWeg\tKraft\tComment", *rows)), mapping=mapping)
    assert values(run, "force") == [1.5, 2.5, 3.5]


def test_a_first_row_with_a_text_is_no_header(tmp_path: Path) -> None:
    mapping = write(tmp_path, BY_NUMBER, "lab.toml")
    rows = ["0,000;OVER;1,5", "0,001;1,0;2,5", "0,002;2,0;3,5"]
    path = write(tmp_path, lines("Zeit;Weg;Kraft", *rows))
    assert "line 2, column 2 “Weg”: “OVER” is no number" in refused(path, mapping=mapping)
    path = write(tmp_path, lines(*rows), "bare.csv")
    message = refused(path, mapping=mapping)
    assert "line 1: no header row: this line holds numbers; " in message
    assert "header_line in a mapping file (0: there is none)" in message


def test_a_named_header_is_sought_below_a_line_of_that_name(tmp_path: Path) -> None:
    path = write(tmp_path, lines("Zeit;12:30:05", "Zeit;stroke [mm];force [kN]", "0;1;2", "1;2;3"))
    run, _ = read(path, column={"time": "Zeit"}, unit={"time": "s"})
    assert run.metadata["original"]["header_line"] == 2


def test_captions_with_a_number_above_a_repeated_header(tmp_path: Path, block_size: str) -> None:
    rows = ["a1,0,1,2", "a2,1,2,3", "Run,2,,", "Preload,,12.5,", "Nr," + HEADER, "a3,2,3,4", "a4,3,4,5"]
    run, warnings = read(write(tmp_path, lines("Nr," + HEADER, *rows)))
    assert values(run, "stroke") == [1.0, 2.0, 3.0, 4.0]
    assert warnings[-1].startswith(
        "2 line(s) with a number or two above a header row inside the data, left out"
    )
    run, _ = read(write(tmp_path, lines(HEADER, "0,1,2", "Cycle,2,", HEADER, "1,2,3"), "b.csv"))
    assert values(run, "force") == [2.0, 3.0]


def test_repeated_headers_without_the_separator_at_the_end(tmp_path: Path, block_size: str) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER, "0,1,2,", "1,2,3,", HEADER, "2,3,4,", "3,4,5,")))
    assert values(run, "force") == [2.0, 3.0, 4.0, 5.0]
    assert warnings == ("1 header row(s) inside the data, the first in line 4",)


def test_files_that_were_joined_with_their_marks(tmp_path: Path, block_size: str) -> None:
    parts = [lines(HEADER, *rows).encode("utf-8-sig") for rows in (("0,1,2", "1,2,3"), ("2,3,4", "3,4,5"))]
    run, warnings = read(write(tmp_path, b"".join(parts)))
    assert values(run, "force") == [2.0, 3.0, 4.0, 5.0]
    assert warnings == ("1 header row(s) inside the data, the first in line 4",)


def test_units_that_contradict_each_other(tmp_path: Path) -> None:
    path = write(tmp_path, lines("time,stroke [mm],force (max)", "s,in,kN", "0,1,2", "1,2,3"))
    message = refused(path)
    assert "column 2 “stroke [mm]”: two units are stated: mm in the header, in as units row" in message
    run, _ = read(path, unit={"stroke": "mm"})
    assert (values(run, "stroke"), values(run, "force")) == ([1.0, 2.0], [2.0, 3.0])


# --- numbers ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("remark", [(), ("# r",)], ids=["plain", "with a remark"])
@pytest.mark.parametrize("missing", ["-9999", "-9999.00"])
def test_a_number_that_means_no_value_does_so_however_written(
    tmp_path: Path, remark: tuple[str, ...], missing: str
) -> None:
    path = write(tmp_path, lines(HEADER, "0,1,2", *remark, "1,-9999.0,3", "2,-9999,4", "3,-999.9,5"))
    run, _ = read(path, mapping=write(tmp_path, f'[file]\nmissing = ["{missing}"]\n', "lab.toml"))
    assert np.array_equal(run.series("stroke").value, [1.0, np.nan, np.nan, -999.9], equal_nan=True)


@pytest.mark.parametrize(
    "rows",
    [
        ("time [ms],stroke [mm],force [N]", "0,0,950", '1,1,"1,300"', '2,2,"12,300"'),
        ("time [ms];stroke [mm];force [N]", "0;0;950", "1;1;1.300", "2;2;12.300"),
        ("time [ms];stroke [mm];force [N]", "0;0;950", "1;1;-1,300", "2;2;12,300"),
    ],
)
def test_what_may_set_thousands_apart_is_refused(
    tmp_path: Path, rows: tuple[str, ...], block_size: str
) -> None:
    path = write(tmp_path, lines(*rows))
    message = refused(path)
    assert "line 3, column 3 “force [N]”: “" in message
    assert "between thousands, or have the decimal sign" in message
    sign = "." if "1.300" in rows[2] else ","
    mapping = write(tmp_path, f'[file]\ndecimal = "{sign}"\n', "lab.toml")
    run, _ = read(path, mapping=mapping)
    assert values(run, "force")[2] == pytest.approx(0.0123)


@pytest.mark.parametrize(
    "cells",
    [
        ["12.345", "950.000", "13.456"],  # all hold the sign
        ["12.345", "950", "13.45"],  # not always three behind it
        ["0.345", "950", "12.345"],  # no number with thousands begins with 0
        ["12.345", "950", "1234"],  # thousands that are not set apart
        ["12", "950", "999"],
        ["1.5e3", "950", "12.345"],
        [".345", "950", "12.345"],
    ],
)
def test_what_cannot_set_thousands_apart_is_a_decimal_sign(cells: list[str]) -> None:
    witness = DecimalSignEvidence(".")
    for number, cell in enumerate(cells):  # in blocks of one
        witness.look(np.array([float(cell)]), np.array([number]), lambda _, text=cell: [text])  # type: ignore[misc]
    assert witness.suspect is None


def test_the_sign_that_most_cells_have_is_salvaged_by(tmp_path: Path, block_size: str) -> None:
    rows = [f"{i};0;0" for i in range(90)] + [f"{90 + i},5;0,1;x" for i in range(5)]
    run, _ = read(write(tmp_path, lines(HEADER.replace(",", ";"), *rows)), salvage=True)
    assert run.metadata["original"]["decimal"] == ","
    assert values(run, "stroke")[-1] == 0.1


def test_a_bad_cell_in_the_first_row_is_the_one_that_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, lines(HEADER.replace(",", ";"), "0,1;1,5;OVER", "0,2;1,6;2"))
    assert "line 2, column 3 “force [kN]”: “OVER” is no number (decimal sign “,”)" in refused(path)


def test_a_number_too_large_is_said(tmp_path: Path) -> None:
    run, warnings = read(write(tmp_path, lines(HEADER.replace("kN", "kip"), "0,1,1e308", "1,2,3", "2,3,4")))
    assert "force: 1 infinite value(s), which count as none, the first in line 2" in warnings
    assert np.isinf(run.series("force").value[0])


def test_signs_are_judged_by_the_values_not_the_numbers(tmp_path: Path) -> None:
    scaled = BY_NUMBER + "scale = -150.0\noffset = 800.0\n"
    path = write(tmp_path, lines(HEADER, "0,1,5", "1,2,3", "2,3,4"))
    run, warnings = read(path, mapping=write(tmp_path, scaled, "lab.toml"))
    assert (values(run, "force"), warnings) == ([50.0, 350.0, 200.0], ())


def test_a_turned_sign_that_is_wrong_is_said_as_such(tmp_path: Path) -> None:
    _, warnings = read(write(tmp_path, lines(HEADER, "0,1,2", "1,2,3")), invert=["force"])
    assert warnings[-1].endswith("if the record counts the other way, import it without its sign turned")


# --- time and names ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("header", "stamp"), [(HEADER, "1e17"), (HEADER.replace("[s]", "[min]"), "1e308")])
def test_an_absurd_stamp(tmp_path: Path, header: str, stamp: str) -> None:
    run, warnings = read(write(tmp_path, lines(header, "0,1,2", "0.001,2,3", "0.002,2,3", f"{stamp},4,5")))
    assert run.gaps("record") == [(2, 0)]
    assert "line 5" in warnings[0]


def test_missing_stamps_are_called_missing(tmp_path: Path) -> None:
    _, warnings = read(write(tmp_path, lines(HEADER, ",1,2", ",2,3")))
    assert warnings[0] == "2 missing time stamp(s), the first in line 2"


def date_times(tmp_path: Path, *rows: str, form: str = "") -> tuple[Path, Path]:
    path = write(tmp_path, lines("time,stroke [mm],force [kN]", *rows))
    return path, write(tmp_path, f'[columns.time]\nunit = "date-time"\n{form}\n', "lab.toml")


def test_dates_beyond_what_can_be_counted(tmp_path: Path) -> None:
    path, mapping = date_times(tmp_path, "9999-10-25 00:00:00,1,2", "9999-10-25 00:00:01,2,3")
    assert "line 2, column 1 “time”: “9999-10-25 00:00:00” is no date and time" in refused(
        path, mapping=mapping
    )


@pytest.mark.parametrize("filler", [0, 20])
def test_a_stamp_without_a_zone_among_stamps_with_one(tmp_path: Path, filler: int, block_size: str) -> None:
    rows = [f"2026-10-25T00:00:{i:02d}Z,1,2" for i in range(filler + 1)]
    path, mapping = date_times(tmp_path, *rows, "2026-10-25T00:00:59,2,3")
    assert f"line {filler + 3}, column 1 “time”: “2026-10-25T00:00:59” is no" in refused(
        path, mapping=mapping
    )


def test_the_stated_form_over_a_change_of_the_clock(tmp_path: Path) -> None:
    path, mapping = date_times(
        tmp_path, "25.10.2026 02:59:59 +0200,1,2", "25.10.2026 02:00:00 +0100,2,3",
        form='format = "%d.%m.%Y %H:%M:%S %z"',
    )  # fmt: skip
    run, _ = read(path, mapping=mapping)
    assert run.series("force").time_s.tolist() == [0.0, 1.0]
    assert run.metadata["run"]["started_utc"] == "2026-10-25T00:59:59+00:00"


def test_dates_and_times_are_not_scaled(tmp_path: Path) -> None:
    path, mapping = date_times(tmp_path, "2026-10-25T00:00:00Z,1,2", form="scale = 2.0")
    assert mapping.read_text(encoding="utf-8").splitlines()[2] == "scale = 2.0"
    assert "lab.toml: line 3: columns.time.scale: with scale or offset, say the unit" in refused(
        path, mapping=mapping
    )


def test_a_start_in_another_zone_is_kept_in_utc(tmp_path: Path) -> None:
    path = write(tmp_path, lines(HEADER, "0,1,2", "1,2,3"))
    specimen = '[specimen]\nid = "A"\nkind = "buffer"\n[test]\nstarted = 2026-03-05T14:00:00+01:00\n'
    run, _ = read(path, specimen=write(tmp_path, specimen, "specimen.toml"))
    assert run.metadata["run"]["started_utc"] == "2026-03-05T13:00:00Z"


def test_a_name_that_is_no_text(tmp_path: Path) -> None:
    run, _ = read(write(tmp_path, lines(HEADER, "0,1,2", "1,2,3"), "pr\udcfcf.csv"))
    assert run.metadata["original"]["file"] == r"pr\xfcf.csv"


@pytest.mark.parametrize("name", ["n" * 255, "n" * 251 + ".csv"])
def test_a_name_too_long_for_another_ending(tmp_path: Path, name: str) -> None:
    path = write(tmp_path, lines(HEADER, "0,1,2"), name)
    with pytest.raises(BadInput, match="cannot be written: File name too long"):
        read(path)


@pytest.mark.parametrize("codec", ["utf-16-le", "utf-16-be"])
def test_utf_16_as_stated_and_without_a_mark(tmp_path: Path, codec: str) -> None:
    mapping = write(tmp_path, '[file]\nencoding = "UTF-16"\n', "lab.toml")
    message = refused(write(tmp_path, lines(HEADER, "0,1,2"), "utf8.csv"), mapping=mapping)
    assert "utf8.csv: line 1: bytes that are no UTF-16" in message
    run, _ = read(write(tmp_path, lines(HEADER, "0,1,2", "1,2,3").encode(codec)), mapping=mapping)
    assert values(run, "force") == [2.0, 3.0]


def test_a_mapping_file_of_a_windows_editor(tmp_path: Path) -> None:
    mapping = write(tmp_path, b"\xef\xbb\xbf[file]\ndecimal = '.'\n", "lab.toml")
    run, _ = read(write(tmp_path, lines(HEADER, "0,1,2", "1,2,3")), mapping=mapping)
    assert values(run, "force") == [2.0, 3.0]


def test_limits_in_the_unit_of_the_mapping(tmp_path: Path) -> None:
    mapping = BY_NUMBER.replace('"kN"', '"N"') + "uncertainty = { zero = 500.0, accuracy_percent = 0.5 }\n"
    path = write(tmp_path, lines(HEADER, "0,1,2000", "1,2,3000"))
    run, _ = read(path, mapping=write(tmp_path, mapping, "lab.toml"))
    stated = run.streams["record"].channels["force"].uncertainty
    assert (stated.zero, stated.accuracy_percent) == (pytest.approx(0.5), 0.5)
