"""Make the page of bounds from the schemas: python -m tests.docs.bounds_page > docs/bounds.md"""

from __future__ import annotations

from collections.abc import Iterator

from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.settings.bounds import NumericKey, numeric_keys
from bufferstand.foundation.specimen.file import SpecimenFile
from bufferstand.protocols.campaign_file.guard_bounds import RELATIVE
from bufferstand.protocols.campaign_file.schema import CampaignFile

HEAD = """\
# Bounds of every number

Made from the schemas by `python -m tests.docs.bounds_page`; a test compares it. A number outside its bounds
is refused by `plan`, `run`, `resume` and `check` (exit status 2), with file, line, key, value, bound and the
reason. What a stand, a specimen or a step allows is often narrower:
[campaign-file.md](campaign-file.md#what-is-refused).

How the power-on value of a DS18B20 (85.0 °C) is handled: no temperature stop lies above it, nor above what a
thermometer's calibration makes of it. A sensor that has lost its supply then either shows it near a true
reading, and stops the campaign, or far from one: then it is not believed, and its silence stops the campaign
after `temperature_stale_s`. Up to 85 °C the sensor is exact to 0.5 K, above it to 2 K.

The scale of a channel switches its guards off as surely as a threshold does. `check`, `plan` and `run`
therefore refuse a calibration by which a channel cannot show 5 % above the stand's force or stroke, or by
which one count is worth more than 1 % of it; and one that moves a thermometer by more than 5 K. Whether a
scale is *true* only a motion shows.
"""


def text_of(value: float) -> str:
    """Return a bound as people write it."""
    return f"{value:g}".replace("-", "−")


def rows(keys: tuple[NumericKey, ...]) -> Iterator[str]:
    """Yield one row for each key, kinds of steps with the same bounds together."""
    relative = {(rule.table, rule.key) for rule in RELATIVE}
    seen: dict[tuple[str, float, float, str], list[str]] = {}
    for key in keys:
        if key.path in relative or key.path == ("stand", "tilt_max_mm"):
            continue
        known = seen.setdefault((key.dotted, key.low, key.high, key.why), [])
        kinds = [part.removeprefix("kind=") for part in key.path if part.startswith("kind=")]
        if kinds and kinds[0] != "repeat" and kinds[0] not in known:
            known.append(kinds[0])
    for (name, low, high, why), kinds in seen.items():
        if name.startswith("step.step."):
            continue  # the same keys once more, inside a repetition
        of = f" ({', '.join(kinds)})" if kinds else ""
        yield f"| `{name}`{of} | {text_of(low)} | {text_of(high)} | {why} |"


def table(title: str, keys: tuple[NumericKey, ...]) -> list[str]:
    """Return one section of the page."""
    return [f"\n## {title}\n", "| key | least | greatest | why |", "|---|---|---|---|", *rows(keys)]


def page() -> str:
    """Return the page."""
    lines = [HEAD, "## Bounds that depend on other keys\n", "| key | bounds | why |", "|---|---|---|"]
    lines += [f"| `{rule.table}.{rule.key}` | {rule.words} | {rule.why} |" for rule in RELATIVE]
    lines += table("Campaign file", numeric_keys(CampaignFile))
    lines += table("Stand file", numeric_keys(StandFile))
    lines.append(
        "\n`stand.tilt_max_mm` has the bounds of `guards.tilt_max_mm`; `plausible.overload` of "
        "force channels is at most 3 × `limits.force_max_kN`."
    )
    lines += table("Specimen file", numeric_keys(SpecimenFile))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
