"""What differs from what a campaign began with, in words."""

from __future__ import annotations

from bufferstand.daq.campaign_folder.changes import controller_changes, file_changes, software_changes
from bufferstand.daq.campaign_folder.inputs import FileEdit
from bufferstand.drivers.interfaces import Identity

STAND = """
[controller]
watchdog_s = 2.0  # {comment}
[[controller.channel]]
name = "force"
delay_s = {delay_s}
[controller.channel.calibration]
certificate = "{certificate}"
[[temperature.sensor]]
rom = "28-1"
role = "{role}"
"""
WAS = STAND.format(comment="", delay_s=0.004, certificate="D-K-1", role="specimen")
IS_NOW = STAND.format(comment="as agreed", delay_s=0.8, certificate="D-K-2", role="ambient")


def told(before: str | None, now: str | None) -> list[str]:
    return [change.text() for change in file_changes([FileEdit("stand.toml", before, now)])]


def test_every_setting_that_is_another_is_named_with_its_place_before_and_now() -> None:
    assert told(WAS, IS_NOW) == [
        "stand.toml: controller.channel[force].delay_s: 0.004 → 0.8",
        "stand.toml: controller.channel[force].calibration.certificate: D-K-1 → D-K-2",
        "stand.toml: temperature.sensor[28-1].role: specimen → ambient",
    ]
    assert told(WAS, WAS.replace("#", "# only a comment")) == []


def test_what_is_new_or_gone_is_told_and_so_is_what_is_no_toml() -> None:
    assert told("a = 1\nb = true\n", "b = false\nc = [1, 2]\n") == [
        "stand.toml: a: 1 → not given",
        "stand.toml: b: true → false",
        "stand.toml: c: not given → [1, 2]",
    ]
    assert told(None, "a = 1\n") == ["stand.toml: a: not given → 1"]
    assert told("a = 1\n", "a =\n") == ["stand.toml: as taken → edited"]


def test_tables_without_a_name_are_counted() -> None:
    steps = '[[step]]\nkind = "static"\n[[step]]\nkind = "harmonic"\n'
    assert told(steps, steps.replace("harmonic", "static")) == ["stand.toml: step[2].kind: harmonic → static"]


def test_of_a_controller_its_facts_count_and_not_where_it_is_reached() -> None:
    before = {
        "device": "ring",
        "address": "a:502",
        "serial": "1",
        "profile": "p sha256 aa",
        "sample_rate_Hz": 1000.0,
    }
    same = Identity("ring", "b:502", "1", "p sha256 aa", 1000.0)
    assert controller_changes(before, same) == ()
    other = Identity("ring", "a:502", "2", "p sha256 bb", 500.0)
    assert [(change.before, change.now) for change in controller_changes(before, other)] == [
        ("1", "2"), ("p sha256 aa", "p sha256 bb"), ("1000", "500"),
    ]  # fmt: skip
    assert controller_changes({}, other) == (), "nobody knows who it was"


def test_software_of_another_version_is_told() -> None:
    assert [change.text() for change in software_changes("0.1.0", "0.2.0")] == [
        "bufferstand’s version: 0.1.0 → 0.2.0"
    ]
    assert software_changes("0.1.0", "0.1.0") == software_changes("", "0.1.0") == ()
