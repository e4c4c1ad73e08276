"""What the suite may order on a real stand: proved on a controller that writes down every order it gets."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from bufferstand.drivers.interfaces import Controller
from bufferstand.foundation.errors import CommandRejected
from bufferstand.foundation.motions import ControllerMotion, Harmonic, RampTo, Release, StaticCycles
from tests.contract.controller import backends
from tests.contract.controller.announced import Announced, Bounds, OutOfBounds, confirmed_at

ROOT = Path(__file__).parents[3]
STAND = "simulated-630kN"
QUIET = {"hold", "release"}


def run_on_hardware(folder: Path, *words: str) -> tuple[subprocess.CompletedProcess[str], list[Any]]:
    """Run the suite as a laboratory does, on a recorded controller; return what it said and ordered."""
    path, orders = backends.write_stand(folder, {}), folder / "orders"
    orders.touch()
    done = subprocess.run(
        [
            sys.executable, "-m", "pytest", "-p", "tests.contract.controller.recorded", "-q", "-rs",
            "tests/contract/controller/test_controller.py", "--hardware", str(path), *words,
        ],
        cwd=ROOT,
        env={**os.environ, "ORDERS": str(orders), "PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        start_new_session=True,  # no terminal, also where the tests have one
        timeout=600,
        check=False,
    )  # fmt: skip
    return done, [json.loads(line) for line in orders.read_text().splitlines()]


def test_no_order_of_the_suite_goes_beyond_what_it_announces(tmp_path: Path) -> None:
    done, orders = run_on_hardware(tmp_path, "--yes-move", STAND)
    assert done.returncode == 0, done.stdout
    said = re.search(
        r"piston at most ([\d.]+) mm from first contact, at most ([\d.]+) mm/s; "
        r"limits of the device are set to ([\d.]+) kN and ([\d.]+) mm",
        done.stdout,
    )
    assert said, done.stdout
    stroke_mm, speed_mm_per_s, force_kN, limit_mm = map(float, said.groups())
    moving = [(name, named) for name, values, named in orders if name not in QUIET and not values]
    names = {name for name, _ in moving}
    assert {"ramp", "harmonic", "static", "enable"} <= names, "it tries nothing"
    for name, named in moving:
        reached = named.get("target_mm", named.get("stroke_limit_mm", 0.0))
        speed = named.get("speed_mm_per_s", 0.0)
        if "mean_mm" in named:
            reached = named["mean_mm"] + named["amplitude_mm"]
            speed = 2 * math.pi * named.get("frequency_Hz", 1.0) * named["amplitude_mm"]
        if name == "enable":
            assert named["stroke_limit_mm"] <= limit_mm
        else:
            assert -0.1 <= reached <= stroke_mm, (name, named)
        assert 0.0 <= speed <= speed_mm_per_s, (name, named)
        assert named.get("force_limit_kN", 0.0) <= force_kN, (name, named)
    announced = re.findall(r"NEXT: (\w+)", done.stdout)
    ordered = [name for name, _, named in orders if named or name in QUIET]
    assert [name for name in announced if name != "disable"] == ordered, "each is announced, in order"
    assert "never on a real stand: a controller that took it would do harm" in done.stdout


@pytest.mark.parametrize(
    ("words", "told"),
    [
        pytest.param((), f"add --yes-move {STAND}", marks=pytest.mark.long),
        (("--yes-move", "S2"), f"“S2” was given, and the stand is “{STAND}”"),
    ],
)
def test_without_consent_nothing_is_ordered(tmp_path: Path, words: tuple[str, ...], told: str) -> None:
    done, orders = run_on_hardware(tmp_path, *words)
    assert done.returncode == 2
    assert told in done.stdout
    assert orders == []


class Deaf:
    """Takes every order, and says which it took."""

    def __init__(self) -> None:
        self.taken: list[str] = []

    def start(self, motion: ControllerMotion) -> None:
        self.taken.append(motion.name)

    def __getattr__(self, name: str) -> Any:
        return lambda **_: self.taken.append(name)


def announced(deaf: Deaf, lines: list[str], *, agrees: bool = True) -> Controller:
    return Announced(deaf, Bounds(), lines.append, lambda _: agrees)  # type: ignore[return-value, arg-type]


@pytest.mark.parametrize(
    "order",
    [
        RampTo(61.0, 20.0),
        RampTo(-5.0, 20.0),
        RampTo(10.0, 6000.0),
        RampTo(math.nan, 20.0),
        Harmonic(15.0, 2.0, 0.5, 1),
        Harmonic(1.0, 2.0, 0.5, 1),
        Harmonic(10.0, 5.0, 2.0, 1),
        StaticCycles(20.0, 300.0, 16.0, 1, 0.0),
        StaticCycles(20.0, 35.0, 18.0, 1, 0.0),
        {"force_limit_kN": 300.0, "stroke_limit_mm": 20.0, "watchdog_ms": 5000},
        {"force_limit_kN": 60.0, "stroke_limit_mm": 60.0, "watchdog_ms": 5000},
    ],
)
def test_an_order_beyond_the_bounds_is_not_sent(order: ControllerMotion | dict[str, float]) -> None:
    deaf = Deaf()
    careful: Any = announced(deaf, [])
    give = partial(careful.enable, **order) if isinstance(order, dict) else partial(careful.start, order)
    with pytest.raises(OutOfBounds):
        give()
    assert deaf.taken == []
    assert not issubclass(OutOfBounds, CommandRejected), "no test takes it for a refusal of the controller"


def test_while_the_operator_thinks_the_stand_is_kept_alive() -> None:
    ours, theirs = os.openpty()
    fed: list[Any] = []

    def feed() -> None:
        fed.append(len(fed))
        if len(fed) == 4:
            os.write(ours, b"\n")

    with os.fdopen(theirs, encoding="utf-8") as terminal:
        assert confirmed_at(terminal, fed.append)(feed)
        assert len(fed) >= 4, "asked, and fed three times"
        os.write(ours, b"no\n")
        assert not confirmed_at(terminal, fed.append)(feed)
    os.close(ours)


def test_what_the_operator_does_not_confirm_is_not_sent_but_a_release_always_is() -> None:
    deaf, lines = Deaf(), list[str]()
    careful = announced(deaf, lines, agrees=False)
    with pytest.raises(pytest.exit.Exception, match="the operator said no"):
        careful.start(RampTo(target_mm=5.0, speed_mm_per_s=5.0))
    assert deaf.taken == []
    assert lines == ["NEXT: ramp  target_mm 5, speed_mm_per_s 5"]
    careful.start(Release(speed_mm_per_s=20.0))
    careful.disable()
    assert deaf.taken == ["release", "disable"]
