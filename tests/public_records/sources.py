"""Where the public records are from, and how each is handed to the import: as its owner wrote it where it can
be read so, else with the same numbers as CSV.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

_HEADERS = "time [s],stroke [in],force [kip]"


@dataclass(frozen=True)
class Record:
    """A record: its file, the CSV that is imported, and the mapping file's text (empty: none is needed)."""

    source: Source
    name: str
    file: Path
    mapping: str
    sample_rate_Hz: float | None = None

    def csv(self, folder: Path) -> Path:
        """Return the file to import; JSON matrices are written out with their own digits."""
        if self.file.suffix != ".json":
            return self.file
        rows = json.loads(self.file.read_text(encoding="utf-8"))["data"]
        target = folder / f"{self.file.stem}.csv"
        lines = [_HEADERS, *(",".join(repr(float(value)) for value in row[:3]) for row in rows)]
        target.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return target


@dataclass(frozen=True)
class Files:
    """Files of a source that are read alike."""

    pattern: str
    what: str
    mapping: str = ""
    sample_rate_Hz: float | None = None


@dataclass(frozen=True)
class Source:
    """A public repository: ``folder`` is the name of its clone."""

    folder: str
    repository: str
    licence: str
    files: tuple[Files, ...] = field(default_factory=tuple)

    def records(self, root: Path) -> Iterator[Record]:
        """Yield its records that are there, in the order of their names."""
        for group in self.files:
            for file in sorted((root / self.folder).glob(group.pattern)):
                name = str(file.relative_to(root / self.folder))
                yield Record(self, name, file, group.mapping, group.sample_rate_Hz)


def _columns(name: str, encoding: str, first_line: int, **columns: str) -> str:
    """Return a mapping file of columns by number: ``stroke="2 mm"``; a minus sign turns it."""
    lines = [f'name = "{name}"', "[file]", f'encoding = "{encoding}"', "header_line = 0"]
    lines += [f"first_line = {first_line}"]
    for channel, text in columns.items():
        number, unit = text.split()
        lines += [f"[columns.{channel}]", f"number = {abs(int(number))}", f'unit = "{unit}"']
        if number.startswith("-"):
            lines.append("invert = true")
    return "\n".join(lines) + "\n"


_VHB = "tensile machine's export"
_STEEL = "strain in 10⁻³ of 1 mm, stress as kN"
_CRANK = "crank dynamometer's log"
_CRANK_COLUMNS = {"time": "1 date-time", "stroke": "5 mm", "temperature": "7 °C"}

SOURCES = (
    Source(
        "Dataset-Friction-Damper-with-Backlash",
        "ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash",
        "CC BY-SA 4.0",
        (
            Files("data/dataset-1/characterization datasets/*.json", "banded rotary friction damper, sine"),
            Files("data/dataset-2/characterization datasets/*.json", "the same, three amplitudes"),
            Files("data/dataset-2/earthquake profiles/*.json", "the same, earthquake strokes"),
            Files("data/dataset-3/characterization tests/*.json", "the same, repeated"),
            Files("data/dataset-3/earthquake profiles/*.json", "the same, earthquake strokes"),
            Files("data/dataset-4/*.json", "the same, semi-active"),
        ),
    ),
    Source(
        "VHB4910_data",
        "Chongran-Zhao/VHB4910_data",
        "none stated",
        (
            Files(
                "uniaxial-loading-unloading/original_data/*_*d*.csv",
                "acrylic elastomer VHB 4910, pulled and released",
                _columns(_VHB, "Latin-1", 4, time="1 s", stroke="2 mm", force="3 N"),
            ),
            Files(
                "single-step-relaxation/original_data/*.csv",
                "the same, pulled and held",
                _columns(_VHB, "Latin-1", 3, time="1 s", stroke="2 mm", force="3 N"),
            ),
        ),
    ),
    Source(
        "hysteresis",
        "cslotboom/hysteresis",
        "Apache 2.0",
        (
            Files(
                "examples/02 Basic Usage/2.1 Basic Seismic Damper/xyTestData.csv",
                "seismic damper, digitised",
                _columns("stroke and force without headers", "UTF-8", 1, stroke="1 mm", force="2 kN"),
                1.0,
            ),
            Files(
                "examples/02 Basic Usage/2.[34] Seismic Damper ?/Hys?.csv",
                "seismic dampers, digitised",
                _columns("stroke and force without headers", "UTF-8", 1, stroke="1 mm", force="2 kN"),
                1.0,
            ),
            Files(
                "examples/02 Basic Usage/2.2 Hysteresis with Noisey Data/TS1_Experiment_Shear*.csv",
                "shear wall of timber, with noise",
                _columns("stroke and force without headers", "UTF-8", 1, stroke="1 m", force="2 N"),
                10.0,
            ),
            Files(
                "examples/03 Find Backbone of Experimental Data/3.2/SPC1.csv",
                "timber connection, cyclic",
                _columns("force and stroke", "UTF-8", 3, force="1 kN", stroke="2 mm"),
                10.0,
            ),
            Files(
                "test/trial2.csv",
                "timber connection, cyclic",
                _columns("stroke and force", "UTF-8", 3, stroke="1 mm", force="2 kN"),
                10.0,
            ),
        ),
    ),
    Source(
        "RESSPyLab",
        "AlbanoCastroSousa/RESSPyLab",
        "MIT",
        (
            Files(
                "examples/example_[12].csv",
                "structural steel, strain-controlled",
                _columns(_STEEL, "UTF-8", 2, stroke="1 m", force="2 kN"),
                1.0,
            ),
            Files(
                "examples/example_3.csv",
                "structural steel, strain-controlled",
                _columns(_STEEL, "UTF-8", 2, stroke="1 m", time="2 s", force="3 kN"),
            ),
        ),
    ),
    Source(
        "damper_characterization",
        "LucasDudley/damper_characterization",
        "none stated",
        (
            Files(
                "Test_Data/Phase1_temp_sensitivity/**/t*_[12][24]_[12][24]_s*.csv",
                "oil damper on a crank, heated",
                _columns(_CRANK, "UTF-8", 2, force="3 N", **_CRANK_COLUMNS),
            ),
            Files(
                "Test_Data/Phase1_temp_sensitivity/**/t*_18_18_*.csv",
                "the same, the load cell wired the other way",
                _columns(_CRANK, "UTF-8", 2, force="-3 N", **_CRANK_COLUMNS),
            ),
        ),
    ),
)


def every_record(root: Path) -> list[Record]:
    """Return all records that are there."""
    return [record for source in SOURCES for record in source.records(root)]
