"""Every key of campaign, stand, specimen and fault files, written wrongly: what is said is in plain words."""

from __future__ import annotations

import copy
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from bufferstand.drivers.simulated.faults.file import FaultFile
from bufferstand.drivers.simulated.miswiring.settings import MiswiredThermometer
from bufferstand.drivers.simulated.settings import SimulationSettings
from bufferstand.drivers.stand_file.recording_stand import RecordingStand
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.loading import parse_settings, refusal
from bufferstand.foundation.specimen.file import SpecimenFile
from bufferstand.protocols.campaign_file.schema import CampaignFile

Document = dict[str, Any]
Place = tuple[str | int, ...]

STEPS = """
[[step]]
kind = "static"
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
[step.until_steady]
[[step]]
kind = "sweep"
prestress_mm = [20.0]
amplitude_mm = [5.0]
frequency_Hz = [1.0]
[[step]]
kind = "hold"
duration_s = 1.0
[[step]]
kind = "conditioning"
[[step]]
kind = "inner-loops"
mean_mm = [20.0]
amplitude_mm = [1.0]
frequency_Hz = 1.0
[[step]]
kind = "cool-down"
temperature_C = 30.0
[[step]]
kind = "touch"
[[step]]
kind = "warm-up"
temperature_C = 30.0
[[step]]
kind = "force-cycles"
force_min_kN = 50.0
force_max_kN = 100.0
speed_mm_per_s = 5.0
cycles = 1
[[step]]
kind = "motion"
[[step.piece]]
do = "ramp"
to_mm = 20.0
speed_mm_per_s = 5.0
[[step.piece]]
do = "hold"
duration_s = 1.0
[[step.piece]]
do = "harmonic"
amplitude_mm = 5.0
frequency_Hz = 1.0
[[step.piece]]
do = "release"
[[step]]
kind = "repeat"
times = 2
[[step.step]]
kind = "static"
"""
CAMPAIGN = (
    '[campaign]\nid = "a"\nstand = "s.toml"\nspecimen = "p.toml"\n'
    "[limits]\n[guards]\n[guards.action]\n[zero]\n[conditions]\n[motion]\n[stroke]\n[plan]\n" + STEPS
)
CHANNEL = '\nname = "{0}"\nquantity = "{1}"\nunit = "{2}"\n'
STAND = (
    '[stand]\nid = "s"\n[limits]\nforce_max_kN = 600.0\nstroke_max_mm = 250.0\nfrequency_max_Hz = 5.0\n'
    'speed_max_mm_per_s = 800.0\n[controller]\nhost = "127.0.0.1"\n[[controller.channel]]'
    + CHANNEL.format("force", "force", "kN")
    + "[controller.channel.uncertainty]\n[controller.channel.plausible]\n[controller.channel.calibration]\n"
    "[controller.channel.calibration.divider]\npotentiometer_ohm = 1000.0\ninput_ohm = 1e6\n"
    "[controller.channel.calibration.temperature]\nnominal = 1.0\nreference_C = 21.0\nat_C = 21.0\n"
    + "".join(
        "[[controller.channel]]" + CHANNEL.format(name, name.partition("_")[0], "mm")
        for name in ("stroke_1", "stroke_2", "position", "command")
    )
    + '[temperature]\nkind = "w1"\n[[temperature.sensor]]\nrom = "28-00000a3f92d7"\nname = "temperature_1"\n'
    'place = "plate"\n'
)
AMPLIFIER = (
    '[amplifier]\nprotocol = "{0}"\nport = "p"\nrate_Hz = 10.0\nrange_kN = 630.0\n[amplifier.channel]\n'
    'name = "force_2"\nquantity = "force"\nunit = "kN"\n[amplifier.{0}]\n'
)
RMC = (
    '[controller.rmc]\nmodel = "rmc150"\naxis = 0\nplot = 0\nword_order = "big"\nvariables = 0\n'
    'force = "%MD9.8"\nclear_mm = -5.0\nacceleration_mm_per_s2 = 5000.0\n'
    "[controller.rmc.change]\namplitude = 0\noffset = 2\nramp_cycles = 1\n"
)
SENSOR = (
    '[sensor]\nkind = "modbus"\nport = "p"\nrate_Hz = 10.0\n[sensor.channel]\nname = "pressure_1"\n'
    'quantity = "pressure"\nunit = "bar"\n[sensor.modbus]\nmap = "dms-float"\n'
)
INPUT = '[acquisition.input.channel]\nname = "force_2"\nquantity = "force"\nunit = "kN"\n'
LABJACK = (
    '[figures]\n[[acquisition]]\nkind = "labjack"\nhost = "127.0.0.1"\nmodel = "T7"\nrate_Hz = 1000.0\n'
    '[[acquisition.input]]\nterminal = "AIN0"\n' + INPUT
)
MODBUS_IO = (
    '[limits]\n[[acquisition]]\nkind = "modbus-io"\nhost = "127.0.0.1"\ndescription = "wago-750"\n'
    "rate_Hz = 10.0\n"
    '[[acquisition.input]]\npoint = "a"\n'
    + INPUT.replace("force_2", "force")
    + '[[acquisition.input]]\npoint = "b"\n'
    + INPUT.replace("force_2", "stroke_1").replace("force", "stroke").replace("kN", "mm")
)
LINE = 'description = "tecsis-eze30"\n'
SPECIMEN = '[specimen]\nid = "A"\n[test]\n[catalogue]\npoints = [[0.0, 15.0], [50.0, 100.0]]\n'
FAULTS = '[[fault]]\ntarget = "controller"\nkind = "lost"\n'
FILES: Mapping[str, tuple[type[BaseModel], str]] = {
    "campaign": (CampaignFile, CAMPAIGN),
    "stand": (StandFile, STAND + AMPLIFIER.replace("{0}", "gsv2")),
    "aed": (StandFile, STAND + AMPLIFIER.replace("{0}", "aed")),
    "modbus": (StandFile, STAND + AMPLIFIER.replace("{0}", "modbus") + 'map = "dms-float"\n'),
    "sensor": (StandFile, STAND + SENSOR),
    "labjack": (StandFile, STAND + LABJACK),
    "modbus-io": (RecordingStand, '[stand]\nid = "s"\n' + MODBUS_IO),
    "ascii-line": (
        StandFile,
        STAND
        + AMPLIFIER.replace("[amplifier.{0}]", "[amplifier.line]\n" + LINE).replace("{0}", "ascii-line"),
    ),
    "line sensor": (
        StandFile,
        STAND
        + SENSOR.partition("[sensor.modbus]")[0].replace("modbus", "ascii-line")
        + "[sensor.line]\n"
        + LINE,
    ),
    "rmc": (StandFile, STAND.replace("[controller]\n", '[controller]\nkind = "rmc"\n') + RMC),
    "ds2480b": (StandFile, STAND.replace('kind = "w1"', 'kind = "ds2480b"\nport = "p"')),
    "specimen": (SpecimenFile, SPECIMEN),
    "faults": (FaultFile, FAULTS),
}
TAGS = ("kind", "do", "protocol")
"""Keys that decide between tables."""
NOT_PLAIN = re.compile(
    r"\bNone\b|\bTrue\b|\bFalse\b|Settings|another value|(?i:input|valid|tuple|\bdict|field required|extra"
    r"|literal|instance|pattern|string|integer|boolean|\bitems?\b|\bfloat|\bint\b|pydantic|\bmodel_)"
)
KEYS_WITH_SUCH_WORDS = re.compile(r"input_\w+|valid_until|model\b|\binput\b")


def written(document: Mapping[str, Any], at: tuple[str, ...] = ()) -> list[str]:
    """Return the lines of a TOML file: single keys, then tables, so that every key has a line of its own."""

    def is_table(value: object) -> bool:
        return isinstance(value, dict) and "in_line" not in value

    def are_tables(value: object) -> bool:
        return isinstance(value, list) and bool(value) and all(is_table(one) for one in value)

    lines = [
        f"{key} = {inline(value)}"
        for key, value in document.items()
        if not is_table(value) and not are_tables(value)
    ]
    for key, value in document.items():
        name = ".".join((*at, key))
        if is_table(value):
            lines += [f"[{name}]", *written(value, (*at, key))]
        elif are_tables(value):
            for one in value:
                lines += [f"[[{name}]]", *written(one, (*at, key))]
    return lines


def inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {inline(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list):
        return f"[{', '.join(inline(one) for one in value)}]"
    if isinstance(value, float) and math.isnan(value):
        return "nan"
    return json.dumps(value)


def options(node: Mapping[str, Any], defs: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return what a place may hold by the JSON schema, without null."""
    if "$ref" in node:
        return options(defs[node["$ref"].rpartition("/")[2]], defs)
    for choice in ("anyOf", "oneOf", "allOf"):
        if choice in node:
            return [one for part in node[choice] for one in options(part, defs)]
    return [] if node.get("type") == "null" else [node]


def tables(
    node: Mapping[str, Any], document: Document, defs: Mapping[str, Any], at: Place = ()
) -> Iterator[tuple[Place, Mapping[str, Any]]]:
    """Yield every table of a document with its schema."""
    yield at, node
    for key, value in document.items():
        for option in options(node["properties"][key], defs):
            if isinstance(value, dict) and "properties" in option and fits(option, value):
                yield from tables(option, value, defs, (*at, key))
            elif isinstance(value, list) and "items" in option:
                for number, one in enumerate(value):
                    for inner in options(option["items"], defs):
                        if isinstance(one, dict) and fits(inner, one):
                            yield from tables(inner, one, defs, (*at, key, number))


def fits(node: Mapping[str, Any], table: Document) -> bool:
    """Return whether a table is of the kind that a schema is about."""
    tag = next((tag for tag in TAGS if "const" in node["properties"].get(tag, {})), None)
    return tag is None or node["properties"][tag]["const"] == table[tag]


def wrong_values(node: Mapping[str, Any], defs: Mapping[str, Any]) -> list[Any]:
    """Return what a place may not hold: of other types, of other lengths, and beyond its limits."""
    found = options(node, defs)
    types = {one.get("type", "any") for one in found}
    if "any" in types and not all("enum" in one or "const" in one for one in found):
        return []
    wrong: list[Any] = []
    if not types & {"string"} or any("enum" in one or "const" in one for one in found):
        wrong.append("no such thing")
    if not types & {"number", "array"}:
        wrong.append(3.5)
    if "boolean" not in types:
        wrong.append(True)
    if "object" not in types:
        wrong.append({"in_line": 1})
    if "array" not in types:
        wrong.append([1.0])
    for one in found:
        wrong += [math.nan] if one.get("type") == "number" else []
        wrong += [one["minimum"] - 1] if "minimum" in one else []
        wrong += [one["exclusiveMinimum"]] if "exclusiveMinimum" in one else []
        wrong += [one["maximum"] + 1] if "maximum" in one else []
        wrong += [one["exclusiveMaximum"]] if "exclusiveMaximum" in one else []
        wrong += ["Ä ö!"] if "pattern" in one or "format" in one else []
        wrong += [""] if one.get("minLength") else []
        wrong += [[]] if one.get("minItems") else []
        if "prefixItems" in one:
            wrong += [[1.0], [1.0, 2.0, 3.0], [1.0, "no number"]]
        if one.get("type") == "array" and "items" in one:
            wrong += [[value] for entry in options(one["items"], defs) for value in wrong_values(entry, defs)]
    return wrong


def with_value(document: Document, at: Place, value: Any) -> str:
    """Return a document with one value; of a campaign's steps only the one that is meant."""
    if at[0] == "step" and len(at) > 1:
        document = {"campaign": document["campaign"], "step": [document["step"][int(at[1])]]}
        at = ("step", 0, *at[2:])
    changed = copy.deepcopy(document)
    table: Any = changed
    for part in at[:-1]:
        table = table[part]
    table[at[-1]] = value
    return "\n".join(written(changed)) + "\n"


def check(error: BadInput, text: str, at: Place) -> None:
    """Hold a message to what each must say: file, place, what is wrong, what to do, in plain words."""
    said = str(error)
    assert error.file == "lab/file.toml"
    key = [part for part in at if isinstance(part, str)]
    assert re.search(rf": {re.escape('.'.join(key))}\b", f": {error.place}"), said
    line = re.match(r"line (\d+): ", error.place)
    assert line, said
    written_there = text.splitlines()[int(line[1]) - 1]
    assert key[-1] in written_there, (said, written_there)
    assert error.problem, said
    assert error.remedy, said
    plain = KEYS_WITH_SUCH_WORDS.sub("", said.removeprefix("lab/file.toml: "))
    assert not NOT_PLAIN.search(plain), said
    assert "\n" not in said


def refused(schema: type[BaseModel], text: str) -> BadInput | None:
    try:
        parse_settings(text, schema, Path("lab/file.toml"))
    except BadInput as error:
        return error
    return None


@pytest.mark.dose(4)
@pytest.mark.parametrize("name", FILES)
def test_a_wrong_value_of_any_key_is_named_in_plain_words_with_what_to_write(name: str) -> None:
    schema, text = FILES[name]
    json_schema = schema.model_json_schema(by_alias=True)
    defs = json_schema.get("$defs", {})
    document = tomllib.loads(text)
    tried = 0
    for at, table in tables(json_schema, document, defs):
        parts = {"ds2480b": {"temperature"}}.get(name, {"amplifier", "sensor"})
        if name in ("aed", "modbus", "sensor", "ds2480b") and not parts & set(at):
            continue  # of the rest the one file of a stand is enough
        for key, node in table["properties"].items():
            if key in TAGS and "const" in node:
                continue  # decides between tables: see below
            for value in wrong_values(node, defs):
                text = with_value(document, (*at, key), value)
                error = refused(schema, text)
                if error is None:
                    assert isinstance(value, float | int), (at, key, value)  # a single number as a list
                    continue
                check(error, text, (*at, key))
                tried += 1
    assert tried > 50, tried


def test_every_table_of_the_schemas_is_among_those_that_are_tried() -> None:
    seen: set[str] = set()
    wanted: set[str] = set()
    for schema, text in FILES.values():
        json_schema = schema.model_json_schema(by_alias=True)
        defs = json_schema.get("$defs", {})
        wanted |= {node["title"] for node in defs.values() if "properties" in node}
        seen |= {table["title"] for _, table in tables(json_schema, tomllib.loads(text), defs)}
    assert wanted <= seen


def test_the_simulated_stand_s_own_table_is_held_to_the_same() -> None:
    schema = SimulationSettings.model_json_schema()
    defs = schema["$defs"]
    wires = ("force", "amplifier", "stroke_1", "stroke_2", "position")
    document: Document = {"miswired": {name: {} for name in wires}, "moves": {}}
    places = [*tables(schema, document, defs)]
    assert len(places) == 3 + len(wires)
    place = ("miswired", "thermometer", "temperature_1")
    places.append((place, MiswiredThermometer.model_json_schema()))
    for at, table in places:
        for key, node in table["properties"].items():
            for value in wrong_values(node, defs):
                content: dict[str, Any] = {key: value}
                for part in reversed(("simulation", *at)):
                    content = {str(part): content}
                text = "\n".join(written(content)) + "\n"
                try:
                    SimulationSettings.model_validate(tomllib.loads(text)["simulation"])
                except ValidationError as error:
                    found = refusal(error, SimulationSettings, Path("lab/file.toml"), text, ("simulation",))
                    check(found, text, ("simulation", *at, key))
                else:
                    pytest.fail(f"{at} {key} = {value} was accepted")


CAMPAIGN_SCHEMA = CampaignFile.model_json_schema()
KINDS = {
    node["properties"]["kind"]["const"]: set(node["properties"])
    for node in CAMPAIGN_SCHEMA["$defs"].values()
    if "const" in node.get("properties", {}).get("kind", {})
}


def test_a_key_of_another_kind_of_step_is_told_which_kinds_have_it_and_what_this_one_has() -> None:
    document = tomllib.loads(CAMPAIGN)
    tried = 0
    for number, step in enumerate(document["step"]):
        kind = step["kind"]
        for key in set().union(*KINDS.values()) - KINDS[kind]:
            text = with_value(document, ("step", number, key), 1)
            error = refused(CampaignFile, text)
            assert error is not None
            check(error, text, ("step", key))
            assert error.problem.startswith(f"kind = “{kind}” has no key “{key}”")
            having = [other for other, keys in KINDS.items() if key in keys]
            named = error.remedy.partition(";")[0]
            assert all(other in named for other in having) or named == "every other kind has it"
            assert f"keys of “{kind}”: " in error.remedy
            assert all(own in error.remedy for own in KINDS[kind])
            assert "did you mean" not in error.remedy
            tried += 1
    assert tried > 150


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("cycles = 1\n", "cycles = 1\nspeed = 5.0\n", "unknown key “speed”; did you mean “speed_mm_per_s”?"),
        (
            "cycles = 1\n",
            "cycles = 1\nzzz = 5.0\n",
            "unknown key “zzz”; remove it; keys of “force-cycles”: comp",
        ),
        (
            'do = "release"',
            'do = "realease"',
            "do = “realease” is not known; write “ramp”, “hold”, “harmonic”",
        ),
        ('do = "release"', "speed_mm_per_s = 5.0", "the key do is missing; add do = “ramp”, “hold”, "),
        ('kind = "touch"', 'kind = "tuch"', "unknown kind of step “tuch”; did you mean “touch”?"),
        ("times = 2", "times = 2\nseed = 3", "kind = “repeat” has no key “seed”; it is a key of sweep; keys"),
    ],
)
def test_words_that_are_nearly_known(old: str, new: str, said: str) -> None:
    assert old in CAMPAIGN
    error = refused(CampaignFile, CAMPAIGN.replace(old, new))
    assert said in str(error)


def test_the_documents_themselves_have_no_mistake() -> None:
    for name, (schema, text) in FILES.items():
        assert refused(schema, text) is None, name
