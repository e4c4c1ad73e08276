"""Wiring that was right at first: what jumps, freezes or comes late on, and when it must be named.

``python -m tests.daq.wiring_later M`` judges every kind on M stands at random.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tests.daq.wiring_bench import Case, Floats, Signals, Verdict, Wrong, judge, late, scaled, signals_of
from tests.daq.wiring_kinds import plain_case, right_case

When = Callable[[Signals], float]
"""Returns the moment from which on something is wrong [s]."""


@dataclass(frozen=True)
class Later:
    """What goes wrong, from when on, the sensor to be named, what is said of it and the key to look at."""

    wrong: Callable[[float], Wrong]
    when: When
    sensor: str
    doubts: tuple[str, ...]
    key: str
    within_s: float = 1.0
    """Named so long after it has happened at the latest."""


def loading(signals: Signals) -> float:
    """Return when the first stroke is half done."""
    return _at(signals, int(np.argmax(signals.true_mm > 0.5 * signals.first_full_mm)))


def unloading(signals: Signals) -> float:
    """Return when the specimen has gone back by a fifth of its first stroke."""
    first = signals.time_s < 2.2 * signals.first_full_mm / signals.case.static_mm_per_s
    peak = int(np.argmax(np.where(first, signals.true_mm, 0.0)))
    back = signals.true_mm[peak:] < 0.8 * signals.true_mm[peak]
    return _at(signals, peak + int(np.argmax(back)))


def in_the_sine(signals: Signals) -> float:
    """Return a moment amid the last waveform."""
    last = np.flatnonzero(signals.true_mm > 1.0)[-1]
    return float(signals.time_s[last]) - 1.5 / signals.case.sines[-1][2] - 2.0


def begun(signals: Signals) -> float:
    """Return when the piston comes to the specimen: a lateness shows from here on."""
    return _at(signals, int(np.argmax(signals.values["command"] > 0.0)))


def _at(signals: Signals, row: int) -> float:
    return float(signals.time_s[row])


def frozen(name: str) -> Callable[[float], Wrong]:
    """Let a force stand still from a moment on."""

    def at(from_s: float) -> Wrong:
        def hold(time: Floats, value: Floats) -> Floats:
            first = int(np.searchsorted(time, from_s))
            return np.where(time >= from_s, value[max(first - 1, 0)], value)

        def wrong(signals: Signals) -> Signals:
            if name == "force_2":
                return replace(signals, second_kN=hold(signals.second_s, signals.second_kN))
            held = hold(signals.time_s, signals.values[name])
            return replace(signals, values={**signals.values, name: held})

        return wrong

    return at


def jumps(name: str, by_kN: float) -> Callable[[float], Wrong]:
    """Let a force jump."""
    return lambda from_s: scaled(name, plus=by_kN, from_s=from_s)


def comes_late(*names: str, by_s: float) -> Callable[[float], Wrong]:
    """Let channels come late, from the beginning on."""
    return lambda _: late(*names, by_s=by_s)


def _frozen(name: str, when: When) -> Later:
    return Later(frozen(name), when, name, ("still",), "amplifier", 1.6)


def _jump(name: str, by_kN: float, when: When) -> Later:
    return Later(jumps(name, by_kN), when, name, ("zero",), "calibration", 1.5)


def _late(by_s: float, *names: str) -> Later:
    return Later(comes_late(*names, by_s=by_s), begun, ", ".join(names), ("delay",), "delay_s", by_s + 1.2)


def _slips(by_mm: float, when: When) -> Later:
    wrong = lambda from_s: scaled("position", plus=by_mm, from_s=from_s)  # noqa: E731
    return Later(wrong, when, "position", ("slipped",), "calibration", 1.0)


def _rescaled(by: float, when: When) -> Later:
    wrong = lambda from_s: scaled("position", by=by, from_s=from_s)  # noqa: E731
    return Later(wrong, when, "position", ("slipped", "scale"), "calibration", 7.0)


LATER_ON: Mapping[str, Later] = {
    "force_2 freezes, loading": _frozen("force_2", loading),
    "force_2 freezes, unloading": _frozen("force_2", unloading),
    "force_2 freezes in a sine": _frozen("force_2", in_the_sine),
    "force +5 kN, loading": _jump("force", 5.0, loading),
    "force +5 kN, unloading": _jump("force", 5.0, unloading),
    "force −5 kN in a sine": _jump("force", -5.0, in_the_sine),
    "force_2 +5 kN, loading": _jump("force_2", 5.0, loading),
    "force_2 −5 kN in a sine": _jump("force_2", -5.0, in_the_sine),
    "force half as much at once": Later(
        lambda from_s: scaled("force", by=0.5, from_s=from_s),
        loading,
        "force",
        ("scale", "zero"),
        "calibration",
        2.0,
    ),
    "piston 0.5 s late": _late(0.5, "position"),
    "piston 0.2 s late": _late(0.2, "position"),
    "piston slips by 8 mm, loading": _slips(8.0, loading),
    "piston slips by −8 mm, loading": _slips(-8.0, loading),
    "piston slips by 8 mm, unloading": _slips(8.0, unloading),
    "piston 1.1 times at once, loading": _rescaled(1.1, loading),
    "piston 1.1 times at once, unloading": _rescaled(1.1, unloading),
    "wire 0.3 s late": _late(0.3, "stroke_1"),
    "wire 0.5 s late": _late(0.5, "stroke_2"),
    "wires 0.3 s late": _late(0.3, "stroke_1", "stroke_2"),
    "wires 0.8 s late": _late(0.8, "stroke_1", "stroke_2"),
}


def rough_case(seed: int) -> Case:
    """Return a right campaign at random in which much else goes on: holes of the second force, a program that
    stands still for up to a second, hum, an amplifier that warms up, sines up to 3 Hz."""
    random, own = np.random.default_rng(seed + 500), right_case(seed)
    (mean, amplitude, frequency, cycles), *others = own.sines
    small = min(amplitude, 300.0 / (2.0 * np.pi * 3.0))
    quick = [(mean, small, 3.0, cycles)] if random.integers(3) == 0 else []
    return replace(
        own,
        sines=((mean, amplitude, frequency, cycles), *others, *quick),
        force_2_Hz=float(random.choice([10.0, 50.0, 250.0])),
        second_lost=float(random.choice([0.0, 0.02, 0.3])),
        stalls_s=float(random.choice([0.0, 0.1, 0.4, 1.0])),
        hum_kN=float(random.choice([0.0, 0.1, 0.3])),
        drift_kN_per_min=float(random.choice([-0.3, 0.0, 0.3])),
    )


def rough_alarms(seeds: Iterable[int], speed: float = 1.0, second_late_s: float = 0.0) -> list[str]:
    """Return what was doubted of them, on stands of a speed whose second force is stamped late."""
    found = []
    for seed in seeds:
        signals = signals_of(replace(rough_case(seed), speed=speed))
        verdict = judge(replace(signals, second_s=signals.second_s + second_late_s))
        if verdict.trip is not None:
            found.append(f"{seed}: {verdict.trip.reason}")
    return found


def judged(later: Later, signals: Signals) -> tuple[Verdict, float]:
    """Return what is said of it, and how long after it has happened [s]."""
    from_s = later.when(signals)
    verdict = judge(later.wrong(from_s)(signals))
    return verdict, verdict.at_s - from_s


def main(stands: int) -> None:
    """Print what is said of every kind, and of so many right stands."""
    alarms = rough_alarms(range(stands))
    print(f"{stands} right stands, {len(alarms)} doubted", *alarms, sep="\n  ")
    for name, later in LATER_ON.items():
        said: dict[str, int] = {}
        slowest_s = 0.0
        for seed in range(stands):
            case = replace(Case() if seed == 0 else plain_case(seed), force_2_Hz=250.0)
            verdict, after_s = judged(later, signals_of(case))
            trip = verdict.trip
            slowest_s = max(slowest_s, after_s if trip else np.inf)
            what = "nothing" if trip is None else f"{trip.sensor}: {trip.doubt} ({trip.setting[-30:]})"
            said[what] = said.get(what, 0) + 1
        print(f"{name:28s} {slowest_s:5.2f} s  " + "; ".join(f"{n} × {what}" for what, n in said.items()))


if __name__ == "__main__":
    main(int(sys.argv[1]))
