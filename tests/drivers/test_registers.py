from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from bufferstand.drivers.register_maps.coding import (
    WORDS,
    Layout,
    RegisterPlace,
    decode_value,
    encode_value,
)

ORDERS = st.sampled_from(["big", "little"])
VALUES = st.one_of(
    st.tuples(st.just("u16"), st.integers(0, 2**16 - 1)),
    st.tuples(st.just("i16"), st.integers(-(2**15), 2**15 - 1)),
    st.tuples(st.just("u32"), st.integers(0, 2**32 - 1)),
    st.tuples(st.just("i32"), st.integers(-(2**31), 2**31 - 1)),
    st.tuples(st.just("f32"), st.floats(width=32, allow_nan=False)),
)


@given(VALUES, ORDERS)
def test_decoding_undoes_encoding(typed: tuple[str, float], order: str) -> None:
    kind, value = typed
    words = encode_value(value, kind, order)
    assert len(words) == WORDS[kind]
    assert all(0 <= word <= 0xFFFF for word in words)
    assert decode_value(words, kind, order) == value


@given(VALUES)
def test_word_orders_are_each_others_reverse(typed: tuple[str, float]) -> None:
    kind, value = typed
    assert encode_value(value, kind, "little") == encode_value(value, kind, "big")[::-1]


def test_known_words() -> None:
    assert encode_value(0x12345678, "u32") == [0x1234, 0x5678]
    assert encode_value(-1, "i16") == [0xFFFF]
    assert encode_value(-1234.5, "f32") == list(struct.unpack(">2H", bytes.fromhex("c49a5000")))


@pytest.mark.parametrize(
    ("value", "kind", "message"),
    [
        (65536, "u16", "65536 does not fit u16"),
        (-1, "u32", "-1 does not fit u32"),
        (1e39, "f32", "1e+39 does not fit f32"),
        (0.5, "i16", "0.5 is not a whole number, i16 needs one"),
        (math.inf, "u16", "inf is not a whole number, u16 needs one"),
    ],
)
def test_what_does_not_fit_is_refused(value: float, kind: str, message: str) -> None:
    with pytest.raises(ValueError, match="^" + message.replace("+", r"\+") + "$"):
        encode_value(value, kind)


def test_wrong_number_of_registers_is_refused() -> None:
    with pytest.raises(ValueError, match="u32 takes 2 registers, got 1"):
        decode_value([1], "u32")


@given(st.lists(VALUES, min_size=1, max_size=8), ORDERS, st.integers(0, 3))
def test_windows_with_holes_round_trip(values: list[tuple[str, float]], order: str, hole: int) -> None:
    places, offset = [], 0
    for index, (kind, _) in enumerate(values):
        places.append(RegisterPlace(f"v{index}", kind, offset))
        offset += WORDS[kind] + hole
    layout = Layout(100, offset, tuple(places), order)
    named = {f"v{index}": value for index, (_, value) in enumerate(values)}
    assert layout.decode(layout.encode(named)) == named


@given(ORDERS, st.integers(1, 15))
def test_rows_are_the_same_as_windows_one_by_one(order: str, rows: int) -> None:
    rng = np.random.default_rng(rows)
    layout = Layout(
        0,
        8,
        (
            RegisterPlace("t", "u32", 0),
            RegisterPlace("f", "i32", 2),
            RegisterPlace("a", "u16", 4),
            RegisterPlace("b", "i16", 5),
            RegisterPlace("g", "f32", 6),
        ),
        order,
    )
    columns: dict[str, NDArray[Any]] = {
        "t": rng.integers(0, 2**32, rows, dtype=np.uint32),
        "f": rng.integers(-(2**31), 2**31, rows).astype(np.int32),
        "a": rng.integers(0, 2**16, rows, dtype=np.uint16),
        "b": rng.integers(-(2**15), 2**15, rows).astype(np.int16),
        "g": rng.normal(size=rows).astype(np.float32),
    }
    words = layout.encode_rows(columns)
    singly: list[int] = []
    for row in range(rows):
        singly += layout.encode({name: column[row].item() for name, column in columns.items()})
    assert words == singly
    back = layout.decode_rows(words, rows)
    for name, column in columns.items():
        np.testing.assert_array_equal(back[name], column)
        assert back[name].dtype == column.dtype


def test_window_refuses_other_values_and_lengths() -> None:
    layout = Layout(0, 3, (RegisterPlace("a", "u16", 0), RegisterPlace("b", "u32", 1)), "big")
    with pytest.raises(ValueError, match="values do not match the window: b, c"):
        layout.encode({"a": 1, "c": 2})
    with pytest.raises(ValueError, match="a: 70000 does not fit u16"):
        layout.encode({"a": 70000, "b": 2})
    with pytest.raises(ValueError, match="the window has 3 registers, got 2"):
        layout.decode([1, 2])
    with pytest.raises(ValueError, match="the window has 6 registers, got 5"):
        layout.decode_rows([1] * 5, 2)
    with pytest.raises(ValueError, match="a: a value does not fit u16, or lengths differ"):
        layout.encode_rows({"a": np.array([70000]), "b": np.array([1])})
    with pytest.raises(ValueError, match="b: a value does not fit u32, or lengths differ"):
        layout.encode_rows({"a": np.array([1]), "b": np.array([1, 2])})
