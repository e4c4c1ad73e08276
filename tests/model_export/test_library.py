"""I13: the prebuilt library against the Python stepper, and everything a host may do wrong."""

from __future__ import annotations

import ctypes
import shutil

import numpy as np
import pytest

from bufferstand.model.simulation import force_history, simulate
from bufferstand.model.stepper import SpringStepper
from tests.model_export.cases import springs, stepped, wandering
from tests.model_export.host import (
    CO_SIMULATION,
    DISCARD,
    ERROR,
    MODEL_EXCHANGE,
    OK,
    EventInfo,
    Host,
    Refused,
)

MM = {"units": "mm-kN"}


@pytest.fixture
def host(exported):
    """Give hosts, and close them."""
    opened = []

    def give(name="buffer", kind=CO_SIMULATION, options=MM, **more):
        opened.append(Host(exported(name, **options)[1], kind, **more))
        return opened[-1]

    yield give
    for one in opened:
        one.close()


@pytest.mark.parametrize("name", springs())
@pytest.mark.parametrize("dt_s", [0.001, 0.037])
def test_co_simulation_gives_the_bits_of_the_stepper(host, name, dt_s):
    """Same operations in the same order: equal to the last bit, in all six figures."""
    model = springs()[name]
    strokes = wandering(model)
    spring = host(name).start(initial_temperature_C=28.0, ambient_C=19.0)
    assert np.array_equal(spring.run(strokes, dt_s), stepped(model, strokes, dt_s, 28.0, 19.0))


def test_it_is_the_vectorised_simulation_too(host):
    """From a stroke and band position of its own, which the stepper cannot begin with."""
    model = springs()["spectrum"]
    strokes = 40.0 + wandering(model) / 3.0
    time = np.arange(len(strokes)) * 0.001
    whole = simulate(model, time, strokes, temperature_C=31.0, ambient_C=20.0, initial_band=0.4)
    spring = host("spectrum").start(
        "stroke_mm", strokes[0], initial_temperature_C=31.0, ambient_C=20.0, initial_band=0.4
    )
    assert spring.get("force_kN") == pytest.approx(whole.force_kN[0], abs=1e-9)
    found = spring.run(strokes[1:], 0.001)
    assert found[:, 0] == pytest.approx(whole.force_kN[1:], abs=1e-8)
    assert found[:, 1] == pytest.approx(whole.temperature_C[1:], abs=1e-9)
    assert found[:, 3] == pytest.approx(whole.heat_J[1:], abs=1e-6)


def test_isothermal_keeps_the_temperature_and_counts_the_heat(host):
    model = springs()["buffer"]
    strokes = wandering(model)
    spring = host()
    spring.switch("isothermal", True)
    spring.start(initial_temperature_C=40.0)
    found = spring.run(strokes, 0.001)
    time = np.arange(len(strokes)) * 0.001
    whole = simulate(model, time, strokes, temperature_C=40.0, isothermal=True)
    assert np.all(found[:, 1] == 40.0)
    assert found[:, 0] == pytest.approx(whole.force_kN, abs=1e-8)
    assert found[-1, 3] == pytest.approx(whole.heat_J[-1], rel=1e-9)


def test_the_sign_switch_mirrors_stroke_and_force_only(host):
    """I14: an inverted spring under the mirrored stroke is the same spring."""
    strokes = wandering(springs()["buffer"])
    plain = host().start().run(strokes, 0.001)
    turned = host()
    turned.switch("sign_inverted", True)
    mirrored = turned.start().run(-strokes, 0.001)
    mirrored[:, 0] *= -1.0
    assert np.array_equal(plain, mirrored)
    assert plain[:, 0].max() > 300.0


def test_the_stroke_rate_takes_the_step_to_its_end(host):
    x = wandering(springs()["buffer"], 1000)
    plain = host().start().run(x[1:], 0.001)
    spring = host().start()
    for k in range(len(x) - 1):
        spring.set("stroke_mm", x[k])
        spring.set("stroke_rate_mm_per_s", (x[k + 1] - x[k]) / 0.001)
        assert spring.do_step(0.001 * k, 0.001) == OK
    assert spring.get("force_kN") == pytest.approx(plain[-1, 0], abs=1e-9)
    assert spring.get("work_J") == pytest.approx(plain[-1, 4], rel=1e-12)


def test_parameters_reach_the_law(host):
    """Every real parameter changes what it is for."""
    x = wandering(springs()["spectrum"], 1500)
    plain = host("spectrum").start().run(x, 0.01)
    for name, value, column in (
        ("initial_temperature_C", 60.0, 1),
        ("ambient_C", -20.0, 1),
        ("initial_band", 0.7, 0),
        ("sensitivity_per_K", 0.002, 0),
        ("loss_sensitivity_per_K", 0.01, 3),
        ("capacity_J_per_K", 900.0, 1),
        ("loss_W_per_K", 300.0, 1),
        ("sensor_lag_s", 0.5, 2),
        ("sensor_gain", 0.5, 2),
        ("beta", 0.2, 0),
        ("tau_s", 0.3, 0),
        ("spectrum_per_decade", 0.2, 0),
        ("stop_stiffness_kN_per_mm", 50.0, 0),
    ):
        found = host("spectrum").start(**{name: value}).run(x, 0.01)
        assert np.abs(found - plain).max(axis=0)[column] > 1e-3, name
    cold = host("spectrum").start(initial_temperature_C=130.0, floor=0.5).run(x, 0.01)
    assert np.abs(cold - host("spectrum").start(initial_temperature_C=130.0).run(x, 0.01)).max() > 1.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("capacity_J_per_K", 0.0),
        ("tau_s", -1.0),
        ("floor", 0.0),
        ("floor", 1.5),
        ("initial_band", 1.1),
        ("beta", -0.1),
        ("initial_temperature_C", -300.0),
        ("stop_stiffness_kN_per_mm", 0.0),
    ],
)
def test_a_parameter_out_of_range_is_refused_by_name(host, name, value):
    with pytest.raises(Refused, match=name.removesuffix("_kN_per_mm")):
        host().start(**{name: value})


def test_a_parameter_that_is_no_number_is_refused(host):
    spring = host()
    assert spring.set_status("beta", float("nan")) == ERROR
    assert spring.messages == ["parameter beta is no number"]


def test_an_input_that_is_no_number_is_discarded_and_changes_nothing(host):
    spring, twin = host().start(), host().start()
    x = wandering(springs()["buffer"], 200)
    spring.run(x, 0.001)
    for bad in (float("nan"), float("inf"), 1e200):
        assert spring.set_status("stroke_mm", bad) == DISCARD
        assert spring.do_step(0.2, 0.001) == DISCARD
    assert "the stroke is no number" in spring.messages
    spring.set("stroke_mm", 0.0)
    assert spring.set_status("stroke_rate_mm_per_s", float("nan")) == DISCARD
    assert spring.do_step(0.2, 0.001) == DISCARD
    spring.set("stroke_rate_mm_per_s", 0.0)
    twin.run(x, 0.001)
    more = np.linspace(0.0, 60.0, 50)
    assert np.array_equal(spring.run(more, 0.001), twin.run(more, 0.001))


@pytest.mark.parametrize("step", [-0.001, float("nan")])
def test_an_impossible_step_is_an_error(host, step):
    spring = host().start()
    assert spring.do_step(0.0, step) == ERROR
    assert "step size" in spring.messages[-1]


def test_calls_out_of_order_are_errors(host):
    spring = host()
    assert spring.do_step(0.0, 0.001) == ERROR
    spring.start()
    assert spring.status("fmi2EnterInitializationMode") == ERROR
    assert spring.set_status("beta", 0.1) == ERROR
    assert spring.set_status("force_kN", 1.0) == ERROR
    assert spring.status("fmi2CompletedIntegratorStep", 1, None, None) == ERROR
    assert spring.set_status("ambient_C", -10.0) == OK  # tunable
    unknown = ctypes.byref(ctypes.c_uint(999))
    assert spring.status("fmi2GetReal", unknown, 1, ctypes.byref(ctypes.c_double())) == ERROR
    assert spring.status("fmi2GetString", unknown, 1, None) == ERROR
    spring.call("fmi2Terminate")
    assert spring.do_step(0.0, 0.001) == ERROR
    spring.call("fmi2Reset")
    spring.start()
    assert spring.do_step(0.0, 0.001) == OK


def test_reset_forgets_everything(host):
    x = wandering(springs()["buffer"], 500)
    spring = host().start(ambient_C=5.0, beta=0.3)
    spring.run(x, 0.001)
    spring.call("fmi2Reset")
    assert np.array_equal(spring.start().run(x, 0.001), host().start().run(x, 0.001))


def test_instances_do_not_know_each_other(host):
    """Stepped in turns, of different springs, each gives what it gives alone."""
    x = {name: wandering(springs()[name], 300) for name in ("buffer", "hook")}
    alone = {name: host(name).start().run(x[name], 0.001) for name in x}
    pair = {name: host(name).start() for name in x}
    for k in range(300):
        for name, one in pair.items():
            assert np.array_equal(one.run(x[name][k : k + 1], 0.001)[0], alone[name][k])


def test_a_state_can_be_kept_taken_back_and_carried_to_another_instance(host):
    """As a multibody solver does that rejects a step; and through bytes, as a checkpoint does."""
    x = wandering(springs()["spectrum"], 900)
    straight = host("spectrum").start().run(x, 0.001)
    spring = host("spectrum").start()
    spring.run(x[:400], 0.001)
    kept = spring.snapshot()
    spring.run(x[700:], 0.001)
    spring.call("fmi2SetFMUstate", kept)
    assert np.array_equal(spring.run(x[400:], 0.001), straight[400:])

    size = ctypes.c_size_t()
    spring.call("fmi2SerializedFMUstateSize", kept, ctypes.byref(size))
    content = ctypes.create_string_buffer(size.value)
    spring.call("fmi2SerializeFMUstate", kept, content, size)
    spring.call("fmi2FreeFMUstate", ctypes.byref(kept))
    assert not kept
    other = host("spectrum").start()
    carried = ctypes.c_void_p()
    other.call("fmi2DeSerializeFMUstate", content, size, ctypes.byref(carried))
    other.call("fmi2SetFMUstate", carried)
    assert np.array_equal(other.run(x[400:], 0.001), straight[400:])
    other.call("fmi2FreeFMUstate", ctypes.byref(carried))

    stranger = host("hook").start()
    wrong = ctypes.c_void_p()
    assert stranger.status("fmi2DeSerializeFMUstate", content, size, ctypes.byref(wrong)) == ERROR
    assert stranger.status("fmi2SetFMUstate", wrong) == ERROR
    stranger.call("fmi2FreeFMUstate", ctypes.byref(wrong))
    shorter = ctypes.c_size_t(size.value - 1)
    assert other.status("fmi2DeSerializeFMUstate", content, shorter, ctypes.byref(wrong)) == ERROR


def test_leaving_the_identified_temperatures_is_told_once(host):
    spring = host().start(initial_temperature_C=-30.0)
    spring.run(wandering(springs()["buffer"], 50), 0.001)
    assert len(spring.messages) == 1
    assert "-30.0 degC leaves the 15 ... 75 degC" in spring.messages[0]


class TestResources:
    @pytest.mark.parametrize("name", ["plain", "with space", "hundred % äöü", "a#b?c"])
    def test_any_folder_is_found_by_its_uri(self, exported, tmp_path, name):
        content = exported(**MM)[1]
        place = tmp_path / name / "resources"
        shutil.copytree(content / "resources", place)
        for uri in (
            place.as_uri(),
            place.as_uri().replace("file://", "file:"),
            f"{place.as_uri()}/",
            str(place),
        ):
            Host(content, CO_SIMULATION, uri=uri).close()
        Host(content, CO_SIMULATION, uri=place.as_uri().replace("file:///", "file://localhost/")).close()

    @pytest.mark.parametrize(
        ("damage", "told"),
        [
            (lambda b: b[:-8], "too short or too long"),
            (lambda b: b + b"\0", "too short or too long"),
            (lambda b: b[:5000] + bytes([b[5000] ^ 1]) + b[5001:], "checksum"),
            (lambda b: b"NOTATABLE" + b[9:], "no table of a bufferstand spring"),
            (lambda b: b[:12] + b"\xff\xff\xff\xff" + b[16:], "number of cells"),
            (lambda b: b[:8] + b[11:7:-1] + b[12:], "byte order"),
            (lambda b: b[:0], "no table of a bufferstand spring"),
        ],
    )
    def test_a_bad_table_is_told_through_the_logger(self, exported, tmp_path, damage, told):
        content = exported(**MM)[1]
        (tmp_path / "spring.bin").write_bytes(damage((content / "resources" / "spring.bin").read_bytes()))
        with pytest.raises(Refused, match=told):
            Host(content, CO_SIMULATION, uri=tmp_path.as_uri())

    def test_numbers_that_no_spring_has_are_refused(self, exported, tmp_path):
        """With a right checksum: a falling integral, NaN, a step of 0."""
        import zlib

        content = exported(**MM)[1]
        whole = (content / "resources" / "spring.bin").read_bytes()
        for place, value in ((64, 0.0), (64 + 8, float("nan")), (64 + 8 * 35, -1.0), (64 + 8 * 39, 1e-9)):
            body = bytearray(whole[24:])
            body[place - 24 : place - 16] = np.float64(value).tobytes()
            head = whole[:16] + zlib.crc32(body).to_bytes(4, "little") + whole[20:24]
            (tmp_path / "spring.bin").write_bytes(head + body)
            with pytest.raises(Refused, match="the table of the spring holds"):
                Host(content, CO_SIMULATION, uri=tmp_path.as_uri())

    def test_a_missing_table_and_a_foreign_guid_are_told(self, exported, tmp_path):
        content = exported(**MM)[1]
        with pytest.raises(Refused, match=r"cannot be opened: .*spring\.bin"):
            Host(content, CO_SIMULATION, uri=tmp_path.as_uri())
        with pytest.raises(Refused, match="belongs to another FMU"):
            Host(content, CO_SIMULATION, guid="{1}")


class TestModelExchange:
    def advance(self, spring, t, x, inner):
        """One completed step of a solver that is given the exact inner stroke."""
        spring.call("fmi2SetTime", ctypes.c_double(t))
        spring.set("stroke_mm", x)
        spring.call("fmi2SetContinuousStates", ctypes.byref(ctypes.c_double(inner)), 1)
        flags = ctypes.c_int(), ctypes.c_int()
        spring.call("fmi2CompletedIntegratorStep", 1, ctypes.byref(flags[0]), ctypes.byref(flags[1]))
        assert (flags[0].value, flags[1].value) == (0, 0)

    def begin(self, host, name, **reals):
        spring = host(name, MODEL_EXCHANGE).start(**reals)
        spring.call("fmi2NewDiscreteStates", ctypes.byref(EventInfo()))
        spring.call("fmi2EnterContinuousTimeMode")
        return spring

    @pytest.mark.parametrize("name", springs())
    def test_completed_steps_give_the_library(self, host, name):
        """With an exact inner stroke the force is the stepper's; heat and temperature on its finer path."""
        model = springs()[name]
        count, pieces = 300, 100
        x = np.abs(wandering(model, count)) / 2.0
        fine = np.interp(np.arange((count - 1) * pieces + 1) / pieces, np.arange(count), x)[1:]
        whole = stepped(model, fine, 0.001 / pieces, 25.0, 25.0)[pieces - 1 :: pieces]
        spring = self.begin(host, name, initial_temperature_C=25.0, ambient_C=25.0)
        lag, (kept, added) = 0.0, model.viscous.response(0.001)
        rows = []
        for k in range(1, count):
            lag = lag * kept + (min(x[k], model.curves.end_mm) - min(x[k - 1], model.curves.end_mm)) * added
            self.advance(spring, 0.001 * k, x[k], min(x[k], model.curves.end_mm) - lag)
            rows.append([spring.get(n) for n in ("force_kN", "temperature_C", "heat_J", "work_J", "band")])
        found, span = np.array(rows), np.ptp(whole[:, 0])
        assert np.abs(found[:, 0] - whole[:, 0]).max() < 1e-6 * span
        assert np.abs(found[:, 4] - whole[:, 5]).max() < 1e-9
        assert np.abs(found[:, 1] - whole[:, 1]).max() < 1e-4
        assert np.abs(found[:, 2] - whole[:, 3]).max() < 1e-4 * whole[-1, 3] + 1e-9
        assert np.abs(found[:, 3] - whole[:, 4]).max() < 1e-4 * np.abs(whole[:, 4]).max()

    def test_a_wagon_runs_into_it(self, host):
        """10 t at 1.9 m/s, Runge-Kutta of 1 ms with trials, against the library in steps of 10 µs."""
        model, mass_t = springs()["hook"], 10.0
        spring, names = self.begin(host, "hook"), ("stroke_mm", "stroke_rate_mm_per_s")

        def slopes(t, x, v):
            spring.call("fmi2SetTime", ctypes.c_double(t))
            for name, value in zip(names, (x, v), strict=True):
                spring.set(name, value)
            return v, -spring.get("force_kN") / mass_t * 1000.0

        t, x, v, h = 0.0, 0.0, 1900.0, 0.001
        while x >= 0.0:
            a = slopes(t, x, v)
            b = slopes(t + h / 2, x + h / 2 * a[0], v + h / 2 * a[1])
            c = slopes(t + h / 2, x + h / 2 * b[0], v + h / 2 * b[1])
            d = slopes(t + h, x + h * c[0], v + h * c[1])
            x += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
            v += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
            t += h
            self.advance(spring, t, x, 0.0)

        whole = SpringStepper(model, 25.0, 25.0)
        y, w, h = 0.0, 1900.0, 1e-5
        while y >= 0.0:
            w -= h * whole.force_kN / mass_t * 1000.0
            y += h * w
            whole.step(y, h)
        assert 1.0 - (v / 1900.0) ** 2 == pytest.approx(1.0 - (w / 1900.0) ** 2, abs=2e-3)
        assert spring.get("heat_J") == pytest.approx(whole.heat_J, rel=5e-3)
        lost_J = 0.5e-3 * mass_t * (1900.0**2 - v**2)  # t (mm/s)² is mJ
        assert spring.get("heat_J") == pytest.approx(
            lost_J, rel=1e-2
        )  # warming takes the rest, docs/model.md

    def test_a_trial_changes_nothing(self, host):
        """A solver looks about before it completes a step."""
        spring, twin = self.begin(host, "spectrum"), self.begin(host, "spectrum")
        for k in range(1, 40):
            for trial in (0.5 * k - 3.0, 0.5 * k + 9.0):
                spring.call("fmi2SetTime", ctypes.c_double(0.001 * k + 0.0007))
                spring.set("stroke_mm", trial)
                spring.get("force_kN")
            for one in (spring, twin):
                self.advance(one, 0.001 * k, 0.5 * k, 0.0)
            assert spring.get("force_kN") == twin.get("force_kN")
            assert spring.get("heat_J") == twin.get("heat_J")

    def test_states_derivatives_and_indicators(self, host):
        spring = self.begin(host, "buffer")
        spring.set("stroke_mm", 30.0)
        spring.set("stroke_rate_mm_per_s", -7.0)
        spring.call("fmi2SetContinuousStates", ctypes.byref(ctypes.c_double(20.0)), 1)
        one, three = ctypes.c_double(), (ctypes.c_double * 3)()
        spring.call("fmi2GetDerivatives", ctypes.byref(one), 1)
        assert one.value == pytest.approx(10.0 / springs()["buffer"].viscous.tau_s, rel=1e-15)
        spring.call("fmi2GetEventIndicators", three, 3)
        assert list(three) == [-7.0, 30.0, -75.0]
        spring.call("fmi2GetContinuousStates", ctypes.byref(one), 1)
        assert one.value == 20.0
        spring.call("fmi2GetNominalsOfContinuousStates", ctypes.byref(one), 1)
        assert one.value == 10.0
        assert spring.status("fmi2GetDerivatives", three, 3) == ERROR
        band = np.array([spring.get("band")])
        expected = force_history(springs()["buffer"], np.array([30.0]), band, np.array([10.0]), 25.0)
        assert spring.get("force_kN") == pytest.approx(expected[0], abs=1e-9)

    def test_a_jump_of_the_stroke_in_event_mode_is_a_step_of_no_time(self, host):
        model = springs()["buffer"]
        spring = self.begin(host, "buffer")
        spring.call("fmi2EnterEventMode")
        spring.set("stroke_mm", 50.0)
        spring.call("fmi2NewDiscreteStates", ctypes.byref(EventInfo()))
        expected = stepped(model, np.linspace(0.0, 50.0, 1001)[1:], 0.0, 25.0, 25.0)[-1]
        assert spring.get("force_kN") == pytest.approx(expected[0], abs=1e-6)
        assert spring.get("band") == pytest.approx(expected[5], abs=1e-12)
        assert spring.get("heat_J") == pytest.approx(expected[3], rel=1e-6)

    def test_an_input_that_is_no_number_is_discarded(self, host):
        spring = self.begin(host, "buffer")
        assert spring.set_status("stroke_mm", float("nan")) == DISCARD
        one = ctypes.c_double()
        assert spring.status("fmi2GetDerivatives", ctypes.byref(one), 1) == DISCARD
        assert (
            spring.status("fmi2SetContinuousStates", ctypes.byref(ctypes.c_double(float("nan"))), 1)
            == DISCARD
        )
