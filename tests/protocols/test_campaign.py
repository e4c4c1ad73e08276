"""The campaign file: what is understood, and what is said where it is not."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.protocols.campaign_file.schema import (
    load_campaign,
)
from bufferstand.protocols.campaign_file.step_kinds.cyclic import (
    HarmonicStep,
    StaticStep,
)
from tests.protocols.conftest import HEAD, Load, harmonic


def test_defaults_are_those_of_the_paper(load: Load) -> None:
    campaign = load('[[step]]\nkind = "static"\n')
    step = campaign.content.step[0]
    assert isinstance(step, StaticStep)
    assert step.speed_mm_per_s == 5.0
    assert campaign.limits.force_max_kN == 600.0
    assert campaign.limits.frequency_max_Hz == 2.55
    assert campaign.limits.temperature_stop_C == 40.0
    assert campaign.limits.on_temperature_stop == "stop"
    assert campaign.limits.temperature_resume_C < campaign.limits.temperature_stop_C


def test_paths_are_relative_to_the_campaign_file(load: Load, tmp_path: Path) -> None:
    campaign = load('[[step]]\nkind = "static"\n')
    assert campaign.stand_path == tmp_path / "stand.toml"
    assert campaign.specimen_path == tmp_path / "specimens/a.toml"


def test_an_absolute_path_stays(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    stand = tmp_path / "else" / "where.toml"
    path.write_text(
        f'[campaign]\nid = "x"\nstand = "{stand}"\nspecimen = "s"\n[[step]]\nkind = "static"\n', "utf-8"
    )
    assert load_campaign(path).stand_path == stand


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        (harmonic(20, 20).replace("amplitude_mm", "amplitud_mm"), "line 8", "did you mean “amplitude_mm”?"),
        ("[limits]\ntemperature_stop = 40\n" + harmonic(20, 20), "line 6", "“temperature_stop_C”"),
        ('[[step]]\nkind = "harmonik"\n', "line 6: step.kind", "did you mean “harmonic”?"),
        ('[[step]]\nname = "a"\n', "line 5", "no kind"),
        (harmonic(20, 20, rate=""), "line 5", "exactly one of frequency_Hz and peak_speed_mm_per_s"),
        (
            harmonic(20, 20, rate="frequency_Hz = 1\npeak_speed_mm_per_s = 10"),
            "line 9",
            "exactly one of frequency_Hz and peak_speed_mm_per_s",
        ),
        (harmonic(20, 0.0), "line 8", "from 0.01 to 1000"),
        (harmonic(20, 20, cycles=0), "line 10", "from 1 to 100000"),
        ("[limits]\ntemperature_resume_C = 40\n" + harmonic(20, 20), "line 6", "must be below"),
        ("[limits]\nforce_trip_kN = 500\n" + harmonic(20, 20), "line 6", "must not be below force_max_kN"),
        (
            '[limits]\non_temperature_stop = "go-on"\n' + harmonic(20, 20),
            "line 6",
            "write “stop”, “wait-and-continue” or “skip”",
        ),
        ("", "step", "missing"),
    ],
)
def test_bad_input_is_refused_with_its_place(load: Load, text: str, place: str, said: str) -> None:
    with pytest.raises(BadInput) as caught:
        load(text)
    assert caught.value.file is not None
    assert caught.value.file.endswith("campaign.toml")
    assert place in caught.value.place
    assert said in caught.value.message()


SWEEP = '[[step]]\nkind = "sweep"\nprestress_mm = [20]\namplitude_mm = [20]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SWEEP + "frequency_Hz = [1, 2]\ncycles = [3]\n", "cycles lists 1 values for 2"),
        (SWEEP + "frequency_Hz = [1, 2]\ncycles = [3, 0]\n", "at least 1"),
        (SWEEP + "frequency_Hz = [1, -2]\n", "every value of frequency_Hz must be positive"),
        (
            SWEEP + "frequency_Hz = []\n",
            "a list of 0 entries is not possible here; write a list of one or more numbers",
        ),
        (SWEEP + 'frequency_Hz = [1]\norder = "random"\n', "needs a seed"),
        (SWEEP + "frequency_Hz = [1]\nseed = 3\n", "seed has a meaning with"),
        (SWEEP.replace("[20]\namp", "[-1]\namp") + "frequency_Hz = [1]\n", "prestress_mm may be below zero"),
    ],
)
def test_a_sweep_that_does_not_fit_together_is_refused(load: Load, text: str, said: str) -> None:
    with pytest.raises(BadInput, match=r"line \d+: step") as caught:
        load(text)
    assert said in caught.value.message()


def test_a_single_number_is_a_list_of_one(load: Load) -> None:
    one = load(SWEEP.replace("[20]", "20") + "frequency_Hz = 1\n")
    many = load(SWEEP + "frequency_Hz = [1]\n")
    assert one.content == many.content


def test_the_line_of_each_step_is_known(load: Load) -> None:
    campaign = load("# a comment\n" + harmonic(20, 20) + '[[step]] # another\nkind = "static"\n')
    assert campaign.place(1) == f"line {HEAD.count(chr(10)) + 2}: [[step]] 1"
    assert campaign.place(2) == f"line {HEAD.count(chr(10)) + 9}: [[step]] 2"


def test_steps_written_inline_have_no_line(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text('step = [{ kind = "static" }]\n' + HEAD, encoding="utf-8")
    assert load_campaign(path).place(1) == "[[step]] 1"


@given(amplitude=st.floats(0.1, 100.0), frequency=st.floats(0.001, 10.0))
def test_frequency_and_peak_speed_are_two_names_of_one_rate(amplitude: float, frequency: float) -> None:
    by_frequency = HarmonicStep(
        kind="harmonic", prestress_mm=amplitude, amplitude_mm=amplitude, frequency_Hz=frequency
    )
    _, speed = by_frequency.rate()
    by_speed = HarmonicStep(
        kind="harmonic", prestress_mm=amplitude, amplitude_mm=amplitude, peak_speed_mm_per_s=speed
    )
    assert by_speed.rate() == pytest.approx((frequency, speed), rel=1e-12)


@pytest.mark.parametrize(
    ("amplitude", "speed", "frequency"),
    [(20.0, 10.0, 0.08), (20.0, 160.0, 1.27), (30.0, 80.0, 0.42), (5.0, 80.0, 2.55), (15.0, 80.0, 0.849)],
)
def test_the_papers_peak_speeds_give_the_papers_frequencies(
    amplitude: float, speed: float, frequency: float
) -> None:
    step = HarmonicStep(kind="harmonic", prestress_mm=50.0, amplitude_mm=amplitude, peak_speed_mm_per_s=speed)
    assert step.rate()[0] == pytest.approx(frequency, abs=0.005)
    assert step.rate()[0] == pytest.approx(speed / (2 * math.pi * amplitude), rel=1e-12)
