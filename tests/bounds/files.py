"""Campaign, stand and specimen files in which any one key can be set, and what comes of it."""

from __future__ import annotations

import copy
import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

from bufferstand.cli.campaign.preparation import PreparedCampaign, prepare
from bufferstand.daq.guards.from_limits import guards_for
from bufferstand.daq.guards.panel import GuardSet
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.interfaces import Stand
from bufferstand.foundation.clock import WallClock

SAMPLES = Path(__file__).parents[2] / "sample_runs"
Table = dict[str, Any]

SINE: Table = {"prestress_mm": 20.0, "amplitude_mm": 10.0, "frequency_Hz": 0.5}
STEPS: dict[str, Table] = {
    "static": {"force_limit_kN": 100.0},
    "harmonic": SINE,
    "sweep": {"prestress_mm": [20.0, 30.0], "amplitude_mm": [5.0, 10.0], "frequency_Hz": [0.5, 1.0]},
    "hold": {"duration_s": 5.0},
    "conditioning": SINE,
    "inner-loops": {"mean_mm": [20.0, 40.0], "amplitude_mm": [1.0, 2.0], "frequency_Hz": 0.5},
    "motion": {
        "piece": [
            {"do": "ramp", "to_mm": 20.0, "speed_mm_per_s": 10.0},
            {"do": "hold", "duration_s": 1.0},
            {"do": "harmonic", "amplitude_mm": 5.0, "frequency_Hz": 0.5},
            {"do": "ramp", "to_mm": 30.0, "speed_mm_per_s": 10.0},
            {"do": "release"},
        ]
    },
    "cool-down": {"temperature_C": 25.0},
    "warm-up": {**SINE, "temperature_C": 24.0},
    "force-cycles": {"force_min_kN": 50.0, "force_max_kN": 150.0, "speed_mm_per_s": 2.0, "cycles": 2},
    "touch": {},
    "repeat": {"times": 2, "step": [{"kind": "harmonic", **SINE}]},
}
"""What each kind of step needs."""
PIECES = {"ramp": 0, "hold": 1, "harmonic": 2, "release": 4}
LAST_RAMP = 3
INSTEAD = {
    "peak_speed_mm_per_s": ("frequency_Hz",),
    "force_kN": ("stroke_mm",),
    "to_kN": ("to_mm",),
    "until_steady": ("cycles",),
    "table": ("coefficients",),
    "seed": (),
}
"""Keys that cannot stand beside another."""
SLOW = ("speed_mm_per_s", "force_limit_kN", "stroke_limit_mm")
MISSING: dict[str, Any] = {
    "divider": {"potentiometer_ohm": 1000.0, "input_ohm": 1e6},
    "plausible": {},
    "start_temperature_C": [15.0, 25.0],
    "counts": [-(2.0**31), 2.0**31],
    "falling": [0.0, 1.0],
    "table": [[-1e6, -1e6], [1e6, 1e6]],
    "wire_zero_mm": [0.0, 0.0],
    "wire_zero_mm_per_K": [0.0, 0.0],
    "wire_drift_mm_per_h": [0.0, 0.0],
    "force_speed": [[0.0, 800.0], [700.0, 200.0]],
}
"""Tables and lists that the base files do not have."""
EFFECT: Table = {"nominal": 630.0, "reference_C": 23.0, "at_C": 23.0}
NAMED = "temperature_1"
"""A key that users name, of a table of such keys."""
AMPLIFIERS: dict[str, Table] = {
    "gsv2": {"set_up": True},
    "aed": {"parity": "none"},
    "modbus": {"map": "dms-float", "host": "127.0.0.1"},
}


CHANNELS = {
    "amplifier": {"name": "force_2", "quantity": "force", "unit": "kN"},
    "sensor": {"name": "pressure_1", "quantity": "pressure", "unit": "bar"},
    "acquisition": {"name": "acceleration_1", "quantity": "acceleration", "unit": "m/s²"},
}
SCALE = {"calibration": {"id": "a", "coefficients": [0.0, 1e-3]}}
INSTRUMENTS: dict[str, Table] = {
    "amplifier": {"rate_Hz": 50.0, "range_kN": 630.0, "channel": CHANNELS["amplifier"] | SCALE},
    "sensor": {"kind": "modbus", "rate_Hz": 50.0, "channel": CHANNELS["sensor"] | SCALE},
    "acquisition": {
        "host": "127.0.0.1",
        "rate_Hz": 50.0,
        "input": [{"terminal": "AIN0", "channel": CHANNELS["acquisition"] | SCALE}],
    },
}
"""An entry of each list of instruments, without what only its kind has …"""
KEYS: dict[str, Table] = {
    "gsv2": {"port": "a", "gsv2": AMPLIFIERS["gsv2"]},
    "aed": {"port": "a", "aed": AMPLIFIERS["aed"]},
    "modbus": {"modbus": AMPLIFIERS["modbus"]},
    "labjack": {"model": "T7"},
    "ascii-line": {
        "port": "a",
        "line": {"description": "mantracourt-dsc", "answers": {"station": "001", "decimals": 3}},
    },
}
"""… and that."""


def base_campaign(kind: str = "harmonic", *, nested: str = "") -> Table:
    """Return a campaign with one step of a kind; ``nested`` puts a step of that kind into a repetition."""
    step = {"kind": kind, **copy.deepcopy(STEPS[kind])}
    if nested:
        step["step"] = [{"kind": nested, **copy.deepcopy(STEPS[nested])}]
    return {"campaign": {"id": "a", "stand": "stand.toml", "specimen": "specimen.toml"}, "step": [step]}


def base_stand() -> Table:
    """Return the sample stand."""
    return copy.deepcopy(_sample_stand())


@cache
def _sample_stand() -> Table:
    return tomllib.loads((SAMPLES / "stand.toml").read_text("utf-8"))


def base_specimen() -> Table:
    """Return a specimen known by its catalogue, which is planned in no time."""
    return {
        "specimen": {"id": "b", "max_stroke_mm": 105.0, "elastic_system": "elastomer"},
        "catalogue": {
            "points": [[0.0, 15.0], [25.0, 67.0], [60.0, 195.0], [80.0, 365.0], [96.0, 600.0]],
            "absorbed_share": 0.5,
            "heat_capacity_J_per_K": 15000.0,
        },
    }


def with_key(document: Table, path: tuple[str, ...], value: object) -> Table:
    """Return a document with one key set; ``path`` as of
    :class:`bufferstand.foundation.settings.bounds.NumericKey`.
    """
    document = copy.deepcopy(document)
    if path[0] in INSTRUMENTS and path[1:2] == ("[]",):
        kind = next((part.removeprefix("kind=") for part in path if part.startswith("kind=")), "modbus")
        own = KEYS[kind] | {"protocol" if path[0] == "amplifier" else "kind": kind}
        document[path[0]] = [copy.deepcopy(INSTRUMENTS[path[0]] | own)]
    names = [part for part in path if not part.startswith("kind=")]
    here: Any = document
    for at, part in enumerate(names[:-1]):
        here = here[_index(part, path, at)] if part.startswith("[") else _below(here, part, names[at + 1])
    last = names[-1]
    if last.startswith("["):
        here[_index(last, path, len(names) - 1)] = value
        return document
    _make_room(here, last)
    here[last] = value
    return document


def _below(here: Table, part: str, following: str) -> Any:
    if following == "[key]":
        return here.setdefault(part, {NAMED: {}})
    if part not in here:
        _make_room(here, part)
        new = MISSING.get(part, AMPLIFIERS.get(part, {}))
        if part == "temperature":
            new = EFFECT
        if following.startswith("[") and not new:
            new = [0.0, 1.0]
        here[part] = copy.deepcopy(new)
    elif following.startswith("[") and not isinstance(here[part], list):
        here[part] = [here[part]]
    return here[part]


def _index(part: str, path: tuple[str, ...], at: int) -> int | str:
    if part == "[key]":
        return NAMED
    kinds = [one.removeprefix("kind=") for one in path if one.startswith("kind=")]
    names = [one for one in path if not one.startswith("kind=")]
    if names[at - 1] == "piece":
        return LAST_RAMP if path[-1] == "to_kN" else PIECES[kinds[-1]]  # no sine after a force
    if names[at - 1] in ("coefficients", "points", "falling"):
        return -1  # the scale, not the offset; the last point, not the first
    return 0 if part == "[]" else int(part.strip("[]"))


def _make_room(table: Table, key: str) -> None:
    for other in INSTEAD.get(key, ()):
        table.pop(other, None)
    if table.get("kind") in ("conditioning", "warm-up") and key in SLOW:
        for other in SINE:
            table.pop(other, None)
    if key == "seed" and "kind" in table:
        table["order"] = "random"
    if key == "start_timeout_s":
        table["start_temperature_C"] = [15.0, 25.0]
    if key == "approach_speed_mm_per_s":
        table["force_kN"] = 50.0
    if key == "falling":
        table["turn_counts"] = 100.0
    if key in AMPLIFIERS and "protocol" in table:
        table["protocol"], table["rate_Hz"] = key, 50.0


def toml_text(document: Mapping[str, Any]) -> str:
    """Return a document as TOML: one key a line, tables of the first level under heads."""
    heads = {name: one for name, one in document.items() if isinstance(one, Mapping | list)}
    lines = [f"{key} = {_value(value)}" for key, value in document.items() if key not in heads]
    for name, table in heads.items():
        many = table if isinstance(table, list) else [table]
        for one in many:
            lines.append(f"[[{name}]]" if isinstance(table, list) else f"[{name}]")
            lines += [f"{key} = {_value(value)}" for key, value in one.items()]
    return "\n".join(lines) + "\n"


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, date):
        return value.isoformat()
    return json.dumps(value) if isinstance(value, str) else repr(value)


@dataclass
class Files:
    """A campaign with its stand and specimen in a folder."""

    folder: Path

    def write(
        self, campaign: Table | None = None, stand: Table | None = None, specimen: Table | None = None
    ) -> Path:
        """Write the three files; return the campaign's path."""
        for name, table in (
            ("campaign", campaign or base_campaign()),
            ("stand", stand or base_stand()),
            ("specimen", specimen or base_specimen()),
        ):
            (self.folder / f"{name}.toml").write_text(toml_text(table), "utf-8")
        return self.folder / "campaign.toml"

    def prepare(self, **tables: Table | None) -> PreparedCampaign:
        """Write the files and plan them."""
        return prepare(self.write(**tables))


def guards_of(prepared: PreparedCampaign) -> GuardSet:
    """Return the guards that a campaign would be run with; no device is touched."""
    clock = WallClock()
    stand = Stand(build_controller(prepared.stand_file, clock), build_sensors(prepared.stand_file, clock))
    sensors = prepared.stand_file.temperature_sensors
    try:
        return guards_for(
            prepared.campaign.limits,
            prepared.plan.limits,
            stand,
            ambient=[one.name for one in sensors if one.role == "ambient"],
            table=prepared.campaign.content.guards,
            stand_tilt_mm=prepared.stand_file.stand.tilt_max_mm,
        )
    finally:
        stand.close()


def thresholds(guards: GuardSet) -> dict[str, float]:
    """Return every threshold of a guard set by its place, e.g. ``temperatures.temperature_1.stop_C``."""
    return dict(_numbers(guards.as_dict(), ""))


def _numbers(value: Any, place: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, Mapping):
        for key, one in value.items():
            yield from _numbers(one, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list):
        for number, one in enumerate(value):
            name = one.get("name") or one.get("stream") or one.get("signal") or number
            yield from _numbers(one, f"{place}.{name}")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place, float(value)
