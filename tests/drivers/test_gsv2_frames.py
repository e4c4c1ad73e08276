from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.drivers.amplifiers.gsv2.frames import FrameDecoder, Gsv2Frame

FEW = settings(max_examples=15)
COUNTS = st.lists(st.integers(-(2**23), 2**23 - 1), min_size=12, max_size=60)


def stream(counts: list[int], status: int = 0) -> bytes:
    return b"".join(bytes([0x2C, status]) + (count + 0x800000).to_bytes(3, "big") for count in counts)


def noisy(n: int, seed: int) -> list[int]:
    return [int(v) for v in np.random.default_rng(seed).normal(100_000, 300, n)]


def counts_of(frames: list[Gsv2Frame]) -> list[int]:
    return [frame.count for frame in frames]


def test_known_frames() -> None:
    decoder = FrameDecoder(aligned=True)
    data = bytes.fromhex("2c00800000 2c00ffffff 2c10000000 2c08800001 2c00")
    assert decoder.feed(data) == [
        Gsv2Frame(0, 0x00, 0),
        Gsv2Frame(8_388_607, 0x00, 0),
        Gsv2Frame(-8_388_608, 0x10, 0),
        Gsv2Frame(1, 0x08, 0),
    ]
    assert decoder.pending_frames == 1
    assert decoder.resyncs == 0


@FEW
@given(COUNTS, st.lists(st.integers(1, 23), min_size=1, max_size=20))
def test_pieces_do_not_matter(counts: list[int], sizes: list[int]) -> None:
    data = stream(counts)
    whole = FrameDecoder(aligned=True).feed(data)
    decoder = FrameDecoder(aligned=True)
    pieces: list[Gsv2Frame] = []
    position = 0
    while position < len(data):
        size = sizes[position % len(sizes)]
        pieces += decoder.feed(data[position : position + size])
        position += size
    assert pieces == whole
    assert counts_of(whole) == counts[:-1]  # the last waits for its successor


@given(st.integers(0, 4), st.integers(0, 99))
def test_a_stream_joined_in_the_middle_is_found(cut: int, seed: int) -> None:
    counts = noisy(40, seed)
    decoder = FrameDecoder()
    frames = decoder.feed(stream(counts)[cut:])
    begin = 0 if cut == 0 else 1
    assert counts_of(frames) == counts[begin:-1]
    assert frames[0].lost == 0  # what was before the first frame is not known to be lost


# exactly five missing bytes splice two frames into one that looks sound: without a checksum nobody can tell
@FEW
@given(cut=st.integers(50, 140), missing=st.sampled_from([1, 2, 3, 4, 6, 7, 8, 9]), seed=st.integers(0, 50))
def test_torn_frames_cost_themselves_only_and_are_counted(cut: int, missing: int, seed: int) -> None:
    counts = noisy(60, seed)
    data = stream(counts)
    decoder = FrameDecoder(aligned=True)
    frames = decoder.feed(data[:cut] + data[cut + missing :])
    got = counts_of(frames)
    first_hurt, last_hurt = cut // 5, (cut + missing - 1) // 5
    untouched = counts[:first_hurt] + counts[last_hurt + 1 : -1]
    assert set(got) <= set(counts)  # no value that was never sent
    assert len(untouched) - len(got) in {0, 1}  # at most the sound frame just before goes with it
    lost = sum(frame.lost for frame in frames)
    assert abs(lost + len(got) - (len(counts) - 1)) <= 1 + missing // 5  # what never came leaves no bytes


@FEW
@given(garbage=st.binary(min_size=1, max_size=40), seed=st.integers(0, 50))
def test_garbage_between_frames_gives_no_false_values_for_long(garbage: bytes, seed: int) -> None:
    counts = noisy(80, seed)
    data = stream(counts)
    decoder = FrameDecoder(aligned=True)
    frames = decoder.feed(data[:100] + garbage + data[100:])
    got = counts_of(frames)
    assert got[:19] == counts[:19]
    assert got[-40:] == counts[-41:-1]
    assert len([value for value in got if value not in set(counts)]) <= len(garbage) // 5 + 1


def test_sync_bytes_inside_data_do_not_mislead() -> None:
    counts = [0x2C2C00 + i % 3 * 0x2C - 0x800000 for i in range(30)]  # 0x2C in two of three data bytes
    decoder = FrameDecoder(aligned=True)
    assert counts_of(decoder.feed(stream(counts))) == counts[:-1]
    assert decoder.resyncs == 0


def test_two_readings_wait_for_the_noise_to_tell() -> None:
    steady = [0x802C00 - 0x800000] * 20  # 2C 00 80 2C 00: frames could begin at the first 2C or at the second
    decoder = FrameDecoder()
    assert decoder.feed(stream(steady)) == []
    assert not decoder.undecided
    moving = [0x802C00 + value - 0x800000 for value in (1, 3, 0, 2, 5, 7, 1, 1)]
    frames = decoder.feed(stream(moving))
    assert counts_of(frames) == (steady + moving)[:-1]


def test_two_readings_without_noise_ask_for_a_restart() -> None:
    decoder = FrameDecoder()
    decoder.feed(stream([0x802C00 - 0x800000] * 100))
    assert decoder.undecided


@pytest.mark.parametrize("status", [0x01, 0x04, 0x20, 0x80])
def test_a_status_byte_with_other_bits_begins_no_frame(status: int) -> None:
    decoder = FrameDecoder(aligned=True)
    assert decoder.feed(stream(noisy(20, 1), status=status)) == []
    assert decoder.resyncs == 1


def test_resyncs_and_skipped_bytes_are_counted() -> None:
    counts = noisy(40, 3)
    data = stream(counts)
    decoder = FrameDecoder(aligned=True)
    frames = decoder.feed(data[:52] + data[53:101] + data[103:])
    assert decoder.resyncs == 2
    assert sum(frame.lost for frame in frames) == len(counts) - 1 - len(frames)
    assert (
        decoder.skipped_bytes == 4 + 3 + 5
    )  # the rest of each hurt frame, and one before a hurt status byte
