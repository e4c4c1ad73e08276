"""A copy for others says nothing of the machine, and has every sample; what it says of the test is kept."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import Event
from bufferstand.recording.runfile.file import open_run, write_run
from bufferstand.recording.sealing.verification import verify
from bufferstand.recording.withholding.machine_facts import WITHHELD, without_machine
from bufferstand.recording.withholding.run_copy import copy_without_machine

from . import samples

SECRETS = (
    "stand7.example.net",
    "192.168.1.7",
    "10.0.0.5",
    "ttyUSB0",
    "jnovak",
    "buffers-2026",
    "15020",
    "::1",
)


def stand() -> dict[str, Any]:
    return {
        "stand": {"id": "P630", "name": "Stand at 1.5 m", "laboratory": "Laboratory"},
        "controller": {
            "host": "stand7.example.net",
            "port": 15020,
            "profile": "/home/jnovak/maps/mine.toml",
            "channel": [{"name": "force", "serial": "S-4711"}],
        },
        "amplifier": [{"kind": "gsv2", "port": "/dev/ttyUSB0", "modbus": {"host": "10.0.0.5"}}],
        "temperature": {"kind": "w1", "root": "/sys/bus/w1", "sensor": [{"rom": "28-1", "address": 3}]},
        "identity": {"device": "ring", "serial": "4711", "address": "stand7.example.net:15020 unit 1"},
    }


def document(**run: str) -> dict[str, Any]:
    return samples.metadata("run-1", status="complete", **run) | {
        "stand": stand(),
        "arming": {"subject": "specimen", "by": "jnovak", "how": "typed"},
        "edits": [{"by": "jnovak", "how": "typed", "files": {"stand.toml": '-host = "10.0.0.5"'}}],
        "campaign": {"id": "c", "file": "/home/jnovak/buffers-2026/c.toml", "stand": "../stand.toml"},
        "test": {"method": "EN 15551, 7.8.2.1; see https://doi.org/10.1000/182 and kN/mm"},
    }


EVENTS = (
    Event(9000.0, "note", "jnovak (192.168.1.7): cooled by fan; 7.8.2.1", {}),
    Event(9000.5, "wire", "stand7.example.net:15020 is silent", {"from": ["[::1]:502", "/dev/ttyUSB0"]}),
    Event(9001.0, "guard", "force 12.5 kN at 3/4 of the stroke", {"value": 12.5}),
)


def written(path: Path, **run: str) -> Path:
    return write_run(path, document(**run), samples.content(), EVENTS, samples.ANCHORS)


def test_nothing_of_the_machine_is_left_and_what_was_taken_out_is_said(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    keys = copy_without_machine(path, tmp_path / "copy.h5")
    copy = open_run(tmp_path / "copy.h5")
    said = json.dumps(copy.metadata) + str(copy.events)
    assert [secret for secret in SECRETS if secret in said] == []
    assert {
        "arming.by", "campaign.file", "campaign.stand", "edits[].by", "edits[].files", "events",
        "stand.amplifier[].modbus.host", "stand.amplifier[].port", "stand.controller.host",
        "stand.controller.port", "stand.controller.profile", "stand.identity.address",
        "stand.temperature.root",
    } == set(keys)  # fmt: skip
    original = open_run(path)
    assert copy.metadata["withheld"]["keys"] == keys
    assert copy.metadata["withheld"]["of_content_sha256"] == original.sha256
    assert verify(tmp_path / "copy.h5") == verify(path)


def test_every_sample_and_every_other_fact_is_as_recorded(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    copy_without_machine(path, tmp_path / "copy.h5")
    before, after = open_run(path), open_run(tmp_path / "copy.h5")
    assert after.samples_sha256 == before.samples_sha256
    assert after.anchors == before.anchors
    for channel in ("force", "stroke_1", "temperature_1"):
        assert np.array_equal(after.series(channel).value, before.series(channel).value)
        assert np.array_equal(after.series(channel).time_s, before.series(channel).time_s)
    for key in ("run", "software", "specimen", "step", "streams", "test"):
        assert after.metadata[key] == before.metadata[key], key
    assert after.metadata["stand"]["controller"]["channel"] == stand()["controller"]["channel"]
    assert after.metadata["stand"]["identity"] == {"device": "ring", "serial": "4711"}
    assert after.metadata["campaign"] == {"id": "c", "file": "c.toml", "stand": "stand.toml"}
    assert (
        after.events[0].text == f"{WITHHELD} ({WITHHELD}): cooled by fan; {WITHHELD}"
    )  # it may be an address
    assert after.events[2].text == EVENTS[2].text


def test_an_operator_is_withheld_where_it_is_the_name_of_the_login(tmp_path: Path) -> None:
    keys = copy_without_machine(written(tmp_path / "run-1.h5", operator="jnovak"), tmp_path / "copy.h5")
    assert "run.operator" in keys
    assert open_run(tmp_path / "copy.h5").metadata["run"]["operator"] == WITHHELD


def test_a_shipped_run_is_copied_whole_and_twice_to_the_same_bytes(tmp_path: Path) -> None:
    (path,) = (Path(__file__).parents[2] / "sample_runs" / "runs").glob("003*.h5")
    for name in ("one.h5", "two.h5"):
        copy_without_machine(path, tmp_path / name)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()
    assert "127.0.0.1" not in json.dumps(open_run(tmp_path / "one.h5").metadata)
    assert verify(tmp_path / "one.h5") == verify(path)


def test_a_file_that_is_not_as_recorded_is_not_copied(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    samples.flipped(path, 8 * (path.read_bytes().index(b"stand7") + 1))
    with pytest.raises(BadInput, match=r"run-1\.h5"):
        copy_without_machine(path, tmp_path / "copy.h5")
    assert not (tmp_path / "copy.h5").exists()


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("see ~/data and /home/a.b/x y", f"see {WITHHELD} and {WITHHELD} y"),
        (r"C:\Users\x\y.toml is there", f"{WITHHELD} is there"),
        (r"\\server\share\f.h5", WITHHELD),
        ("socket://10.1.1.1:4000 lost", f"{WITHHELD} lost"),
        ("EN 15551, 7.8.2.1, 5 mm/s; 1/2 of it; https://x.org/a/b", None),
        ("8.8.8.8:502 and 172.16.0.9", f"{WITHHELD} and {WITHHELD}"),
        ("999.1.1.1:5", None),
    ],
)
def test_texts_keep_what_is_no_path_and_no_address(text: str, left: str | None) -> None:
    kept, keys, _ = without_machine({"test": {"note": text}})
    assert kept["test"]["note"] == (text if left is None else left)
    assert keys == ([] if left is None else ["test.note"])
