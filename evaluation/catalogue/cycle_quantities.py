"""The quantities of a cycle, each said once (:mod:`bufferstand.evaluation.catalogue.quantity`).

A further quantity is an entry at the end of :data:`ENTRIES`, or one in a file of its own
(:mod:`bufferstand.evaluation.catalogue.every_quantity`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from bufferstand.evaluation.catalogue.quantity import (
    KINDS,
    NOT_FINITE,
    InCycles,
    OnScreen,
    Quantity,
    Rounding,
    Settled,
    Shown,
    Trended,
)

HARMONIC = frozenset({"harmonic"})
STROKE, BOTH, TEMPERATURE = frozenset({"stroke"}), frozenset({"force", "stroke"}), frozenset({"temperature"})
NOWHERE = Shown(
    main=False,
    heading="",
    cycles=None,
    beside_loops=False,
    runs=None,
    compared=None,
    before_after=False,
    settled=None,
    trend=None,
    terminal=None,
    archive=None,
    monitor=None,
)
"""In the document and the tables of data alone; entries say where else with ``replace``."""
_FEW = "too few samples to propagate it"
_FEW_READ = "too few samples"
_NO_ACCURACY = "a sensor on the specimen states no accuracy"


def _ratio(over: Any, under: Any) -> Any:
    """Return a ratio, NaN where what it is over is not positive."""
    return np.where(under > 0.0, over / under, np.nan)


def of_turns(
    name: str, symbol: str, label: str, meaning: str, shown: Shown, read: Callable[[Any], Any], **more: Any
) -> Quantity:
    """Return an entry that both turning points give: its draws are read as its values are."""
    facts: dict[str, Any] = {
        "rounding": Rounding(1),
        "source": "",
        "compute": read,
        "why_missing": NOT_FINITE,
        "propagate": read,
    }
    return Quantity(
        name=name, path=(name,), symbol=symbol, label=label, unit="mm", meaning=meaning, kinds=KINDS,
        reads=STROKE, needs="turns", why_no_u=_FEW, like="same", shown=shown, **(facts | more),
    )  # fmt: skip


def of_loop(
    name: str, symbol: str, label: str, unit: str, meaning: str, shown: Shown, **more: Any
) -> Quantity:
    """Return an entry that takes the whole loop; ``more`` says what it has of its own."""
    facts: dict[str, Any] = {
        "source": "",
        "kinds": KINDS,
        "reads": BOTH,
        "why_missing": NOT_FINITE,
        "why_no_u": _FEW,
        "like": "same",
    }
    return Quantity(
        name=name, path=(name,), symbol=symbol, label=label, unit=unit, meaning=meaning, needs="loop",
        shown=shown, **(facts | more),
    )  # fmt: skip


def _temperature(place: int, name: str, key: str, label: str, meaning: str, shown: Shown) -> Quantity:
    """Return an entry of the thermometers: ``place`` 0 is the temperature at the start, 1 the highest."""
    return Quantity(
        name=name,
        path=("temperature_C", key),
        symbol="T",
        label=label,
        unit="°C",
        rounding=Rounding(1),
        meaning=meaning,
        source="paper (5)–(7)",
        kinds=KINDS,
        reads=TEMPERATURE,
        needs="thermometer",
        compute=lambda readings: readings.both_C[place],
        why_missing=lambda readings, row: readings.why(row),
        propagate=lambda drawn: drawn.temperature(name),
        why_no_u=_NO_ACCURACY,
        like="same",
        shown=shown,
    )


def _motion(place: int, heading: str, **more: Any) -> Shown:
    """Return where a figure of the motion is shown: in the first of the report's tables of cycles."""
    return replace(NOWHERE, heading=heading, cycles=InCycles("motion", place), **more)


def _energy(place: int, heading: str, **more: Any) -> Shown:
    """Return the same of an energy or a stiffness: in the second table."""
    return replace(NOWHERE, heading=heading, cycles=InCycles("energy", place), **more)


_STIFFNESS = Rounding(3)
ISO = "ISO 4664-1"

ENTRIES = (
    of_turns(
        "stroke_min_mm", "x_min", "Stroke min.", "lower turning point of a cycle",
        replace(NOWHERE, heading="Stroke min."),
        lambda turns: turns.low_mm,
    ),
    of_turns(
        "stroke_max_mm", "x_max", "Stroke max.", "upper turning point of a cycle",
        _motion(3, "Stroke max."),
        lambda turns: turns.high_mm,
    ),
    of_turns(
        "prestress_mm", "x_m", "Prestress", "mean of the turning points",
        _motion(0, "Prestress", beside_loops=True, runs="mean"),
        lambda turns: turns.mean_mm,
        source="paper Fig. 4",
    ),
    of_turns(
        "amplitude_mm", "x_a", "Amplitude", "half the range of the stroke",
        _motion(1, "Amplitude", beside_loops=True, runs="mean"),
        lambda turns: 0.5 * turns.span_mm,
        rounding=Rounding(2), source=ISO,
    ),
    of_loop(
        "frequency_Hz", "f", "Frequency", "Hz", "one over the cycle's duration; ω = 2 π f",
        _motion(2, "Frequency", beside_loops=True, runs="mean",
            terminal=OnScreen("frequency\nHz", 3),
        ),
        rounding=Rounding(3, significant=3), kinds=HARMONIC, reads=STROKE,
        compute=lambda loops: 1.0 / loops.stack.turns.duration_s,
        propagate=lambda drawn: drawn.frequency_Hz,
        like="share",
    ),
    of_loop(
        "force_min_kN", "F_min", "Force min.", "kN",
        "least force of the loop; in `summary` the mean, in `extremes` that of all samples",
        _motion(4, "Force min.", beside_loops=True),
        rounding=Rounding(1),
        compute=lambda loops: loops.forces_kN[0],
        propagate=lambda drawn: drawn.forces_kN[0],
    ),
    of_loop(
        "force_max_kN", "F_max", "Force max.", "kN",
        "greatest force of the loop; in `summary` the mean, in `extremes` that of all samples",
        _motion(5, "Force max.", beside_loops=True, runs="extreme",
            compared="Largest force of a cycle, mean", before_after=True,
        ),
        rounding=Rounding(1),
        compute=lambda loops: loops.forces_kN[1],
        propagate=lambda drawn: drawn.forces_kN[1],
    ),
    of_loop(
        "speed_loading_max_mm_per_s", "v", "Speed of loading", "mm/s",
        "largest absolute speed of the loading branch",
        _motion(6, "Speed load."),
        rounding=Rounding(1), source="EN 15551", reads=STROKE,
        compute=lambda loops: loops.speeds_mm_per_s[0], why_missing=_FEW_READ,
        propagate=lambda drawn: drawn.speed("speed_loading_max_mm_per_s", drawn.loop.loading),
    ),
    of_loop(
        "speed_unloading_max_mm_per_s", "v", "Speed of unloading", "mm/s",
        "largest absolute speed of the unloading branch",
        _motion(7, "Speed unload."),
        rounding=Rounding(1), source="EN 15551", reads=STROKE,
        compute=lambda loops: loops.speeds_mm_per_s[1], why_missing=_FEW_READ,
        propagate=lambda drawn: drawn.speed("speed_unloading_max_mm_per_s", drawn.loop.unloading),
    ),
    of_loop(
        "stored_energy_J", "W_s", "Stored energy", "J", "area under the loading branch",
        _energy(0, "Stored Wₛ", main=True, runs="mean", compared="Stored energy Wₛ",
            before_after=True, settled=Settled(1, ""), terminal=OnScreen("stored\nJ", 0),
        ),
        rounding=Rounding(0, finer_below=1000.0), source="paper (1), EN 15551",
        compute=lambda loops: loops.stored_J,
        propagate=lambda drawn: drawn.stored_J,
        like="share",
    ),
    of_loop(
        "absorbed_energy_J", "W_a", "Absorbed energy", "J", "signed area of the loop",
        _energy(1, "Absorbed Wₐ", main=True, compared="Absorbed energy Wₐ", before_after=True,
            settled=Settled(0, "Wₐ"), terminal=OnScreen("absorbed\nJ", 0),
            monitor=OnScreen("absorbed", 0),
        ),
        rounding=Rounding(0, finer_below=1000.0), source="paper (1), (2)",
        compute=lambda loops: loops.absorbed_J,
        propagate=lambda drawn: drawn.absorbed_J,
    ),
    of_loop(
        "damping", "D", "Damping", "1", "W_a / W_s; not a material constant, not the loss factor",
        _energy(2, "Damping Wₐ/Wₛ", main=True, beside_loops=True, runs="mean",
            compared="Damping Wₐ/Wₛ", before_after=True, settled=Settled(2, "Wₐ/Wₛ"),
            trend=Trended(
                "damping", "Damping (absorbed over stored energy)", "Damping W$_a$/W$_s$ [–]",
                amplitudes=False, two_sided=False,
            ),
            terminal=OnScreen("damping ± U\n", 3), archive=OnScreen("damping", 3),
            monitor=OnScreen("damping", 3),
        ),
        rounding=Rounding(4), source="EN 15551",
        compute=lambda loops: _ratio(loops.absorbed_J, loops.stored_J),
        why_missing=lambda loops, row: f"the stored energy is not positive ({loops.stored_J[row]:.4g} J)",
        propagate=lambda drawn: drawn.absorbed_J / drawn.stored_J if np.all(drawn.stored_J > 0.0) else None,
        why_no_u="some draws of the stored energy are not positive",
    ),
    of_loop(
        "tangent_stiffness_kN_per_mm", "K_t", "Tangent stiffness", "kN/mm",
        "slope of the loading branch at mean stroke; the paper's dynamic stiffness",
        _energy(3, "Tangent stiffness", main=True, beside_loops=True, runs="mean",
            compared="Tangent stiffness", before_after=True, settled=Settled(3, "Tangent stiffness"),
            trend=Trended(
                "tangent_stiffness", "Tangent stiffness of the loading branch at mean stroke",
                "Tangent stiffness [kN/mm]", amplitudes=True, two_sided=True,
            ),
            terminal=OnScreen("tangent\nkN/mm", 2), archive=OnScreen("tangent kN/mm", 2),
            monitor=OnScreen("tangent stiffness", 2),
        ),
        rounding=_STIFFNESS, source="paper Fig. 8b",
        compute=lambda loops: loops.tangent_kN_per_mm,
        why_missing="too few samples about the mean stroke",
        propagate=lambda drawn: drawn.tangent_kN_per_mm,
    ),
    of_loop(
        "secant_stiffness_kN_per_mm", "K_pp", "Secant stiffness", "kN/mm",
        "force difference of the turning points over the range",
        _energy(4, "Secant stiffness"),
        rounding=_STIFFNESS,
        compute=lambda loops: loops.rise_kN / loops.span_mm,
        propagate=lambda drawn: drawn.rise_kN / (drawn.high_mm - drawn.low_mm),
    ),
    of_loop(
        "dynamic_stiffness_kN_per_mm", "|K*|", "Dynamic stiffness", "kN/mm", "first harmonic, F_a / x_a",
        _energy(5, "Dynamic stiffness |K*|", compared="Dynamic stiffness |K*|"),
        rounding=_STIFFNESS, source=ISO, kinds=HARMONIC,
        compute=lambda loops: np.abs(loops.first),
        propagate=lambda drawn: np.abs(drawn.first),
        like="share",
    ),
    of_loop(
        "storage_stiffness_kN_per_mm", "K′", "Storage stiffness", "kN/mm", "|K*| cos δ",
        replace(NOWHERE, heading="Storage stiffness"),
        rounding=_STIFFNESS, source=ISO, kinds=HARMONIC,
        compute=lambda loops: loops.first.real,
        propagate=lambda drawn: np.real(drawn.first),
        like="share",
    ),
    of_loop(
        "loss_stiffness_kN_per_mm", "K″", "Loss stiffness", "kN/mm",
        "|K*| sin δ; W_a = π K″ x_a² for a sine stroke",
        replace(NOWHERE, heading="Loss stiffness"),
        rounding=_STIFFNESS, source=ISO, kinds=HARMONIC,
        compute=lambda loops: loops.first.imag,
        propagate=lambda drawn: np.imag(drawn.first),
    ),
    of_loop(
        "loss_factor", "tan δ", "Loss factor", "1", "K″ / K′",
        _energy(6, "Loss factor", compared="Loss factor"),
        rounding=Rounding(4), source=ISO, kinds=HARMONIC,
        compute=lambda loops: _ratio(loops.first.imag, loops.first.real),
        why_missing="the storage stiffness is not positive",
        propagate=lambda drawn: (
            np.imag(drawn.first) / np.real(drawn.first) if np.all(np.real(drawn.first) > 0.0) else None
        ),
        why_no_u="some draws of the storage stiffness are not positive",
    ),
    of_loop(
        "stroke_distortion", "", "Stroke distortion", "1",
        "root of the sum of squares of stroke harmonics 2 to 10 over the first",
        replace(NOWHERE, heading="Stroke distortion"),
        rounding=Rounding(4), kinds=HARMONIC, reads=STROKE,
        compute=lambda loops: loops.distortion, why_missing=_FEW_READ,
        propagate=lambda drawn: drawn.distortion,
    ),
    _temperature(
        0, "temperature_start_C", "start", "Temperature at the start",
        "temperature of the specimen when the cycle starts",
        _motion(8, "Temp. start"),
    ),
    _temperature(
        1, "temperature_max_C", "max", "Highest temperature",
        "highest temperature of the specimen during the cycle",
        _motion(9, "Temp. max."),
    ),
)  # fmt: skip
