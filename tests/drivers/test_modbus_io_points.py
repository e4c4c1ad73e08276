"""How registers of a described device become values: the manuals' own numbers, and what must always hold."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.acquisition.modbus_io.description import (
    SHIPPED,
    Description,
    load_description,
    shipped_descriptions,
)
from bufferstand.drivers.acquisition.modbus_io.points import Place, Point, Reading, resolved_points
from bufferstand.drivers.acquisition.modbus_io.reads import Read, planned_reads
from bufferstand.foundation.errors import BadInput
from tests.peers.modbus_io.wago import ten_volt_word

SOURCE = {"document": "a manual", "edition": "1", "place": "p. 1"}
ANSWERS: dict[str, dict[str, int | float | str]] = {
    "adam-6024": {"unit": "V", "unit_per_count": 20.0 / 65535.0, "value_at_zero": -10.0},
    "beckhoff-ek9000-el3002": {"first_word": 0, "volt_per_count": 10.0 / 32767.0},
    "beckhoff-kl3132": {"first_word": 0},
    "beckhoff-kl3202": {"first_word": 0, "celsius_per_count": 0.1},
    "eagle-ei": {"word_order": "big", "table": "holding"},
    "esera-1wire": {"address_shift": 0, "celsius_per_count": 0.01, "table": "holding"},
    "laumas": {"unit_per_digit": 0.1, "unit": "kg"},
    "wago-750-10v": {"first_word": 0},
    "wago-750-471": {"first_word": 0},
    "wago-750-pt100": {"first_word": 0},
    "wb-m1w2": {},
}


def points_of(name: str, **other: int | float | str) -> dict[str, Point]:
    return resolved_points(load_description(name, Path()), {**ANSWERS[name], **other})


def shows(point: Point, *words: int, status: Mapping[int, int] | None = None) -> Reading:
    """Return what a point shows: its own registers, and others by their address (0 elsewhere)."""
    content: dict[Place, Sequence[int]] = {
        place: [(status or {}).get(place.address, 0)] for place in (*point.value_places, *point.status_places)
    }
    content[point.place] = words
    return point.read(content)


def described(point: dict[str, Any], **more: Any) -> Point:
    """Return the only point of a description."""
    content = {"id": "x", "edition": 1, "title": "x", "wires": ["tcp"], "source": [SOURCE], "point": [point]}
    (made,) = resolved_points(Description.model_validate({**content, **more}), {}).values()
    return made


def test_every_shipped_description_is_answered_here_and_says_what_it_is_made_from() -> None:
    assert set(ANSWERS) == set(shipped_descriptions())
    for name in shipped_descriptions():
        found = load_description(name, Path())
        assert found.id == name
        assert not found.confirmed  # nobody has had one of these devices in hand
        assert all(one.document and one.edition and one.place for one in found.source)
        assert points_of(name)
        text = (SHIPPED / f"{name}.toml").read_text(encoding="utf-8")
        assert text.startswith("# ")


# --- the manuals' own numbers ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("word", "celsius"),
    [(0xFC18, -100.0), (0x0000, 0.0), (0x03E8, 100.0), (0x07D0, 200.0), (0x1388, 500.0), (0x1F40, 800.0)],
)
def test_wago_pt100_by_table_59(word: int, celsius: float) -> None:
    assert shows(points_of("wago-750-pt100")["AI1"], word).value == pytest.approx(celsius)


@pytest.mark.parametrize(("word", "said"), [(0x2134, "a wire is broken"), (0xF830, "short-circuited")])
def test_wago_pt100_has_its_faults_at_the_ends(word: int, said: str) -> None:
    found = shows(points_of("wago-750-pt100")["AI2"], word)
    assert math.isnan(found.value)
    assert said in found.what[0]


@pytest.mark.parametrize(
    ("word", "volts"),
    [(0x8000, -10.0), (0xA000, -7.5), (0xC000, -5.0), (0xE000, -2.5), (0, 0.0), (0x2000, 2.5), (0x4000, 5.0)],
)
def test_wago_10_v_by_table_13(word: int, volts: float) -> None:
    point = points_of("wago-750-10v")["AI1"]
    assert shows(point, word, status={0: word}).value == volts
    assert ten_volt_word(volts) == word
    assert shows(point, 0x7FF8, status={0: 0x7FF8}).value == pytest.approx(10.0, abs=0.0025)


@pytest.mark.parametrize("word", [0x8001, 0x7FF9])
def test_wago_10_v_out_of_its_range_is_no_value(word: int) -> None:
    found = shows(points_of("wago-750-10v")["AI1"], word, status={0: word})
    assert math.isnan(found.value)
    assert "outside of ± 10 V" in found.what[0]


@pytest.mark.parametrize(
    ("word", "volts"),
    [(0xFFF8, -10.0), (0xCCC8, -6.0), (0x9998, -2.0), (0, 0.0), (0x1998, 2.0), (0x4CC8, 6.0), (0x7FF8, 10.0)],
)
def test_wago_amount_and_sign_by_table_33(word: int, volts: float) -> None:
    found = shows(points_of("wago-750-471")["AI3"], word, status={2: word})
    assert found.value == pytest.approx(volts, abs=0.0025)


@pytest.mark.parametrize("word", [0xFFFB, 0x7FFB])
def test_wago_amount_and_sign_says_an_overload(word: int) -> None:
    assert math.isnan(shows(points_of("wago-750-471")["AI3"], word, status={2: word}).value)


@pytest.mark.parametrize(
    ("word", "celsius"),
    [
        (0xF63C, -250.0),
        (0xFC18, -100.0),
        (0xFFFF, -0.1),
        (0, 0.0),
        (1, 0.1),
        (0x03E8, 100.0),
        (0x2134, 850.0),
    ],
)
def test_beckhoff_tenths_of_a_degree(word: int, celsius: float) -> None:
    assert shows(points_of("beckhoff-kl3202")["AI2"], word).value == pytest.approx(celsius)


@pytest.mark.parametrize(("bit", "said"), [(0, "below"), (1, "over"), (6, "error"), (7, "register")])
def test_beckhoff_status_makes_a_value_none(bit: int, said: str) -> None:
    second = points_of("beckhoff-kl3202")["AI2"]
    assert second.place == Place("input", 3)
    found = shows(second, 200, status={2: 1 << bit})
    assert math.isnan(found.value)
    assert said in found.what[0]


def test_beckhoff_10_v() -> None:
    point = points_of("beckhoff-kl3132")["AI1"]
    assert shows(point, 0x8000).value == -10.0
    assert shows(point, 0x7FFF).value == pytest.approx(10.0, abs=0.0004)
    assert shows(points_of("beckhoff-ek9000-el3002")["AI1"], 0x7FFF).value == pytest.approx(10.0)


def test_adam_has_values_and_status_apart() -> None:
    last = points_of("adam-6024")["AI5"]
    assert last.place == Place("holding", 5)  # 40006
    assert {one.place.address for one in last.status} == {25}  # 40026
    assert shows(last, 65535).value == pytest.approx(10.0)
    assert math.isnan(shows(last, 65535, status={25: 1}).value)
    assert "below" in shows(last, 0, status={25: 2}).what[0]


def test_laumas_has_its_sign_in_the_status() -> None:
    gross, net = (points_of("laumas")[name] for name in ("gross", "net"))
    assert (gross.place, net.place) == (Place("holding", 7, 2), Place("holding", 9, 2))  # 40008, 40010
    assert shows(gross, 0, 1250).value == pytest.approx(125.0)
    assert shows(gross, 0, 1250, status={6: 1 << 7}).value == pytest.approx(-125.0)
    assert shows(gross, 0, 1250, status={6: 1 << 8}).value == pytest.approx(125.0)
    assert shows(net, 0x000F, 0x423F, status={6: 1 << 8}).value == pytest.approx(-99999.9)


def test_laumas_faults() -> None:
    gross = points_of("laumas")["gross"]
    assert math.isnan(shows(gross, 0, 1250, status={6: 1}).value)
    warned = shows(gross, 0, 1250, status={6: 1 << 2})
    assert warned.value == pytest.approx(125.0)
    assert "9 divisions" in warned.what[0]


@pytest.mark.parametrize(("word", "celsius"), [(0x0191, 25.0625), (0xFF5E, -10.125), (0x0550, 85.0)])
def test_wb_m1w2_by_sixteenths(word: int, celsius: float) -> None:
    # The DS18B20's own numbers (data sheet, table 1): 0191h, FF5Eh, 0550h.
    found = shows(points_of("wb-m1w2")["sensor2"], word, status={17: 1})
    assert found.value == celsius


def test_wb_m1w2_says_what_is_off() -> None:
    first = points_of("wb-m1w2")["sensor1"]
    assert "does not answer" in shows(first, 0x0191, status={16: 0}).what[0]
    assert "no valid reading" in shows(first, 0x7FFF, status={16: 1}).what[0]


def test_eagle_floats_in_either_order() -> None:
    words = struct.unpack(">2H", struct.pack(">f", 1234.5))
    assert shows(points_of("eagle-ei")["gross3"], *words).value == 1234.5
    assert shows(points_of("eagle-ei", word_order="little")["net1"], *words[::-1]).value == 1234.5
    assert points_of("eagle-ei")["net4"].place == Place("holding", 0x200E, 2)


def test_esera_sensors_lie_a_hundred_apart() -> None:
    found = points_of("esera-1wire", address_shift=-40001)
    assert found["device1"].place == Place("holding", 100, 2)
    assert found["device30"].place == Place("holding", 3000, 2)
    assert shows(found["device1"], 0xFFFF, 0xFF38).value == pytest.approx(-2.0)


# --- what must always hold -------------------------------------------------------------------------------

FORMS = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}
KINDS = sorted(FORMS)


@given(
    st.sampled_from(KINDS), st.sampled_from(["big", "little"]), st.sampled_from(["big", "little"]), st.data()
)
def test_a_number_comes_back_whatever_the_orders(
    kind: str, words: str, order: str, data: st.DataObject
) -> None:
    form = FORMS[kind]
    if kind == "f32":
        number: float = data.draw(st.floats(width=32, allow_nan=False, allow_infinity=False))
    else:
        size, low = 8 * struct.calcsize(form), kind.startswith("i")
        number = data.draw(st.integers(-(2 ** (size - 1)) if low else 0, 2 ** (size - low) - 1))
    packed = struct.pack(form, number)
    sent = list(struct.unpack(f">{len(packed) // 2}H", packed))
    if words == "little":
        sent.reverse()
    if order == "little":
        sent = [one >> 8 | (one & 0xFF) << 8 for one in sent]
    point = described(
        {"name": "a", "address": 0, "type": kind, "unit": "V"}, word_order=words, byte_order=order
    )
    assert point.raw_of(sent) == number


@given(st.integers(-32767, 32767))
def test_sign_and_magnitude_of_16_bits(number: int) -> None:
    point = described({"name": "a", "address": 0, "type": "sm16", "unit": "V"})
    assert point.raw_of([abs(number) | (0x8000 if number < 0 else 0)]) == number


@given(st.integers(-(2**31) + 1, 2**31 - 1))
def test_sign_and_magnitude_of_32_bits(number: int) -> None:
    point = described({"name": "a", "address": 0, "type": "sm32", "unit": "V"})
    whole = abs(number) | (1 << 31 if number < 0 else 0)
    assert point.raw_of([whole >> 16, whole & 0xFFFF]) == number


@given(st.integers(0, 15), st.integers(0, 15), st.integers(0, 0xFFFF))
def test_bits_of_a_word_are_taken_alone(one: int, other: int, word: int) -> None:
    low, high = sorted((one, other))
    point = described({"name": "a", "address": 0, "type": "u16", "unit": "V", "bits": [low, high]})
    assert point.raw_of([word]) == int(f"{word:016b}"[15 - high : 16 - low], 2)


@given(st.floats(-1e3, 1e3).filter(lambda v: abs(v) > 1e-3), st.floats(-1e3, 1e3), st.integers(-32768, 32767))
def test_scale_and_offset(scale: float, offset: float, count: int) -> None:
    entry = {"name": "a", "address": 0, "type": "i16", "unit": "V", "scale": scale, "offset": offset}
    found = shows(described(entry), count & 0xFFFF)
    assert found.value == pytest.approx(count * scale + offset, abs=1e-6)


@given(st.integers(0, 0xFFFFFFFF))
def test_no_float_that_is_none_becomes_a_value(whole: int) -> None:
    point = described({"name": "a", "address": 0, "type": "f32", "unit": "V", "range": [-100.0, 100.0]})
    found = shows(point, whole >> 16, whole & 0xFFFF)
    (sent,) = struct.unpack(">f", struct.pack(">I", whole))
    if math.isnan(found.value):
        assert not -100.0 <= sent <= 100.0
        assert found.what
    else:
        assert found.value == sent


places = st.builds(
    Place,
    st.sampled_from(["holding", "input", "coil", "discrete"]),
    st.integers(0, 300),
    st.integers(1, 2),
)


@given(st.lists(places, min_size=1, max_size=40), st.integers(2, 125), st.integers(0, 10))
def test_reads_bring_every_place_whole_and_ask_for_nothing_else(
    wanted: list[Place], most: int, bridge: int
) -> None:
    reads = planned_reads(wanted, most_registers=most, bridge=bridge)
    asked = {(read.table, read.address + one) for read in reads for one in range(read.count)}
    needed = {(place.table, place.address + one) for place in wanted for one in range(place.words)}
    assert needed <= asked
    if not bridge:
        assert asked == needed
    for place in wanted:
        assert any(
            read.table == place.table
            and read.address <= place.address
            and place.address + place.words <= read.address + read.count
            for read in reads
        )
    assert all(read.count <= (2000 if read.bits else most) for read in reads)


def test_a_hole_parts_two_reads_and_a_bridge_joins_them() -> None:
    values, status = Place("holding", 0, 2), Place("holding", 5)
    assert planned_reads([values, status], most_registers=125) == (
        Read("holding", 0, 2),
        Read("holding", 5, 1),
    )
    assert planned_reads([status, values], most_registers=125, bridge=3) == (Read("holding", 0, 6),)
    assert planned_reads([values, status], most_registers=4, bridge=3) == (
        Read("holding", 0, 2),
        Read("holding", 5, 1),
    )


# --- what a description and its answers may not say ------------------------------------------------------


def written(folder: Path, **changes: str) -> Path:
    lines = {
        "head": 'id = "x"\nedition = 1\ntitle = "x"\nwires = ["tcp"]\n',
        "source": '[[source]]\ndocument = "m"\nedition = "1"\nplace = "p. 1"\n',
        "ask": "",
        "point": '[[point]]\nname = "a"\naddress = 0\ntype = "u16"\nunit = "V"\n',
    }
    path = folder / "mine.toml"
    path.write_text("".join({**lines, **changes}.values()), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"source": ""}, "source"),
        ({"point": '[[point]]\nname = "a"\naddress = 0\ntype = "u17"\nunit = "V"\n'}, "u17"),
        (
            {"point": '[[point]]\nname = "a"\naddress = 0\ntype = "bit"\nunit = "1"\n'},
            "does not lie in table",
        ),
        ({"point": '[[point]]\nname = "a"\naddress = 70000\ntype = "u16"\nunit = "V"\n'}, "address"),
        (
            {"point": '[[point]]\nname = "a"\naddress = 0\ntype = "u16"\nunit = "V"\nscale = "?per_count"\n'},
            "no [[ask]] has key",
        ),
        (
            {"ask": '[[ask]]\nkey = "unused"\nkind = "whole"\nwhy = "because nobody says it"\n'},
            "asked for nothing",
        ),
        (
            {"point": '[[point]]\nname = "a"\ncount = 3\naddress = 0\ntype = "u16"\nunit = "V"\n'},
            "has {n} in it",
        ),
        (
            {"point": '[[point]]\nname = "a"\naddress = 0\ntype = "u16"\nunit = "V"\nbits = [4, 16]\n'},
            "are not in",
        ),
        (
            {"point": '[[point]]\nname = "a"\naddress = 0\ntype = "u16"\nunit = "V"\nscale = 0.0\n'},
            "every value the same",
        ),
    ],
)
def test_a_description_that_makes_no_sense_is_refused(
    tmp_path: Path, changes: dict[str, str], said: str
) -> None:
    path = written(tmp_path, **changes)
    with pytest.raises(BadInput) as refused:
        load_description(path.name, tmp_path)
    assert refused.value.file == str(path)
    assert said in str(refused.value)


def test_one_of_a_laboratory_is_read(tmp_path: Path) -> None:
    assert load_description(written(tmp_path).name, tmp_path).id == "x"


def test_an_unknown_one_is_refused_with_those_there_are() -> None:
    with pytest.raises(BadInput, match="wb-m1w2"):
        load_description("adam-6017", Path())


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        ({}, "which its documents do not say"),
        ({"first_wort": 0}, "did you mean first_word"),
        ({"first_word": 0.5}, "not a whole number"),
        ({"first_word": "0"}, "not a whole number"),
        ({"first_word": 70000}, "which no device has"),
    ],
)
def test_what_is_asked_must_be_answered(answers: dict[str, int | float | str], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        resolved_points(load_description("wago-750-10v", Path()), answers)


def test_a_missing_answer_is_asked_with_its_reason_and_how_to_write_it() -> None:
    with pytest.raises(BadInput) as asked:
        resolved_points(load_description("eagle-ei", Path()), {"table": "holding"})
    assert "which of the two registers of a float comes first" in str(asked.value)
    assert 'answers = { word_order = "big" }' in str(asked.value)


def test_a_choice_is_one_of_those() -> None:
    with pytest.raises(BadInput, match="“big” or “little”"):
        resolved_points(load_description("eagle-ei", Path()), {"table": "holding", "word_order": "middle"})
