"""Foreign records from strangers: workbooks of billions of rows, damaged channel groups, long numbers."""

from __future__ import annotations

import gc
import io
import random
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.hostile.attempts import Outcome, attempt, bugs
from tests.hostile.mutations import mutated
from tests.recording.foreign import makers

SHEET = "xl/worksheets/sheet1.xml"
HEAD_BYTES = 4096
"""Of a record; what stands there says where all the rest is."""


def workbook(path: Path, change: Callable[[str], str], part: str = SHEET) -> Path:
    """Write a workbook of which one part was changed."""
    whole = makers.excel(path).read_bytes()
    with (
        zipfile.ZipFile(io.BytesIO(whole)) as before,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as now,
    ):
        for name in before.namelist():
            text = before.read(name)
            now.writestr(name, change(text.decode("utf-8")) if name == part else text)
    return path


def with_row(row: str) -> Callable[[str], str]:
    return lambda text: text.replace("</sheetData>", f"{row}</sheetData>")


LAUGHS = '<!DOCTYPE a [<!ENTITY a0 "ha">' + "".join(
    f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12)
) + "]>"  # fmt: skip
SHEETS = {
    "a row far below": (
        with_row('<row r="99999999999"><c r="A99999999999"><v>1</v></c></row>'),
        "1048576 rows",
    ),
    "a column far to the right": (
        with_row('<row r="3000"><c r="ZZZ3000"><v>1</v></c></row>'),
        "1024 columns",
    ),
    "a row of no number": (with_row('<row r="x"><c r="Ax"><v>1</v></c></row>'), "damaged"),
    "digits": (with_row(f'<row r="3000"><c r="A3000"><v>{"9" * 5000}</v></c></row>'), "damaged"),
    "entities": (lambda text: LAUGHS + text.partition("?>")[2].replace("<v>", "<v>&a11;", 1), "damaged"),
    "elements within one another": (with_row("<a>" * 100_000), "damaged"),
}


@pytest.mark.parametrize(("change", "said"), SHEETS.values(), ids=SHEETS.keys())
def test_a_hostile_sheet_gets_one_message(change: Callable[[str], str], said: str, tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", change)
    assert path.stat().st_size < 200_000
    outcome = attempt("import", path, "--out", tmp_path / "out")
    assert (outcome.status, outcome.bug) == (2, ""), outcome
    assert said in outcome.message


def test_a_workbook_that_unpacks_to_gigabytes_is_not_unpacked(tmp_path: Path) -> None:
    path = makers.excel(tmp_path / "a.xlsx")
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("xl/more.xml", "w", force_zip64=True) as part,
    ):
        for _ in range(257):
            part.write(bytes(1 << 20))
    outcome = attempt("import", path, "--out", tmp_path / "out")
    assert "more than any record" in outcome.message


def damaged(name: str, seeds: range, folder: Path) -> list[tuple[str, Outcome]]:
    """Import a record of a kind that was damaged anew for each seed, mostly near its beginning."""
    path = RECORDS[name](folder / "record")
    whole, found = path.read_bytes(), []
    for seed in seeds:
        pick = random.Random(seed)
        head = HEAD_BYTES if pick.random() < 0.6 else len(whole)
        path.write_bytes(mutated(whole[:head], pick) + whole[head:])
        found.append((f"{name} {seed}", attempt("import", path, "--out", folder / f"out-{seed}")))
    return found


RECORDS: dict[str, Callable[[Path], Path]] = {
    "tdms": makers.tdms,
    "mdf": lambda path: makers.mdf(path.with_suffix(".mf4"), compression=0),
    "mdf, packed": lambda path: makers.mdf(path.with_suffix(".mf4")),
    "mdf 3": lambda path: makers.mdf(path.with_suffix(".mdf"), version="3.30"),
    "xlsx": makers.excel,
    "csv": makers.csv_comma,
    "utf-16": makers.csv_utf_16,
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", RECORDS)
def test_a_damaged_record_gets_one_message(name: str, tmp_path: Path) -> None:
    found = damaged(name, range(12), tmp_path)
    assert not bugs(found)
    assert any(one.status == 2 for _, one in found)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.long
@pytest.mark.parametrize("name", RECORDS)
def test_no_damaged_record_ends_in_a_bug(name: str, tmp_path: Path) -> None:
    assert not bugs(damaged(name, range(2000), tmp_path))


# The library's temporary file: which of its halves is collected first is chance.
@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
def test_half_made_objects_of_a_library_say_nothing_as_they_go(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The library's ``__del__`` fails on an object whose constructor did; Python would show the traceback."""
    path = makers.mdf(tmp_path / "a.mf4")
    path.write_bytes(path.read_bytes()[:64])
    assert attempt("import", path, "--out", tmp_path).status == 2
    gc.collect()
    assert "Traceback" not in capfd.readouterr().err
    assert "asammdf" in repr(vars(sys.unraisablehook))
