"""The run file: what is in it, who may read it, and what is refused."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.hashes import canonical_json, content_hash
from bufferstand.recording.content import Segment, StreamContent, add_segment, gaps_of
from bufferstand.recording.runfile.clock_map import ClockMap
from bufferstand.recording.runfile.file import open_run, read_metadata, write_run

from . import samples


def written(path: Path, **changes: Any) -> Path:
    return write_run(
        path,
        changes.get("metadata", samples.metadata(status="complete")),
        changes.get("streams", samples.content()),
        changes.get("events", samples.EVENTS),
        changes.get("anchors", samples.ANCHORS),
    )


def rewritten(path: Path, change: Any) -> None:
    """Change a sealed file with h5py, as somebody else's tool would; hashes in the document stay right."""
    path.chmod(0o644)
    with h5py.File(path, "r+") as tree:
        change(tree)


def with_document(tree: Any, change: Any) -> None:
    document = json.loads(tree.attrs["metadata"])
    change(document)
    document.pop("content_sha256")
    document["content_sha256"] = content_hash(document)
    tree.attrs["metadata"] = canonical_json(document)


def test_plain_h5py_reads_it_all(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    sequence = np.arange(100)
    with h5py.File(path) as tree:
        assert tree.userblock_size == 512
        assert tree.attrs["NX_class"] == "NXroot"
        entry = tree[tree.attrs["default"]]
        assert entry.attrs["NX_class"] == "NXentry"
        plotted = entry[entry.attrs["default"]]
        assert plotted.attrs["NX_class"] == "NXdata"
        assert plotted[plotted.attrs["signal"]].shape == plotted[plotted.attrs["axes"]].shape
        for name, values in samples.counts(sequence).items():
            dataset = tree[f"entry/controller/{name}"]
            assert dataset.dtype == values.dtype
            assert np.array_equal(dataset[:], values)
            assert dataset.attrs["units"] == "count"
            assert dataset.fletcher32
            assert dataset.shuffle
            assert dataset.compression == "gzip"
            assert dataset.chunks == (100,)
        assert np.array_equal(tree["entry/controller/time_us"][:], samples.time_us(sequence))
        assert tree["entry/temperature_1/temperature_1"].compression is None  # noisy floats stay as they are
        assert tree["entry/events/text"].asstr()[1] == "Überschreitung"
        assert json.loads(tree["entry/events/data"].asstr()[0]) == {"cycle": 1}
        document = json.loads(tree.attrs["metadata"])
    assert document["run"]["operator"] == "Ä. Müller"
    facts = document["datasets"]["entry/controller/force"]
    assert facts["sha256"] == hashlib.sha256(samples.counts(sequence)["force"].tobytes()).hexdigest()


def test_the_user_block_can_be_checked_without_hdf5(tmp_path: Path) -> None:
    data = written(tmp_path / "run-1.h5").read_bytes()
    first, second, *_ = data[:512].decode().split("\n")
    assert first == "bufferstand/run 1"
    assert second.split(": ")[1] == hashlib.sha256(data[512:]).hexdigest()


def test_long_datasets_have_chunks_of_131072_rows(tmp_path: Path) -> None:
    rows = 131_072 + 10
    path = written(tmp_path / "run-1.h5", streams=samples.content(rows))
    with h5py.File(path) as tree:
        assert tree["entry/controller/force"].chunks == (131_072,)
    assert np.array_equal(
        open_run(path).streams["controller"].counts["force"], samples.counts(np.arange(rows))["force"]
    )


def test_same_content_same_bytes(tmp_path: Path) -> None:
    one = written(tmp_path / "run-1.h5").read_bytes()
    (tmp_path / "other").mkdir()
    assert written(tmp_path / "other" / "run-1.h5").read_bytes() == one


def test_sealed_files_are_read_only(tmp_path: Path) -> None:
    assert written(tmp_path / "run-1.h5").stat().st_mode & 0o222 == 0


def test_series_are_calibrated_and_corrected_for_their_delay(tmp_path: Path) -> None:
    run = open_run(written(tmp_path / "run-1.h5"))
    sequence = np.arange(100)
    force = run.series("force")
    counts = samples.counts(sequence)["force"]
    assert force.unit == "kN"
    assert np.array_equal(force.value, 0.25 + samples.FORCE_KN_PER_COUNT * counts)
    assert np.allclose(force.time_s, sequence * 1e-3 - samples.DELAY_S, rtol=0, atol=1e-12)
    assert abs(force.value).max() < 60.0  # 500 000 counts of 2**-20 · 100 kN: some 48 kN


def test_stroke_is_the_mean_at_the_mean_of_both_times(tmp_path: Path) -> None:
    run = open_run(written(tmp_path / "run-1.h5"))
    one, two, stroke = run.series("stroke_1"), run.series("stroke_2"), run.series("stroke")
    assert np.allclose(stroke.value, (one.value + two.value) / 2)
    assert np.allclose(stroke.time_s - one.time_s, -0.0001, atol=1e-12)
    assert stroke.unit == "mm"
    assert np.array_equal(run.stroke().value, stroke.value)


def test_stroke_of_one_channel_is_that_channel(tmp_path: Path) -> None:
    metadata = samples.metadata(status="complete")
    del metadata["streams"]["controller"]["channels"][2]
    full = samples.content()["controller"]
    counts = {name: full.counts[name] for name in ("force", "stroke_1")}
    path = written(
        tmp_path / "run-1.h5", metadata=metadata, streams={"controller": StreamContent(full.time, counts)}
    )
    run = open_run(path)
    assert np.array_equal(run.stroke().value, run.series("stroke_1").value)
    assert run.has("stroke")
    assert not run.has("stroke_2")
    assert list(run.streams) == ["controller"]  # the temperature never delivered


def test_facts_of_the_run(tmp_path: Path) -> None:
    run = open_run(written(tmp_path / "run-1.h5"))
    assert (run.id, run.kind, run.status, run.reason) == ("run-1", "harmonic", "complete", "")
    assert run.specimen["id"] == "B-17"
    assert run.step["name"] == "sine"
    assert run.sha256 == run.metadata["content_sha256"] == read_metadata(run.path)["content_sha256"]
    with pytest.raises(BadInput, match=r"no samples of the channel “speed”; it has force, stroke_1"):
        run.series("speed")
    with pytest.raises(BadInput, match="no stream “x”"):
        run.gaps("x")


def test_host_clock_is_mapped_by_the_anchor_of_least_latency(tmp_path: Path) -> None:
    run = open_run(written(tmp_path / "run-1.h5"))
    # Anchors: host − device is 4000.0005 s and 4000.02 s; the smaller is better. 9000 s → 4999.9995 s.
    assert run.series("temperature_1").time_s == pytest.approx(np.arange(5) - 0.0005, abs=1e-9)
    assert run.events[1].time_s == pytest.approx(1.4995, abs=1e-9)


def test_host_clock_without_anchors_is_refused_not_guessed(tmp_path: Path) -> None:
    run = open_run(written(tmp_path / "run-1.h5", anchors=()))
    with pytest.raises(BadInput, match=r"temperature_1 has no place .* no clock anchors"):
        run.series("temperature_1")
    assert run.events[0].time_s is None
    assert len(run.series("force").value) == 100


def test_without_a_device_clock_the_host_clock_is_the_runs(tmp_path: Path) -> None:
    streams = {"temperature_1": samples.content()["temperature_1"]}
    run = open_run(written(tmp_path / "run-1.h5", streams=streams, anchors=()))
    assert run.series("temperature_1").time_s == pytest.approx(np.arange(5))


@given(
    st.floats(-1e4, 1e4),
    st.floats(-5e-5, 5e-5),
    st.lists(st.floats(0.0, 0.02), min_size=2, max_size=200),
)
def test_offset_is_never_too_small_and_as_good_as_the_best_latency(
    offset_s: float, drift: float, latency_s: list[float]
) -> None:
    """The estimate lies between the truth and the truth plus the least latency plus one window's drift."""
    device_s = np.arange(len(latency_s)) * 2.0
    host_s = offset_s + device_s * (1 + drift) + np.array(latency_s)
    error = (
        ClockMap(np.rint(device_s * 1e6).astype(np.int64), host_s).to_device_s(
            offset_s + device_s * (1 + drift)
        )
        - device_s
    )
    bound = 60.0 * 5e-5 + 1e-6
    assert (error <= bound).all()
    assert (error >= -max(latency_s) - bound).all()
    if drift == 0.0 and len(latency_s) <= 30:
        assert error == pytest.approx(-min(latency_s), abs=1e-6)


def test_drift_of_a_long_run_is_followed() -> None:
    device_s = np.arange(0.0, 3600.0, 1.0)
    latency_s = np.random.default_rng(1).exponential(0.002, len(device_s))
    host_s = 100.0 + device_s * (1 + 50e-6) + latency_s
    error = (
        ClockMap(np.rint(device_s * 1e6).astype(np.int64), host_s).to_device_s(100.0 + device_s * (1 + 50e-6))
        - device_s
    )
    assert abs(error).max() < 0.004  # a constant offset would be wrong by 180 ms at the end


@given(
    st.lists(st.tuples(st.integers(1, 30), st.integers(-3, 9), st.integers(0, 5)), min_size=1, max_size=20)
)
def test_gaps_from_jumps_and_from_what_was_lost(blocks: list[tuple[int, int, int]]) -> None:
    segments: list[Segment] = []
    row, sequence = 0, 0
    expected = []
    for number, (rows, jump, lost) in enumerate(blocks):
        if number:
            sequence += jump
            if jump or lost:
                expected.append((row - 1, max(jump, lost, 0)))
        add_segment(segments, Segment(row, sequence, lost if number else 0))
        row, sequence = row + rows, sequence + rows
    assert gaps_of(segments) == expected


def test_sequence_of_rows_and_gaps(tmp_path: Path) -> None:
    full = samples.content()["controller"]
    stream = StreamContent(full.time, full.counts, (Segment(0, 10, 0), Segment(40, 57, 7)))
    run = open_run(written(tmp_path / "run-1.h5", streams={"controller": stream}))
    assert run.gaps("controller") == [(39, 7)]
    assert run.streams["controller"].sequence[[0, 39, 40, 99]].tolist() == [10, 49, 57, 116]


def test_an_empty_run_is_a_run(tmp_path: Path) -> None:
    run = open_run(written(tmp_path / "run-1.h5", streams={}, events=(), anchors=()))
    assert not run.has("force")
    assert run.events == ()
    assert dict(run.streams) == {}


# --- refusals -----------------------------------------------------------------------------------------


def test_a_newer_format_is_refused_by_its_number(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    rewritten(path, lambda tree: with_document(tree, lambda d: d.update(format_version=2, surprise=True)))
    with pytest.raises(
        BadInput, match=r"format version 2 is newer than this software understands \(1\); update"
    ):
        open_run(path)


@pytest.mark.slow
@pytest.mark.parametrize("version", [0, "1", 1.5, None, True])
def test_a_version_that_is_none_is_refused(tmp_path: Path, version: Any) -> None:
    path = written(tmp_path / "run-1.h5")
    rewritten(path, lambda tree: with_document(tree, lambda d: d.update(format_version=version)))
    with pytest.raises(BadInput, match=r"format version .* is none"):
        open_run(path)


def test_numbers_delivered_in_another_unit_than_counts_say_so(tmp_path: Path) -> None:
    metadata = samples.metadata(status="complete")
    metadata["streams"]["controller"]["raw_units"] = {"force": "V"}
    datasets = open_run(written(tmp_path / "run-1.h5", metadata=metadata)).metadata["datasets"]
    assert datasets["entry/controller/force"]["units"] == "V"
    assert datasets["entry/controller/stroke_1"]["units"] == "count"


@pytest.mark.parametrize("stated", ["V", ["V"], {"force": 1}, {"force": ""}, {"pressure_9": "V"}])
def test_raw_units_that_are_none_are_refused(tmp_path: Path, stated: Any) -> None:
    metadata = samples.metadata(status="complete")
    metadata["streams"]["controller"]["raw_units"] = stated
    with pytest.raises(BadInput, match=r"streams\.controller\.raw_units: .* is no table of a unit"):
        written(tmp_path / "run-1.h5", metadata=metadata)


def test_a_missing_unit_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    rewritten(path, lambda tree: tree["entry/controller/force"].attrs.pop("units"))
    with pytest.raises(BadInput, match=r"entry/controller/force: the dataset has no unit"):
        open_run(path)


@pytest.mark.slow
def test_another_unit_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    rewritten(path, lambda tree: tree["entry/controller/time_us"].attrs.modify("units", "ms"))
    with pytest.raises(BadInput, match=r"time_us: the dataset is in “ms”, its metadata say “us”"):
        open_run(path)

    def both(tree: Any) -> None:
        with_document(tree, lambda d: d["datasets"]["entry/controller/time_us"].update(units="ms"))

    rewritten(path, both)
    with pytest.raises(BadInput, match=r"time stamps are in “ms” instead of “us”"):
        open_run(path)


def test_a_channel_in_another_unit_is_refused(tmp_path: Path) -> None:
    metadata = samples.metadata(status="complete")
    metadata["streams"]["controller"]["channels"][0]["unit"] = "N"
    with pytest.raises(BadInput, match=r"channels\[0\]: channel force is in “N”; a force is kept in kN"):
        written(tmp_path / "run-1.h5", metadata=metadata)
    path = written(tmp_path / "run-1.h5")
    rewritten(path, lambda tree: with_document(tree, lambda d: d.update(streams=metadata["streams"])))
    with pytest.raises(BadInput, match="channel force is in “N”"):
        open_run(path)


def test_an_altered_number_is_refused_although_its_checksum_filter_is_right(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    rewritten(path, lambda tree: tree["entry/controller/force"].__setitem__(7, 1))
    with pytest.raises(BadInput, match=r"entry/controller/force: the numbers are not those that were sealed"):
        open_run(path)


def test_altered_metadata_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    rewritten(
        path, lambda tree: tree.attrs.modify("metadata", tree.attrs["metadata"].replace("B-17", "B-18"))
    )
    with pytest.raises(BadInput, match="the metadata were altered; restore"):
        open_run(path)


def test_a_removed_dataset_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    rewritten(path, lambda tree: tree.__delitem__("entry/controller/stroke_2"))
    with pytest.raises(BadInput, match=r"entry/controller/stroke_2: the dataset is missing"):
        open_run(path)


@pytest.mark.slow
def test_a_repacked_file_is_accepted(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    copy = tmp_path / "copy.h5"
    with h5py.File(path) as source, h5py.File(copy, "w") as target:
        for name in source:
            source.copy(name, target)
        target.attrs.update(source.attrs)
    assert open_run(copy).sha256 == open_run(path).sha256
    assert np.array_equal(open_run(copy).series("force").value, open_run(path).series("force").value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "no HDF5 file"),
        (b"time [s],force [kN]\n", "no HDF5 file"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "x.h5"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=message):
        open_run(path)


def test_foreign_hdf5_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as tree:
        tree["data"] = [1, 2, 3]
    with pytest.raises(BadInput, match="not a run file of bufferstand"):
        open_run(path)
    with pytest.raises(BadInput, match="no such file"):
        open_run(tmp_path / "none.h5")


@pytest.mark.slow
def test_a_truncated_file_is_refused_at_any_length(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    data = path.read_bytes()
    path.chmod(0o644)
    for kept in range(0, len(data), len(data) // 13):
        path.write_bytes(data[:kept])
        with pytest.raises(BadInput):
            open_run(path)


def test_what_metadata_must_say(tmp_path: Path) -> None:
    for change, message in [
        ({"kind": "sine"}, r"run\.kind: 'sine' is none of static, harmonic, impact, proof"),
        ({"kind": None}, r"run\.kind"),
        ({"status": "fine"}, r"run\.status"),
        ({"id": ""}, r"run\.id"),
        ({"reason": 5}, r"run\.reason: is no text"),
        ({"note": float("nan")}, r"run\.note: is no number"),
        ({"note": object()}, "cannot be written as JSON"),
    ]:
        metadata = samples.metadata(**({"status": "complete"} | change))
        with pytest.raises(BadInput, match=message):
            written(tmp_path / "run-1.h5", metadata=metadata)
    metadata = samples.metadata(status="complete")
    metadata["streams"]["temperature_1"]["channels"][0]["name"] = "force"
    with pytest.raises(BadInput, match="channel force is in stream controller already"):
        written(tmp_path / "run-1.h5", metadata=metadata)
    metadata = samples.metadata(status="complete")
    metadata["streams"]["controller"]["clock"] = "wall"
    with pytest.raises(BadInput, match="clock"):
        written(tmp_path / "run-1.h5", metadata=metadata)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@given(
    st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=4),
    st.floats(-0.01, 0.01),
    st.integers(0, 2**45),
)
def test_series_follow_the_channels_facts(coefficients: list[float], delay_s: float, start_us: int) -> None:
    """The reading of any calibration and delay, whatever the device's clock says: time-shift invariance."""
    import tempfile

    channel = Channel(
        name="force",
        quantity="force",
        unit="kN",
        delay_s=delay_s,
        calibration=Calibration(coefficients=tuple(coefficients)),
    )
    metadata = samples.metadata(status="complete")
    metadata["streams"] = {
        "controller": {"clock": "device", "rate_Hz": 1000.0, "channels": [channel.model_dump(mode="json")]}
    }
    raw = np.arange(-5, 6, dtype=np.int16)
    stamps = start_us + 1000 * np.arange(11, dtype=np.int64)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run-1.h5"
        write_run(path, metadata, {"controller": StreamContent(stamps, {"force": raw})})
        series = open_run(path).series("force")
    expected = np.polynomial.polynomial.polyval(raw.astype(float), coefficients)
    assert series.value == pytest.approx(expected, rel=1e-12, abs=1e-9)
    assert series.time_s == pytest.approx(np.arange(11) * 1e-3 - delay_s, abs=1e-12)
