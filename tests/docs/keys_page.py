"""Make the page of keys from the schemas: python -m tests.docs.keys_page > docs/keys.md"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from bufferstand.cli.commands.schema import schema_of

HEAD = """\
# Every key of campaign, specimen, stand and report files

Made from the schemas by `python -m tests.docs.keys_page`; a test compares it. “–” as default: nothing, or
what the last column says. The [bounds](bounds.md) of every number are on a page of their own.
"""
COMMON = (
    "name", "keep_order", "compensate", "start_temperature_C", "start_timeout_s", "too_cold",
    "temperature_stop_C", "temperature_resume_C",
)  # fmt: skip
"""Keys of every step that moves or waits; they are told once."""
BOUNDS = re.compile(r"\s*From \S+ to \S+: .*$", re.DOTALL)
"""What the schema says of a number's bounds, which stand on their own page."""


def values(entry: dict[str, Any]) -> list[Any]:
    """Return the words that a key may have, if it is one of some."""
    found = [value for one in (entry, *entry.get("anyOf", ())) for value in one.get("enum", ())]
    return found or [one["const"] for one in entry.get("anyOf", ()) if one.get("const")]


def default(entry: dict[str, Any], required: bool) -> str:
    """Return the default as it is written in TOML."""
    value = entry.get("default")
    if required:
        return "required"
    if value is None or value in ("", []) or isinstance(value, dict):
        return "–"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, list | str):
        return f"`{json.dumps(value, ensure_ascii=False)}`"
    return f"{value:g}"


def rows(schema: dict[str, Any], without: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield one row for each key of a table."""
    yield "| key | default | meaning |"
    yield "|---|---|---|"
    for key, entry in schema["properties"].items():
        if key in without or "const" in entry:
            continue
        text = " ".join(BOUNDS.sub("", entry.get("description", "")).replace("``", "`").split())
        missing = [f"`{json.dumps(word)}`" for word in values(entry) if word and f'"{word}"' not in text]
        if missing and not any(str(word) in text for word in values(entry)):
            text = f"{text.rstrip('.')}. One of {', '.join(missing)}.".lstrip(". ")
        if not text and any("$ref" in one for one in (entry, *entry.get("anyOf", ()))):
            text = "A table of its own, below."
        if not text:
            raise LookupError(f"{key} of {schema['title']} has no description")
        cell = text.replace("|", chr(92) + "|")
        yield f"| `{key}` | {default(entry, key in schema.get('required', ()))} | {cell} |"


def table(heading: str, schema: dict[str, Any], without: tuple[str, ...] = ()) -> list[str]:
    """Return one table with its heading."""
    return [f"\n### {heading}\n", *rows(schema, without)]


def tables(name: str) -> Iterator[str]:
    """Yield the tables of a file, the steps of a campaign apart."""
    schema = schema_of(name)
    defs = schema["$defs"]
    for key, entry in schema["properties"].items():
        reference = entry.get("$ref") or next(
            (one["$ref"] for one in entry.get("anyOf", ()) if "$ref" in one), ""
        )
        if reference:
            own = defs[reference.rpartition("/")[2]]
            yield from table(f"`[{key}]`", own, ("action",))
            if "action" in own["properties"]:
                yield from table(f"`[{key}.action]`", defs["GuardActions"])


def steps() -> Iterator[str]:
    """Yield the tables of the kinds of steps and of what stands inside of one."""
    defs = schema_of("campaign")["$defs"]
    kinds = {one["properties"]["kind"]["const"]: one for one in defs.values() if "kind" in one["properties"]}
    common = {**kinds["static"], "properties": {key: kinds["static"]["properties"][key] for key in COMMON}}
    yield from table("Every step", {**common, "required": []})
    for kind, schema in kinds.items():
        yield from table(f'`kind = "{kind}"`', schema, COMMON)
    yield from table("`[step.until_steady]`", defs["UntilSteady"])
    for schema in defs.values():
        if "do" in schema["properties"] and len(schema["properties"]) > 1:
            yield from table(f"A piece `{schema['properties']['do']['const']}`", schema)


HEADINGS = {
    "Channel": "A channel",
    "Calibration": "`calibration` of a channel",
    "ChannelUncertainty": "`uncertainty` of a channel",
    "Plausible": "`plausible` of a channel",
    "ChangeCodes": "`change` of an RMC",
}
"""Names of tables whose description says how they are meant, not where they stand."""


def instruments() -> Iterator[str]:
    """Yield what stands inside of a stand file's tables: each kind of device, channel and calibration."""
    for name, schema in sorted(schema_of("stand")["$defs"].items()):
        keys = schema.get("properties", {})
        if not keys or name in {"StandFacts", "StandFileLimits", "ControllerSettings", "Figures"}:
            continue
        named = [(key, keys[key]["const"]) for key in ("protocol", "kind") if "const" in keys.get(key, {})]
        tags = [f'`{key} = "{value}"`' for key, value in named]
        about = schema.get("description", name).split("\n\n")[0].replace("``", "`")
        heading = " ".join(about.split()).rstrip(".").partition(": ")[0].partition(";")[0]
        heading = HEADINGS.get(name, heading)
        yield from table(f"{tags[0]}: {heading}" if tags and tags[0] not in heading else heading, schema)


def page() -> str:
    """Return the page."""
    lines = [HEAD, "## Campaign file", *tables("campaign"), "\n## Steps", *steps()]
    lines += ["\n## Specimen file", *tables("specimen"), "\n## Stand file", *tables("stand"), *instruments()]
    lines += ["\n## Report file", *table("`report.toml`", schema_of("report"))]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
