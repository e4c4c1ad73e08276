"""Trains: against closed forms, against the impact of two, balances, springs of different make in a row."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.energy import stored_energy
from bufferstand.model.simulation import band_history, lag_histories, simulate
from bufferstand.model.spring import HeatBalance, TemperatureLaw, ViscousBranch
from bufferstand.model.stepper import SpringStepper
from bufferstand.model.train import Gap, Springs, Train, Vehicle, figures_of, load_train, move_train
from bufferstand.model.train.impact import predict_impact
from bufferstand.model.train.in_series import SpringsInSeries
from tests.cli.processes import bufferstand
from tests.model.cases import parallel_curves, path, spring
from tests.model.recipes import FOLDER, category_a, draw_hook

TRAINS = FOLDER.parent / "trains"


def isothermal(model):
    """A spring so heavy that it does not warm up."""
    return replace(model, heat=HeatBalance(1e12))


def linear(k_kN_per_mm: float):
    """A spring without loss and preload."""
    force = (0.0, 200.0 * k_kN_per_mm)
    return spring(Curves((0.0, 200.0), force, force, transition_length_mm=5.0))


def train(masses_t, speeds_m_per_s, gaps, duration_s=0.5, step_s=2e-4) -> Train:
    vehicles = tuple(
        Vehicle(f"v{k}", m, v) for k, (m, v) in enumerate(zip(masses_t, speeds_m_per_s, strict=True))
    )
    return Train("test", vehicles, tuple(gaps), 20.0, duration_s, step_s)


@pytest.mark.parametrize("temperature_C", [25.0, 60.0])
def test_work_is_heat_and_what_is_held(temperature_C):
    """The ledger of one spring at one temperature: two integrals of its history against one of its state."""
    model = spring(
        temperature=TemperatureLaw(sensitivity_per_K=0.01, loss_sensitivity_per_K=0.002),
        viscous=ViscousBranch(0.06, 0.5, 0.03),
    )
    stroke = path(1.0, 80.0, 50.0, 52.0, 51.0, 90.0, 30.0, 106.0, 70.0, step_mm=0.01)
    time = np.arange(len(stroke)) * 1e-3
    result = simulate(model, time, stroke, temperature_C=temperature_C, isothermal=True)
    lags = lag_histories(model.viscous, time, np.minimum(stroke, model.tables.end_mm))
    held = stored_energy(model, stroke, band_history(model.tables, stroke), lags, temperature_C)
    np.testing.assert_allclose(
        result.work_J - result.heat_J, held - held[0], atol=2.0
    )  # overstress that relaxes in the stop
    assert held.max() > 5_000.0


def test_two_masses_on_linear_springs_meet_as_the_closed_form_says():
    """Springs in a row and abreast make one k; F = v sqrt(mu k) for pi sqrt(mu/k), speeds as of two balls."""
    soft, stiff, v, (m_1, m_2) = 4.0, 9.0, 1.5, (40.0, 90.0)
    gap = Gap(Springs(linear(soft), linear(stiff), 2), None, 30.0, 0.0)
    motion = move_train(train([m_1, m_2], [v, 0.0], [gap]))
    k = 2.0 * 1e6 * soft * stiff / (soft + stiff)
    mu = 1e3 * m_1 * m_2 / (m_1 + m_2)
    assert motion.largest_push_kN[0] == pytest.approx(1e-3 * v * np.sqrt(mu * k), rel=2e-4)
    touch = 0.030 / v
    assert motion.time_of_push_s[0] == pytest.approx(touch + 0.5 * np.pi * np.sqrt(mu / k), abs=4e-4)
    pressed = motion.time_s[motion.gap_force_kN[:, 0] > 0.0]
    assert pressed[-1] - pressed[0] == pytest.approx(np.pi * np.sqrt(mu / k), abs=6e-4)
    after = (v * (m_1 - m_2) / (m_1 + m_2), v * 2.0 * m_1 / (m_1 + m_2))
    assert motion.speed_m_per_s[-1] == pytest.approx(after, abs=1e-3)
    strokes = motion.buffer_stroke_mm[0]
    assert strokes[0] * soft == pytest.approx(strokes[1] * stiff, rel=1e-6)
    assert motion.largest_acceleration_m_per_s2 == pytest.approx(
        motion.largest_push_kN[0] / np.array([m_1, m_2]), rel=1e-9
    )


@pytest.mark.slow
def test_a_coupled_chain_of_linear_springs_moves_by_its_eigenmodes():
    """One end is pushed: six masses whose buffers and draw gears are equally stiff are a linear chain."""
    k, masses = 6.0, np.array([30.0, 80.0, 25.0, 60.0, 60.0, 40.0])
    buffer, gear = linear(k), linear(2.0 * k)  # two rows of buffers, one of draw gears
    gap = Gap(Springs(buffer, buffer, 2), Springs(gear, gear, 1), 0.0, 0.0)
    speeds = [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    motion = move_train(train(masses, speeds, [gap] * 5, duration_s=0.4, step_s=1e-4))
    stiffness = np.zeros((6, 6))
    for i in range(5):
        stiffness[i : i + 2, i : i + 2] += 1e6 * k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    root = np.sqrt(1e3 * masses)
    squares, modes = np.linalg.eigh(stiffness / np.outer(root, root))
    omega = np.sqrt(np.maximum(squares, 0.0))
    start = modes.T @ (root * np.array(speeds))
    exact = (modes @ (start[:, None] * np.cos(np.outer(omega, motion.time_s)))).T / root
    np.testing.assert_allclose(motion.speed_m_per_s, exact, atol=2e-3)
    assert motion.largest_pull_kN.max() > 100.0


@pytest.mark.slow
def test_two_wagons_meet_as_the_impact_of_one_buffer_says():
    """The same impact by an integration of its own (EN 15551 Annex E): peak, stroke, energy lost."""
    model = category_a()
    alone = predict_impact(model, 80.0, 2.0, 20.0)
    gap = Gap(Springs(model, model, 2), None, 0.0, 0.0)
    motion = move_train(train([80.0, 80.0], [2.0, 0.0], [gap], duration_s=0.6, step_s=1e-4))
    assert motion.largest_push_kN[0] == pytest.approx(2.0 * alone.peak_force_kN, rel=2e-3)
    assert motion.buffer_stroke_mm[0] == pytest.approx([alone.stroke_mm] * 2, rel=1e-3)
    assert motion.lost_J[-1] == pytest.approx(4.0 * alone.absorbed_energy_J, rel=0.02)


MODELS = [
    isothermal(category_a()),
    isothermal(draw_hook()),
    spring(parallel_curves(), viscous=ViscousBranch(0.05, 0.1)),
    linear(5.0),
]


@pytest.mark.slow
@settings(max_examples=12)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(MODELS), st.sampled_from(MODELS), st.floats(15.0, 90.0), st.floats(-1.0, 1.0)
        ),
        min_size=2,
        max_size=4,
    ),
    st.booleans(),
    st.floats(0.0, 40.0),
)
def test_any_train_keeps_momentum_and_energy(members, coupled, gap_mm):
    gaps = [
        Gap(
            Springs(a, b, 2),
            Springs(MODELS[1], MODELS[1], 1) if coupled else None,
            gap_mm if k % 2 else 0.0,
            5.0,
        )
        for k, (a, b, _, _) in enumerate(members[1:])
    ]
    scene = train([m for *_, m, _ in members], [v for *_, v in members], gaps, 0.3, 5e-4)
    motion = move_train(scene)
    found = figures_of(scene, motion)
    assert found.momentum_change < 1e-9
    total = motion.kinetic_J + motion.stored_J + motion.lost_J
    assert np.abs(total - total[0]).max() < 0.01 * found.energy_of_impact_J + 5.0 * len(gaps)
    assert np.all(np.diff(motion.lost_J) >= -1e-9)
    assert motion.largest_push_kN == pytest.approx(np.maximum(motion.largest_push_kN, 0.0))


@pytest.mark.slow
def test_the_ledger_closes_with_the_square_of_the_step():
    models = isothermal(category_a()), isothermal(draw_hook())
    gap = Gap(Springs(models[0], models[0], 2), Springs(models[1], models[1], 1), 0.0, 0.0)
    free = replace(gap, pull=None, distance_mm=50.0)
    gaps = [gap, gap, free, gap]
    left = []
    for step_s in (1e-3, 0.5e-3):
        scene = train([40.0] * 5, [2.0] * 3 + [0.0] * 2, gaps, 0.8, step_s)
        found = figures_of(scene, move_train(scene))
        left.append(found.ledger_gap)
        assert found.momentum_change < 1e-12
    assert left[0] < 1e-3
    assert left[1] < 0.45 * left[0]


def test_a_step_that_is_too_long_is_said():
    """5 ms against the stop of 500 kN/mm under 2 t: the ledger shows it, and a warning says it."""
    stiff = spring(Curves((0.0, 5.0), (0.0, 50.0), (0.0, 25.0), transition_length_mm=1.0))
    scene = train([2.0, 2.0], [5.0, 0.0], [Gap(Springs(stiff, stiff, 2), None, 0.0, 0.0)], 0.2, 5e-3)
    found = figures_of(scene, move_train(scene))
    assert found.ledger_gap > 0.05
    assert any("the step of 0.005 s may be too long" in sentence for sentence in found.warnings)
    assert any("into the stop of 500 kN/mm" in sentence for sentence in found.warnings)


@pytest.mark.slow
def test_softening_costs_the_ledger_less_than_its_share_of_force():
    """With heat: a spring that softens under load keeps less than it took, 1 % of force a kelvin."""
    model = category_a()
    gap = Gap(Springs(model, model, 2), None, 0.0, 0.0)
    scene = train([40.0] * 3, [2.0, 0.0, 0.0], [gap] * 2, 0.6, 1e-3)
    motion = move_train(scene)
    total = motion.kinetic_J + motion.stored_J + motion.lost_J
    assert total[-1] < total[0]
    assert np.abs(total / total[0] - 1.0).max() < 0.01 * motion.warming_K.max()
    assert 0.1 < motion.warming_K.max() < 2.0


@pytest.mark.slow
def test_a_train_seen_from_the_other_side_is_its_mirror():
    a, b, hook = category_a(), isothermal(draw_hook()), draw_hook()
    gaps = [
        Gap(Springs(a, b, 2), Springs(hook, hook, 1), 0.0, 3.0),
        Gap(Springs(b, a, 2), None, 20.0, 0.0),
    ]
    there = move_train(train([30.0, 70.0, 50.0], [1.5, 1.5, 0.0], gaps, 0.4, 5e-4))
    turned = [replace(g, push=Springs(g.push.right, g.push.left, 2)) for g in gaps[::-1]]
    back = move_train(train([50.0, 70.0, 30.0], [-0.0, -1.5, -1.5], turned, 0.4, 5e-4))
    np.testing.assert_allclose(back.gap_force_kN, there.gap_force_kN[:, ::-1], atol=1e-5)
    np.testing.assert_allclose(back.speed_m_per_s, -there.speed_m_per_s[:, ::-1], atol=1e-8)


@pytest.mark.slow
@given(st.lists(st.tuples(st.floats(-20.0, 110.0), st.sampled_from([0.0, 1e-3, 0.2])), max_size=12))
def test_a_force_that_is_asked_for_is_that_of_the_step_and_leaves_no_trace(moves):
    one, other = (SpringStepper(category_a(), 20.0, 15.0) for _ in range(2))
    for stroke, dt in moves:
        for elsewhere in (stroke + 7.0, stroke - 7.0):
            one.force_at(elsewhere, 3e-3)
        asked = one.force_at(stroke, dt)
        assert asked == one.step(stroke, dt) == other.step(stroke, dt)
    kept = [(s.band, s.heat_J, s.work_J, s.temperature_C, s.lags_mm) for s in (one, other)]
    assert kept[0] == kept[1]


@given(
    st.sampled_from(MODELS),
    st.sampled_from(MODELS),
    st.lists(st.floats(-5.0, 120.0).map(lambda x: round(x, 6)), min_size=1, max_size=10),
)
def test_springs_in_a_row_press_equally(left, right, closings):
    row = SpringsInSeries(left, replace(right), 20.0)
    for closing in closings:
        force = row.step(closing, 1e-3)
        x = row.left.stroke_mm, row.right.stroke_mm
        assert sum(x) == pytest.approx(closing, abs=1e-9)
        ends = row.left.force_kN, row.right.force_kN
        if min(x) <= 1e-8:  # a preload jumps there: the other spring presses on its face
            assert force == pytest.approx(ends[1 if x[0] <= 1e-8 else 0], abs=1e-4)
        else:
            assert ends[0] == pytest.approx(ends[1], abs=1e-4)
            assert force == pytest.approx(ends[0], abs=1e-4)


def test_at_first_contact_the_smaller_preload_gives_way():
    weak, strong = (spring(parallel_curves()), linear(5.0))
    row = SpringsInSeries(weak, strong, 20.0)
    assert row.step(1e-12, 1e-3) == pytest.approx(0.0, abs=1e-9)
    both = SpringsInSeries(
        weak, spring(Curves((0.0, 50.0), (90.0, 200.0), (70.0, 100.0), transition_length_mm=20.0)), 20.0
    )
    assert both.step(1e-12, 1e-3) == pytest.approx(20.0, abs=1e-6)  # of the two unloading curves at 0
    assert both.step(0.1, 1e-3) < 70.0
    assert both.right.stroke_mm < 1e-8


def test_equal_springs_in_a_row_share_as_two_that_look_for_it():
    model = category_a()
    fast, slow = SpringsInSeries(model, model, 20.0), SpringsInSeries(model, replace(model), 20.0)
    assert fast.equal
    assert not slow.equal
    for closing in path(0.0, 150.0, 90.0, 100.0, 20.0, 180.0, step_mm=1.0)[1:].tolist():
        assert fast.step(closing, 1e-3) == pytest.approx(slow.step(closing, 1e-3), abs=1e-5)


@pytest.mark.slow
def test_the_shipped_trains_are_as_the_page_says(tmp_path):
    """Ten into ten, shortened to the impact itself: docs/trains.md has all six seconds."""
    scene = load_train(TRAINS / "ten-into-ten.toml")
    assert len(scene.vehicles) == 20
    assert [k for k, gap in enumerate(scene.gaps) if gap.pull is None] == [9]
    motion = move_train(replace(scene, duration_s=0.35))
    assert motion.largest_push_kN[9] == pytest.approx(1616.7, abs=0.5)
    mixed = load_train(TRAINS / "mixed.toml")
    assert [gap.push.left is gap.push.right for gap in mixed.gaps] == [True, False, False, True, True]
    assert mixed.gaps[1].distance_mm == 100.0
    assert mixed.gaps[2].pull is not None


HEAD = 'format = "bufferstand/train"\nformat_version = 1\n[train]\nname = "t"\nduration_s = 0.3\n'
ROW = '[[vehicle]]\nname = "{}"\nmass_t = 40.0\nspeed_km_h = {}\nbuffer = "b"\n'


def written(tmp_path, *rows: str, head: str = HEAD):
    file = tmp_path / "train.toml"
    model = FOLDER / "category-a-elastomer.toml"
    (tmp_path / "b.toml").write_bytes(model.read_bytes())
    file.write_text(head + '[spring.b]\nmodel = "b.toml"\n' + "".join(rows))
    return file


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([ROW.format("a", 5.0)], "one vehicle has nobody to meet"),
        ([ROW.format("a", 5.0), ROW.format("c", 0.0).replace('"b"', '"d"')], "there is no spring “d”"),
        ([ROW.format("a", 5.0), ROW.format("c", 0.0) + "coupled = true\n"], "one of them has no draw gear"),
        (
            [ROW.format("a", 5.0), ROW.format("c", 0.0) + "buffers_abreast = 1\n"],
            "do not meet those at the sides",
        ),
        ([ROW.format("a", 5000.0), ROW.format("c", 0.0)], "5000.0 is too large"),
        ([ROW.format("a", 5.0) + "count = 0\n"], "too small"),
        ([ROW.format("a", 5.0) + "colour = 0\n"], "colour"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(tmp_path, rows, said):
    with pytest.raises(BadInput) as refused:
        load_train(written(tmp_path, *rows))
    assert said in str(refused.value)
    assert "train.toml" in str(refused.value)
    assert "line" in str(refused.value) or "vehicle" in str(refused.value)


def test_too_much_to_compute_and_other_kinds_of_files_are_refused(tmp_path):
    long = HEAD.replace("0.3", "3600.0\nstep_s = 0.000001")
    with pytest.raises(BadInput, match=r"are 3\.6e\+09 steps"):
        load_train(written(tmp_path, ROW.format("a", 5.0), ROW.format("c", 0.0), head=long))
    with pytest.raises(BadInput, match="this is a spring model; a train file is wanted here"):
        load_train(FOLDER / "category-a-elastomer.toml")


@pytest.mark.slow
def test_the_command_writes_figures_table_and_picture(tmp_path):
    file = written(tmp_path, ROW.format("a", 6.0) + "count = 2\n", ROW.format("c", 0.0) + "gap_mm = 20\n")
    file.write_text(file.read_text().replace("gap_mm = 20", "gap_mm = 20.0"))
    done = bufferstand(
        "model", "train", file, "--json", "-", "--out", tmp_path / "t.csv", "--picture", tmp_path / "t.png"
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["schema"] == "bufferstand/train/1"
    assert [vehicle["name"] for vehicle in found["vehicles"]] == ["a 1", "a 2", "c"]
    assert found["gaps"][1]["between"] == ["a 2", "c"]
    assert found["largest_push_kN"] == max(gap["largest_push_kN"] for gap in found["gaps"]) > 100.0
    assert found["ledger_gap"] < 0.005
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert lines[0].startswith("time [s],speed_1 [m/s]")
    last = [float(cell) for cell in lines[-1].split(",")]
    assert last[1:4] == pytest.approx([v["speed_after_m_per_s"] for v in found["vehicles"]], rel=1e-8)
    assert (tmp_path / "t.png").read_bytes().startswith(b"\x89PNG")
    wrong = bufferstand("model", "train", FOLDER / "draw-hook-elastomer.toml")
    assert wrong.returncode == 2
    assert "Traceback" not in wrong.stderr
