"""First contact found from samples: over wire zeros, gaps, noise and specimens, against the closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.zero.first_contact import NoContactError, TouchSamples, find_contact
from tests.daq.touches import Specimen, touched

SPECIMENS = {
    "buffer": Specimen(),
    "little preload": Specimen(preload_kN=0.5),
    "no preload": Specimen(preload_kN=0.0),
    "no preload, progressive": Specimen(stiffness_kN_per_mm=3.0, preload_kN=0.0, bend=0.2),
    "hard": Specimen(stiffness_kN_per_mm=20.0, preload_kN=0.0),
}


@given(
    st.sampled_from(sorted(SPECIMENS)),
    st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)),
    st.floats(0.0, 3.0),
    st.sampled_from([0.02, 0.1, 0.2]),
    st.booleans(),
    st.integers(0, 2**31),
)
def test_the_zero_is_found_within_a_tenth_of_a_millimetre(
    name: str, wires_mm: tuple[float, float], gap_mm: float, noise_kN: float, on_plate: bool, seed: int
) -> None:
    samples = touched(
        SPECIMENS[name], gap_mm=gap_mm, wires_mm=wires_mm, noise_kN=noise_kN, seed=seed, on_plate=on_plate
    )
    contact = find_contact(samples)
    assert contact.position.value == pytest.approx(gap_mm, abs=0.1)
    for number, wire in enumerate(wires_mm, start=1):
        assert contact.wires[f"stroke_{number}"].value == pytest.approx(wire, abs=0.1)
    assert contact.rest_kN == pytest.approx(0.4, abs=0.05)


@pytest.mark.parametrize("seeds", [6, pytest.param(200, marks=pytest.mark.long)])
def test_the_stated_uncertainty_covers_about_as_often_as_it_says(seeds: int) -> None:
    inside: list[bool] = []
    widths: list[float] = []
    for seed in range(seeds):
        for specimen in SPECIMENS.values():
            random = np.random.default_rng(seed)
            gap_mm, wire_mm = float(random.uniform(0.0, 3.0)), float(random.uniform(0.0, 5.0))
            contact = find_contact(
                touched(
                    specimen,
                    gap_mm=gap_mm,
                    wires_mm=(wire_mm, wire_mm),
                    noise_kN=float(random.uniform(0.02, 0.2)),
                    seed=seed,
                    on_plate=bool(seed % 2),
                )
            )
            wire = contact.wires["stroke_1"]
            inside.append(abs(wire.value - wire_mm) <= 2.0 * wire.u)
            widths.append(2.0 * wire.u)
    assert np.mean(inside) >= 0.93
    assert np.median(widths) < 0.03, "it covers because it is right, not because it is wide"


def test_the_place_alone_lies_within_its_own_uncertainty() -> None:
    """Without what counts and the encoder's stated zero add: these hide a place whose U is too small."""
    shares: list[float] = []
    for specimen in SPECIMENS.values():
        for seed in range(4):
            gap_mm = float(np.random.default_rng(seed).uniform(0.0, 3.0))
            samples = touched(specimen, gap_mm=gap_mm, wires_mm=(0.0, 0.0), noise_kN=0.1, seed=seed)
            place = find_contact(samples).position
            shares.append(abs(place.value - gap_mm) / place.u_place)
    assert np.mean(np.array(shares) <= 2.0) >= 0.9
    assert max(shares) > 0.5, "it is not simply wide"


def test_the_uncertainty_of_the_place_is_that_of_the_end_of_a_parabola() -> None:
    """Closed form, n samples on a straight rise of slope s: u = 3 √((σ / s)² + σx²) / √n."""
    slope, force_noise, way_noise, step_mm, rise = 50.0, 0.1, 0.01, 0.0005, 120
    creep = np.arange(2000 + rise) * step_mm
    way = np.concatenate((creep, creep[::-1]))
    random = np.random.default_rng(7)
    contact_mm = float(creep[2000])
    force = slope * np.maximum(way - contact_mm, 0.0) + random.normal(0.0, force_noise, way.size)
    position = way + random.normal(0.0, way_noise, way.size)
    found = find_contact(TouchSamples(np.arange(way.size) / 1000.0, force, position, {}, {}, {})).position
    expected = 3.0 * np.hypot(force_noise / slope, way_noise) / np.sqrt(rise)
    assert found.u_place == pytest.approx(expected, rel=0.3)
    assert abs(found.value - contact_mm) <= 2.0 * found.u_place


def test_the_stiffness_of_the_first_rise_is_that_of_frame_and_spring_in_series() -> None:
    spring = Specimen(stiffness_kN_per_mm=2.0, preload_kN=0.0)
    contact = find_contact(touched(spring, gap_mm=1.0, wires_mm=(0.0, 0.0), noise_kN=0.1, seed=3))
    assert contact.stiffness_kN_per_mm == pytest.approx(1.0 / (1.0 / 2.0 + 1.0 / 150.0), rel=0.1)


def test_where_no_force_rises_there_is_no_contact() -> None:
    whole = touched(SPECIMENS["buffer"], gap_mm=2.0, wires_mm=(0.0, 0.0), noise_kN=0.1, seed=1)
    random = np.random.default_rng(5)
    flat = TouchSamples(
        whole.time_s,
        random.normal(0.4, 0.1, whole.time_s.size),
        whole.position_mm,
        whole.wires_mm,
        {},
        whole.step,
    )
    with pytest.raises(NoContactError, match=r"at most, with a noise of 0\.\d\d kN: no contact"):
        find_contact(flat)


def test_too_few_samples_are_refused() -> None:
    few = TouchSamples(np.arange(5) / 1000.0, np.zeros(5), np.zeros(5), {}, {}, {})
    with pytest.raises(NoContactError, match="only 5 samples"):
        find_contact(few)
