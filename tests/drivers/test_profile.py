from __future__ import annotations

import re
from pathlib import Path

import pytest

from bufferstand.drivers.register_maps.profile import RING_REGISTERS, SHIPPED, Profile, load_profile
from bufferstand.foundation.errors import BadInput

EXECUTE = 'name = "execute"\naddress = 84\ntype = "u16"\naccess = "rw"'
RING = (SHIPPED / "ring.toml").read_text(encoding="utf-8")


def test_shipped_ring_fits_one_transaction(profile: Profile) -> None:
    # 9 registers of header and 14 samples of 8 are 121; FC23 of pyModbusTCP's server gives 123 at most
    assert profile.ring.header_words == 9
    assert profile.ring.sample_words == 8
    assert profile.ring.samples_per_block == 14
    assert profile.ring.registers == 121


def test_every_register_of_the_driver_is_there(profile: Profile) -> None:
    assert set(RING_REGISTERS) <= set(profile.registers)


def test_blocks_have_no_holes(profile: Profile) -> None:
    for first, last in (
        ("device_type", "sample_rate"),
        ("status_word", "tick"),
        ("command_sequence", "static_pause"),
    ):
        block = profile.block(first, last)
        assert sum(place.words for place in block.places) == block.words
        assert block.address == profile.find(first).address


def test_register_codec_follows_the_word_order(profile: Profile) -> None:
    assert profile.encode("test_integer", 0x12345678) == [0x1234, 0x5678]
    assert profile.decode("test_float", profile.encode("test_float", -1234.5)) == -1234.5


def changed(tmp_path: Path, old: str, new: str) -> Path:
    assert old in RING
    path = tmp_path / "mine.toml"
    path.write_text(RING.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("address = 17\n", "address = 16\n", "“state” and “status_word” overlap at address 16"),
        ("address = 260\n", "address = 257\n", "“ring_acknowledge” and the ring's window overlap at"),
        ('name = "mean"', 'name = "speed"', "register “speed” is there twice"),
        ('name = "mean"', 'name = "middle"', "register “mean” is missing"),
        ("address = 74\n", "address = 174\n", "“command_sequence” to “frequency” must follow each other"),
        ("accept = [2]", "accept = [70000]", "does not fit u16"),
        ("expect = -1234.5", "expect = -1234.5\naccept = [1]", "“test_float” accepts other values"),
        ("expect = 3\naccept", "accept", "“profile_version” accepts other values, so it must expect one"),
        ("registers = 121", "registers = 16", "not one sample fits in 16 registers"),
        ('"tick:u32", ', "", "a sample of the ring lacks “tick:u32”"),
        ('"count:u16", ', "", "the ring's header lacks “count”"),
        ("expect = 0x4253", "expect = 0x14253", "82515 does not fit u16"),
        ("address = 16\n", "address = 65536\n", "write a whole number from 0 to 65535"),
        ('type = "f32"', 'type = "f64"', "write “u16”, “i16”, “u32”, “i32” or “f32”"),
        ('word_order = "big"', 'word_order = "middle"', "write “big” or “little”"),
        (EXECUTE, EXECUTE.replace("rw", "r"), "register “execute” must have access “rw”"),
    ],
)  # fmt: skip
def test_a_broken_profile_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(BadInput, match=re.escape(message)) as caught:
        load_profile(str(changed(tmp_path, old, new)))
    assert "mine.toml" in str(caught.value)


def test_unknown_profile_names_those_shipped() -> None:
    with pytest.raises(BadInput, match="there is no register profile “rong”; shipped are: polling, ring"):
        load_profile("rong")


def test_own_profile_is_found_beside_the_stand_file(tmp_path: Path, profile: Profile) -> None:
    changed(tmp_path, 'word_order = "big"', 'word_order = "little"')
    own = load_profile("mine.toml", tmp_path)
    assert own.encode("test_integer", 0x12345678) == [0x5678, 0x1234]
    assert own.hash != profile.hash
    with pytest.raises(BadInput, match=r"there is no register profile .*other\.toml; mend the path"):
        load_profile("other.toml", tmp_path)


def test_only_a_device_of_a_late_enough_edition_can_change_a_running_sine(
    profile: Profile, tmp_path: Path
) -> None:
    assert [profile.adjusts(version) for version in (2, 3, 4)] == [False, True, True]
    silent = load_profile(str(changed(tmp_path, "adjust_from = 3\n", "")))
    assert not silent.adjusts(3)
    assert profile.version == 3
