"""Record NUMBER of the world: always the same for the same number."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from . import motions, specimens, truth
from .chain import Scene, Stated, sample, state
from .imperfections import put_in

SEED = 15_551
WHAT = ("static", "harmonic", "steps", "damper", "draw-gear", "impact", "proof")
SHARES = (0.5, 0.25, 0.1, 0.06, 0.04, 0.03, 0.02)
WARMER_K = 9.0
CLOCK = 1e-4  # a logger's clock is within 100 ppm (evaluation/uncertainty.md)
PROOF_KN = {"F2": 500.0, "F3": 200.0, "F5": 250.0}
STARTED = datetime(2026, 2, 3, 9, 0, tzinfo=UTC)


def make(number: int, only: str | None = None) -> Scene:
    """Return record `number`; with `only`, with this one imperfection (or none: "clean")."""
    rng = np.random.default_rng([SEED, number])
    what = str(rng.choice(WHAT, p=SHARES))
    spring = specimens.random_damper(rng) if what == "damper" else specimens.random_spring(rng)
    gear = what == "draw-gear"
    if isinstance(spring, specimens.Spring) and what in {"impact", "proof"}:
        motion = _single(rng, what, spring)
    elif what == "static" or (gear and rng.random() < 0.4):
        motion = motions.static(rng)
    else:
        motion = motions.harmonic(rng, two_sided=what == "damper", several=what == "steps")
    t, x = motion.time_s, motion.stroke_mm
    path = np.cumsum(np.abs(np.diff(x, prepend=x[0])))
    band = str(rng.choice(["inside", "cold", "warm"], p=[0.86, 0.07, 0.07]))
    at_start = {
        "inside": rng.uniform(16.2, 21.0),
        "cold": rng.uniform(5.0, 13.0),
        "warm": rng.uniform(26.8, 35.0),
    }
    temperature = at_start[band] + rng.uniform(0.0, 2.5) * path / max(path[-1], 1.0)
    temperature = temperature + WARMER_K * (t >= motion.facts.get("warm_from_s", np.inf))
    force = spring.force(t, x, temperature)
    first = motion.begin_s + rng.uniform(0.0, 1.0) / motion.sample_rate_Hz
    stamps = np.arange(first, motion.end_s, 1.0 / motion.sample_rate_Hz)
    seen = (t >= stamps[0]) & (t <= stamps[-1])
    cycles = truth.cycles(t[seen], x[seen], force[seen], temperature[seen], static=motion.kind != "harmonic")
    strokes = 2 if rng.random() < 0.2 else 1
    sensors = int(rng.choice([1, 2, 3], p=[0.7, 0.2, 0.1]))
    stated = state(rng, strokes, sensors)
    wires, read, thermometers, noises = sample(
        rng, motion, stamps, force, temperature, stated, strokes, sensors
    )
    rest = str(rng.choice(["known", "short", "unknown"], p=[0.86, 0.07, 0.07]))
    hours = {"known": rng.uniform(80.0, 2000.0), "short": rng.uniform(5.0, 66.0), "unknown": None}[rest]
    facts = {
        "what": what,
        "tension": gear,  # pulled, and written with the signs of a pull; the mapping turns them
        "system": spring.system,
        "band": band,
        "rest_h": hours,
        "way_of_writing": int(rng.integers(4)),
        "seating_mm": getattr(spring, "seating_mm", 0.0),
        **noises,
    }
    scene = Scene(
        number=number,
        motion=motion,
        force_kN=force,
        temperature_C=temperature,
        cycles=cycles,
        facts=facts,
        stated=stated,
        time_s=stamps * (1.0 + np.random.default_rng([SEED, number, 1]).uniform(-CLOCK, CLOCK)),
        true_time_s=stamps.copy(),
        strokes_mm=wires,
        force_read_kN=read,
        temperatures_C=thermometers,
        faulty_C=[np.zeros(len(stamps), dtype=bool) for _ in thermometers],
    )
    if only != "clean":
        put_in(rng, scene, only)
    return scene


def _single(rng: np.random.Generator, what: str, spring: specimens.Spring) -> motions.Motion:
    places = np.linspace(0.0, 105.0, 2101)
    loads = spring.envelope(places)
    if what == "impact":  # well below 1000 kN, also with what the speed adds
        most = float(places[np.searchsorted(loads, 850.0) - 1])
        top = min(most, 103.0) * rng.uniform(0.7, 1.0)
        return motions.single(rng, what, top, rng.uniform(0.08, 0.2), 0.0, rng.uniform(0.1, 0.4))
    proof = str(rng.choice(list(PROOF_KN)))
    aim = PROOF_KN[proof] * rng.choice([rng.uniform(0.8, 0.93), rng.uniform(1.07, 1.25)])
    top = float(np.clip(np.interp(aim, loads, places), 5.0, 104.0))
    held = rng.uniform(2.0, 8.0)
    made = motions.single(rng, what, top, top / rng.uniform(5.0, 20.0), held, top / rng.uniform(5.0, 20.0))
    made.facts[proof] = PROOF_KN[proof]
    return made


@dataclass(frozen=True)
class Files:
    """A record as a laboratory hands it over."""

    record: Path
    mapping: Path


def write(scene: Scene, folder: Path) -> Files:
    """Write record, facts and mapping file; header, separator and decimal sign vary."""
    folder.mkdir(parents=True, exist_ok=True)
    way = scene.facts["way_of_writing"]
    comma = way == 1
    sign = -1.0 if scene.facts["tension"] else 1.0
    separator = {0: ",", 1: ";", 2: "\t", 3: ","}[way]  # type: ignore[index]
    columns, names, formats = [scene.time_s], ["time [s]"], [f"%.{scene.decimals['time']}f"]
    for i, x in enumerate(scene.strokes_mm):
        columns.append(x * sign * scene.factor.get("stroke", 1.0))
        names.append("stroke [mm]" if len(scene.strokes_mm) == 1 else f"stroke_{i + 1} [mm]")
        formats.append(f"%.{scene.decimals['stroke']}f")
    columns.append(scene.force_read_kN * sign * scene.factor.get("force", 1.0))
    names.append("force [kN]")
    formats.append(f"%.{scene.decimals['force']}f")
    for i, x in enumerate(scene.temperatures_C):
        columns.append(x)
        names.append(f"temperature_{i + 1} [°C]")
        formats.append(f"%.{scene.decimals['temperature']}f")
    row = separator.join(formats) + "\n"
    table = np.column_stack(columns)
    text = (row * len(table)) % tuple(table.ravel().tolist())
    text = re.sub(r"99\d{36}\.0+", "9.91E+37", text.replace("nan", ""))
    if comma:
        text = text.replace(".", ",")
    record = folder / f"r{scene.number:06d}.csv"
    record.write_text(separator.join(names) + "\n" + text, encoding="utf-8")
    record.with_suffix(".toml").write_text(_facts(scene), encoding="utf-8")
    mapping = folder / f"r{scene.number:06d}-rig.toml"
    mapping.write_text(_mapping(scene), encoding="utf-8")
    return Files(record, mapping)


def _facts(scene: Scene) -> str:
    kind = "draw-gear" if scene.facts["what"] == "draw-gear" else "buffer"
    lines = ["[specimen]", f'id = "W-{scene.number:06d}"', f'kind = "{kind}"', 'category = "A"']
    lines += ["max_stroke_mm = 105.0", f'elastic_system = "{scene.facts["system"]}"']
    hours = scene.facts["rest_h"]
    if isinstance(hours, float):
        lines.append(f"assembled = {(STARTED - timedelta(hours=hours)).isoformat(timespec='seconds')}")
    lines += [
        "",
        "[test]",
        f'kind = "{scene.motion.kind}"',
        f"started = {STARTED.isoformat()}",
        'operator = "world"',
    ]
    lines += [f'proof_load = "{name}"' for name in PROOF_KN if name in scene.motion.facts]
    if scene.motion.kind == "impact":
        lines += ["impact_speed_km_h = 11.5", "impact_mass_t = 80.0"]
    return "\n".join(lines) + "\n"


def _mapping(scene: Scene) -> str:
    lines = ['name = "world"', "", "[columns.time]", 'header = "time"', 'unit = "s"']
    units = {"stroke": "mm", "force": "kN", "temperature": "°C"}
    channels = ["force"] + [f"temperature_{i + 1}" for i in range(len(scene.temperatures_C))]
    single = len(scene.strokes_mm) == 1
    channels += ["stroke"] if single else ["stroke_1", "stroke_2"]
    for name in channels:
        lines += ["", f"[columns.{name}]", f'header = "{name}"', f'unit = "{units[name.split("_")[0]]}"']
        if scene.facts["tension"] and not name.startswith("temperature"):
            lines.append("invert = true")
        of = scene.stated.get("stroke_1" if name == "stroke" else name)
        if of is None:
            continue
        if of.delay_s:
            lines.append(f"delay_s = {of.delay_s}")
        lines.append(f"uncertainty = {{ {', '.join(_stated(of))} }}")
    return "\n".join(lines) + "\n"


def _stated(of: Stated) -> list[str]:
    keys = ("accuracy_percent", "zero", "reversibility_percent", "linearity", "u_delay_s")
    return [f"{key} = {getattr(of, key)!r}" for key in keys if getattr(of, key)]
