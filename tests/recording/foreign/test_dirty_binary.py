"""TDMS and MDF as they come from real rigs: read right, or refused with the place."""

from __future__ import annotations

import shutil
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asammdf import MDF, Signal
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from bufferstand.foundation import BadInput, how_to_add
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file

from . import makers
from .attempts import mapping, read, refused

WAVE = {"wf_increment": 0.01, "unit_string": "mm"}
KN = {"wf_increment": 0.01, "unit_string": "kN"}
RAMP = np.arange(50.0)


# --- TDMS ---------------------------------------------------------------------------------------------


def tdms(tmp_path: Path, *segments: list[ChannelObject]) -> Path:
    path = tmp_path / "record.tdms"
    with TdmsWriter(str(path)) as writer:
        for segment in segments:
            writer.write_segment(segment)
    return path


def channel(name: str, values: Any, properties: dict[str, Any] | None = None, group: str = "G") -> Any:
    return ChannelObject(group, name, np.asarray(values), properties or {})


def test_tdms_of_two_groups_of_the_same_names(tmp_path: Path) -> None:
    both = [
        channel(name, RAMP + shift, properties, group)
        for group, shift in (("Raw", 0.0), ("Filtered", 100.0))
        for name, properties in (("stroke", WAVE), ("force", KN))
    ]
    path = tdms(tmp_path, both)
    message = refused(path)
    assert "two columns mean “stroke_1”: “Filtered/stroke”, “Raw/stroke”" in message
    assert "or read one group with --group NAME" in message
    run, _ = read(path, groups=["Filtered", "Filtered"])
    assert run.series("force").value[0] == 100.0
    assert run.metadata["original"]["groups_left_out"] == ["Raw"]
    assert run.metadata["original"]["columns"]["force"]["unit_from"] == "unit_string"
    with pytest.raises(BadInput, match="no such group; the groups are “Filtered”, “Raw”"):
        read(path, groups=["X"])
    shutil.rmtree(tmp_path / "out")
    run, _ = read(path, column={"stroke": "Raw/stroke", "force": "Raw/force"})
    assert run.series("force").value[0] == 0.0


def test_tdms_cut_in_the_middle_keeps_what_is_whole(tmp_path: Path) -> None:
    path = tdms(tmp_path, [channel("stroke", RAMP, WAVE), channel("force", RAMP, KN)])
    whole = path.read_bytes()
    path.write_bytes(whole[: -8 * 20])
    run, warnings = read(path)
    assert "the last segment is not complete: the recording was cut short" in warnings
    assert "group “G”, channel “stroke”: 20 sample(s) more than the others, left out" in warnings
    assert run.series("force").value.tolist() == RAMP[:30].tolist()


def test_a_stale_index_file_is_not_believed(tmp_path: Path) -> None:
    path = tdms(tmp_path, [channel("stroke", RAMP, WAVE), channel("force", RAMP, KN)])
    other = tmp_path / "other"
    other.mkdir()
    longer = other / "record.tdms"
    with TdmsWriter(str(longer), index_file=True) as writer:
        writer.write_segment(
            [channel("force", np.zeros(99), KN), channel("stroke", np.zeros(99, dtype=np.int16), WAVE)]
        )
    shutil.copy(f"{longer}_index", f"{path}_index")
    run, _ = read(path)
    assert run.series("force").value.tolist() == RAMP.tolist()
    message = refused_elsewhere(Path(f"{path}_index"), tmp_path / "elsewhere")
    assert "this is the index of a TDMS file, without data; name the .tdms file" in message


def refused_elsewhere(path: Path, out: Path) -> str:
    with pytest.raises(BadInput) as caught:
        import_file(path, out)
    assert not out.exists()
    return caught.value.message()


def test_tdms_without_waveform_needs_a_rate(tmp_path: Path) -> None:
    path = tdms(tmp_path, [channel("stroke [mm]", RAMP), channel("force [kN]", RAMP)])
    assert "channel “stroke [mm]”: the channel has no time (no wf_increment)" in refused(path)
    run, _ = read(path, sample_rate_hz=100.0)
    assert run.series("force").time_s[1] == 0.01


def test_tdms_with_a_time_channel(tmp_path: Path) -> None:
    stamps = np.datetime64("2026-03-05T14:00:00") + (np.arange(50) * 20).astype("timedelta64[ms]")
    path = tdms(
        tmp_path, [channel("time", stamps), channel("stroke [mm]", RAMP), channel("force [kN]", RAMP)]
    )
    run, _ = read(path, unit={"time": "date-time"})
    assert run.series("force").time_s == pytest.approx(np.arange(50) * 0.02, abs=1e-9)
    assert run.metadata["run"]["started_utc"] == "2026-03-05T14:00:00+00:00"


@pytest.mark.parametrize("unit", [{}, {"unit_string": "ms"}])
def test_tdms_dates_and_times_are_in_no_unit(tmp_path: Path, unit: dict[str, str]) -> None:
    """They are seconds when they are read: a unit that is stated beside them scales nothing."""
    stamps = np.datetime64("2026-03-05T14:00:00") + (np.arange(50) * 20).astype("timedelta64[ms]")
    rest = [channel("stroke [mm]", RAMP), channel("force [kN]", RAMP)]
    run, _ = read(tdms(tmp_path, [channel("time", stamps, unit), *rest]))
    assert run.series("force").time_s == pytest.approx(np.arange(50) * 0.02, abs=1e-9)
    assert run.metadata["original"]["columns"]["time"]["unit_from"] == "samples"


def test_dates_and_times_are_refused_where_numbers_are_wanted_and_the_other_way_round(tmp_path: Path) -> None:
    stamps = np.datetime64("2026-03-05T14:00:00") + (np.arange(50) * 20).astype("timedelta64[ms]")
    rest = [channel("stroke [mm]", RAMP), channel("force [kN]", RAMP)]
    path = tdms(tmp_path, [channel("time", stamps), *rest])
    assert "group “G”, channel “time”: its samples are dates and times" in refused(path, unit={"time": "ms"})
    path = tdms(tmp_path, [channel("stroke [mm]", stamps, WAVE), channel("force", RAMP, KN)])
    assert "group “G”, channel “stroke [mm]”: its samples are dates and times" in refused(path)
    path = tdms(tmp_path, [channel("time", RAMP), *rest])
    assert "channel “time”: its samples are no dates and times" in refused(path, unit={"time": "date-time"})
    used = [("stroke", "mm"), ("force", "kN"), ("t", "s")]
    path = mdf(tmp_path / "record.mf4", [signal(name, RAMP, unit) for name, unit in used])
    message = refused(path, column={"time": "t"}, unit={"time": "date-time"})
    assert "channel “t”: its samples are no dates and times; say the unit of its numbers" in message


COUNTS = KN | {"NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": 1}
LINEAR = {
    "NI_Scale[0]_Scale_Type": "Linear",
    "NI_Scale[0]_Linear_Slope": 2.0,
    "NI_Scale[0]_Linear_Y_Intercept": 3.0,
}


@pytest.mark.parametrize("level", ["channel", "group", "file"])
def test_tdms_counts_of_an_unknown_scaling_are_refused(tmp_path: Path, level: str) -> None:
    scales = {"NI_Number_Of_Scales": 2, "NI_Scale[1]_Scale_Type": "Foo"} | LINEAR
    stated = {name: scales if name == level else {} for name in ("channel", "group", "file")}
    force = channel("force", np.arange(50, dtype=np.int16), KN | stated["channel"])
    segment = [
        RootObject(stated["file"]),
        GroupObject("G", stated["group"]),
        channel("stroke", RAMP, WAVE),
        force,
    ]
    message = refused(tdms(tmp_path, segment))
    assert "its samples are counts, with a scaling that is not known here: “Linear”, “Foo”" in message
    assert "export it with the scaled values" in message


def test_tdms_counts_of_a_known_scaling_and_samples_that_are_scaled_already(tmp_path: Path) -> None:
    counts = np.arange(50, dtype=np.int16)
    path = tdms(tmp_path, [channel("stroke", RAMP, WAVE), channel("force", counts, COUNTS | LINEAR)])
    assert read(path)[0].series("force").value.tolist() == (2.0 * RAMP + 3.0).tolist()
    scaled = COUNTS | {"NI_Scale[0]_Scale_Type": "Foo", "NI_Scaling_Status": "scaled"}
    other = tmp_path / "other"
    other.mkdir()
    path = tdms(other, [channel("stroke", RAMP, WAVE), channel("force", RAMP, scaled)])
    assert read(path)[0].series("force").value.tolist() == RAMP.tolist()


def test_tdms_channels_that_cannot_be_used(tmp_path: Path) -> None:
    texts = [channel("stroke", RAMP, WAVE), channel("force", ["a", "b"], KN)]
    assert "group “G”, channel “force”: its samples are no numbers" in refused(tdms(tmp_path, texts))
    spectrum = [channel("stroke", RAMP, WAVE), channel("force", RAMP, KN | {"wf_xunit_string": "Hz"})]
    assert "it runs over “Hz”, not over time" in refused(tdms(tmp_path, spectrum))
    unit = [channel("stroke", RAMP, WAVE), channel("force", RAMP, {"wf_increment": 0.01})]
    assert "group “G”, channel “force”: this column has no unit" in refused(tdms(tmp_path, unit))
    rated = tdms(tmp_path, [channel("stroke", RAMP, WAVE), channel("force", RAMP, KN)])
    assert "the record has its own time (waveform" in refused(rated, sample_rate_hz=10.0)


def test_tdms_channels_of_different_rates_keep_their_own_instants(tmp_path: Path) -> None:
    rates = [channel("force", RAMP, KN | {"wf_increment": 0.02}), channel("stroke", RAMP, WAVE)]
    run, warnings = read(tdms(tmp_path, rates))
    assert {name: list(stream.channels) for name, stream in run.streams.items()} == {
        "record": ["stroke_1"],
        "record_2": ["force"],
    }
    assert run.series("stroke").time_s.tolist() == (0.01 * np.arange(50)).tolist()
    assert run.series("force").time_s.tolist() == (0.02 * np.arange(50)).tolist()
    assert warnings == ("each at its own instants: stroke_1 at 100 Hz, force at 50 Hz",)


def test_tdms_stroke_and_force_by_different_clocks_are_refused(tmp_path: Path) -> None:
    """One group has a channel of times, the other a waveform: where one's time is 0, nothing says."""
    segment = [
        channel("stroke", RAMP, {"unit_string": "mm"}),
        channel("time", RAMP, {"unit_string": "s"}),
        channel("force", RAMP, KN | {"wf_increment": 0.02}, group="H"),
    ]
    message = refused(tdms(tmp_path, segment))
    assert "no clock in common (time from column, and from waveform (wf_increment))" in message


@pytest.mark.slow
@pytest.mark.parametrize("share", [pytest.param(0.1, marks=pytest.mark.long), 0.8])
def test_broken_files_are_refused_or_read_in_part_and_never_a_traceback(tmp_path: Path, share: float) -> None:
    """Cut off, and with bytes overwritten, at many places: either numbers, or one message."""
    random = np.random.default_rng(round(share * 100))
    for form in ("TDMS", "MDF4", "Excel"):
        name, write = makers.FORMATS[form]
        whole = write(tmp_path / name).read_bytes()
        for number in range(6):
            broken = bytearray(whole)
            if number < 3:
                del broken[int(len(whole) * share) + number :]
            else:
                place = int(random.integers(4, max(5, int(len(whole) * share))))
                broken[place : place + 3] = random.bytes(3)
            path = tmp_path / f"{form}-{number}-{name}"
            path.write_bytes(bytes(broken))
            try:
                run, _ = read(path)
            except BadInput as error:
                assert str(path) in error.message()  # noqa: PT017 - either is right
            else:
                assert run.streams["record"].rows > 0


# --- MDF ----------------------------------------------------------------------------------------------


def mdf(path: Path, *groups: list[Signal], **save: Any) -> Path:
    file = MDF(version="4.10")
    for group in groups:
        file.append(group)
    saved = Path(file.save(path, overwrite=True, **save))
    file.close()
    return saved


def signal(name: str, values: Any, unit: str, step_s: float = 0.01, **facts: Any) -> Signal:
    samples = np.asarray(values)
    return Signal(samples, np.arange(len(samples)) * step_s, name=name, unit=unit, **facts)


@pytest.mark.parametrize("compression", [0, 1, 2])
def test_mdf_of_every_compression(tmp_path: Path, compression: int) -> None:
    path = makers.mdf(tmp_path / "record.mf4", compression=compression)
    run, warnings = read(path)
    assert run.series("force").value == pytest.approx(makers.motion()["force"], rel=1e-12)
    assert warnings == ()


def test_an_mdf_3_file(tmp_path: Path) -> None:
    path = makers.mdf(tmp_path / "record.mdf", compression=0, version="3.30")
    run, _ = read(path)
    assert run.series("force").value == pytest.approx(makers.motion()["force"], rel=1e-9)


def test_an_mdf_file_that_was_not_finalised(tmp_path: Path) -> None:
    """As a logger leaves it whose power was cut: cycle counters and length of the last data are not set."""
    path = mdf(tmp_path / "record.mf4", [signal("stroke", RAMP, "mm"), signal("force", RAMP, "kN")])
    raw = bytearray(path.read_bytes())
    raw[0:8] = b"UnFinMF "
    struct.pack_into("<H", raw, 60, 0b101)
    group = raw.find(b"##CG")
    links = struct.unpack_from("<Q", raw, group + 16)[0]
    struct.pack_into("<Q", raw, group + 24 + 8 * links + 8, 0)  # cycle count
    data = raw.find(b"##DT")
    struct.pack_into("<Q", raw, data + 8, 24)  # length
    path.write_bytes(bytes(raw))
    before = path.read_bytes()
    run, warnings = read(path)
    assert run.series("force").value[: len(RAMP)].tolist() == RAMP.tolist()
    assert "the file was not finalised: the recording may have been cut short" in warnings
    assert path.read_bytes() == before


def test_mdf_samples_that_are_marked_invalid_are_no_values(tmp_path: Path) -> None:
    invalid = np.zeros(50, dtype=bool)
    invalid[[3, 4]] = True
    path = mdf(
        tmp_path / "record.mf4",
        [signal("stroke", RAMP, "mm"), signal("force", RAMP, "kN", invalidation_bits=invalid)],
    )
    run, warnings = read(path)
    assert np.flatnonzero(np.isnan(run.series("force").value)).tolist() == [3, 4]
    assert len(run.series("force").value) == 50
    assert "force: 2 empty or NaN cell(s), the first in sample 4" in warnings


def test_mdf_signals_each_in_a_group_of_its_own(tmp_path: Path) -> None:
    groups = [[signal("stroke", RAMP, "mm")], [signal("force", RAMP, "kN")]]
    run, _ = read(mdf(tmp_path / "record.mf4", *groups))
    assert list(run.streams) == ["record"]
    shifted = [[signal("stroke", RAMP, "mm")], [signal("force", RAMP, "kN", 0.02)]]
    other = tmp_path / "other"
    other.mkdir()
    run, warnings = read(mdf(other / "record.mf4", *shifted))
    assert [list(stream.channels) for stream in run.streams.values()] == [["stroke_1"], ["force"]]
    assert run.series("force").time_s.tolist() == (0.02 * np.arange(50)).tolist()
    assert warnings == ("each at its own instants: stroke_1 at 100 Hz, force at 50 Hz",)


def master_in(unit: str, path: Path, step: float) -> Path:
    """Write a record of 0.01 s steps whose master channel counts in another unit, as some loggers do."""
    file = MDF(version="4.10")
    file.append([signal("stroke", RAMP, "mm", step), signal("force", RAMP, "kN", step)])
    file.groups[0].channels[0].unit = unit
    saved = Path(file.save(path, overwrite=True))
    file.close()
    return saved


@pytest.mark.parametrize(
    ("unit", "step", "told"),
    [
        ("s", 0.01, ""),
        ("sec", 0.01, ""),
        ("", 0.01, ""),
        ("ms", 10.0, " in ms"),
        ("msec", 10.0, " in ms"),
        ("min", 0.01 / 60.0, " in min"),
    ],
)
def test_mdf_time_in_the_unit_of_its_master_channel(
    tmp_path: Path, unit: str, step: float, told: str
) -> None:
    run, warnings = read(master_in(unit, tmp_path / "record.mf4", step))
    assert run.series("force").time_s == pytest.approx(RAMP * 0.01, abs=1e-12)
    assert run.streams["record"].rate_Hz == pytest.approx(100.0)
    assert warnings == ()
    assert run.metadata["original"]["time_from"]["record"] == f"master channel{told}"


def test_mdf_masters_of_other_units_share_a_stream_if_their_times_are_equal(tmp_path: Path) -> None:
    file = MDF(version="4.10")
    file.append([signal("stroke", RAMP, "mm", 0.25)])
    file.append([signal("force", RAMP, "kN", 250.0)])
    file.groups[1].channels[0].unit = "ms"
    path = Path(file.save(tmp_path / "record.mf4", overwrite=True))
    file.close()
    run, _ = read(path)
    assert list(run.streams) == ["record"]
    assert run.series("force").time_s.tolist() == (RAMP * 0.25).tolist()


def test_mdf_master_channel_of_an_unknown_unit(tmp_path: Path) -> None:
    message = refused(master_in("fortnight", tmp_path / "record.mf4", 1.0))
    assert "unit “fortnight” is not understood for time (master channel “time”)" in message
    assert "export the record with its time in seconds" in message


def test_stated_numbers_that_mean_no_value(tmp_path: Path) -> None:
    """As in a table; a number of single precision is the nearest one to the number stated."""
    forces = RAMP.copy()
    forces[3] = -9999.9
    single = signal("force", forces.astype("f4"), "kN")
    path = mdf(tmp_path / "record.mf4", [signal("stroke", RAMP, "mm"), single])
    run, _ = read(path, mapping=mapping(path, "[file]", 'missing = ["-9999.90", "n/a", "1e99"]'))
    assert np.flatnonzero(np.isnan(run.series("force").value)).tolist() == [3]
    other = tmp_path / "other"
    other.mkdir()
    counts = np.where(RAMP == 3, -9999, RAMP).astype(np.int16)
    path = tdms(other, [channel("stroke", RAMP, WAVE), channel("force", counts, KN)])
    run, _ = read(path, mapping=mapping(path, "[file]", 'missing = ["-9999.0"]'))
    assert np.flatnonzero(np.isnan(run.series("force").value)).tolist() == [3]


def test_mdf_channels_that_are_texts(tmp_path: Path) -> None:
    words = signal("force", np.array([b"low", b"high"] * 25), "kN", encoding="utf-8")
    path = mdf(tmp_path / "record.mf4", [signal("stroke", RAMP, "mm"), words])
    assert "channel “force”: its samples are no numbers" in refused(path)


# --- kinds --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("library", "form"), [("nptdms", "TDMS"), ("asammdf", "MDF4"), ("openpyxl", "Excel")]
)
def test_a_missing_library_is_named_with_its_extra(
    tmp_path: Path, library: str, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, write = makers.FORMATS[form]
    path = write(tmp_path / name)
    monkeypatch.setitem(sys.modules, library, None)
    message = refused(path)
    assert f"needs the library {library}, which is not installed" in message
    assert message.endswith(f"install it: {how_to_add('foreign')}")


def test_options_of_other_kinds_of_record(tmp_path: Path) -> None:
    path = makers.csv_comma(tmp_path / "record.csv")
    assert "a sheet is named, and this is no workbook" in refused(path, sheet="Data")
    assert "a group of channels is named, and this is a text file" in refused(path, groups=["G"])
    made = import_file(path, tmp_path / "runs", ImportOptions(kind="harmonic"))
    assert "this is an HDF5 file, maybe a run file already" in refused(made.path)
