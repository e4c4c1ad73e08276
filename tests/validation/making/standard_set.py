"""A standard data set: a record, what is agreed of it, and how both are written."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SCHEMA = "bufferstand/validation-set/1"
UNITS = {
    "stored_energy_J": "J",
    "absorbed_energy_J": "J",
    "damping": "1",
    "loss_factor": "1",
    "frequency_Hz": "Hz",
    "stroke_distortion": "1",
}


def unit_of(name: str) -> str:
    """Return the unit that a contract name ends with."""
    if name in UNITS:
        return UNITS[name]
    for ending, unit in (
        ("kN_per_mm", "kN/mm"),
        ("mm_per_s", "mm/s"),
        ("_mm", "mm"),
        ("_kN", "kN"),
        ("_C", "°C"),
    ):
        if name.endswith(ending):
            return unit
    raise ValueError(name)


@dataclass(frozen=True)
class Agreed:
    """One agreed value or text. ``of`` says where it stands in an evaluation document."""

    of: Mapping[str, Any]
    what: str
    value: float | str | int
    source: str
    tolerance: float | None = None
    unit: str = ""

    def entry(self) -> dict[str, Any]:
        """Return it as the truth file holds it."""
        return {
            "of": dict(self.of),
            "what": self.what,
            "value": self.value,
            "tolerance": self.tolerance,
            "unit": self.unit,
            "source": self.source,
        }


def summary(what: str, value: float, source: str, *, share: float = 0.0, absolute: float = 0.0) -> Agreed:
    """Return an agreed mean over a run's cycles, to a share of itself or an absolute difference."""
    return _number({"in": "summary"}, what, value, source, share, absolute)


def of_cycle(
    index: int, what: str, value: float, source: str, *, share: float = 0.0, absolute: float = 0.0
) -> Agreed:
    """Return an agreed figure of one cycle, numbered as it happened."""
    return _number({"in": "cycle", "index": index}, what, value, source, share, absolute)


def of_step(
    index: int, what: str, value: float, source: str, *, share: float = 0.0, absolute: float = 0.0
) -> Agreed:
    """Return an agreed mean of one step of a record with several."""
    return _number({"in": "step", "index": index}, what, value, source, share, absolute)


def measured(
    identity: str,
    cycle: int | None,
    value: float,
    unit: str,
    source: str,
    *,
    share: float = 0.0,
    absolute: float = 0.0,
) -> Agreed:
    """Return the agreed measured value of a requirement."""
    of = {"in": "requirement", "id": identity, "cycle": cycle}
    return Agreed(of, "measured", value, source, max(share * abs(value), absolute), unit)


def verdict(identity: str, cycle: int | None, value: str, source: str) -> Agreed:
    """Return the agreed verdict on a requirement or condition."""
    return Agreed({"in": "requirement", "id": identity, "cycle": cycle}, "verdict", value, source)


def run_verdict(value: str, source: str) -> Agreed:
    """Return the agreed verdict of the whole run."""
    return Agreed({"in": "run"}, "verdict", value, source)


def complete_cycles(count: int, source: str) -> Agreed:
    """Return the agreed number of complete cycles."""
    return Agreed({"in": "run"}, "complete_cycles", count, source, 0.0, "cycles")


def _number(
    of: Mapping[str, Any], what: str, value: float, source: str, share: float, absolute: float
) -> Agreed:
    return Agreed(of, what, float(value), source, max(share * abs(float(value)), absolute), unit_of(what))


@dataclass(frozen=True, eq=False)
class StandardSet:
    """A set: identity ``group/name``, the record's text, facts for the import, and what is agreed.

    ``columns`` are (header, values, decimals); NaN is an empty cell. ``text`` replaces them where the record
    is written otherwise than in plain CSV.
    """

    identity: str
    title: str
    about: str
    agreed: Sequence[Agreed]
    columns: Sequence[tuple[str, FloatArray, int]] = ()
    kind: str = "harmonic"
    specimen: Mapping[str, Any] = field(default_factory=dict)
    test: Mapping[str, Any] = field(default_factory=dict)
    text: bytes | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    mapping: str | None = None

    def record(self) -> bytes:
        """Return the record as it is written."""
        if self.text is not None:
            return self.text
        return csv_text(self.columns).encode("utf-8")

    def write(self, folder: Path) -> None:
        """Write record, facts and truth into ``folder/group/name``."""
        place = folder / self.identity
        place.mkdir(parents=True, exist_ok=True)
        (place / "record.csv").write_bytes(self.record())
        (place / "record.toml").write_text(self._facts(), encoding="utf-8")
        if self.mapping is not None:
            (place / "mapping.toml").write_text(self.mapping, encoding="utf-8")
        (place / "truth.json").write_text(self._truth_text(), encoding="utf-8")

    def truth(self) -> dict[str, Any]:
        """Return what is agreed, as the truth file holds it."""
        return {
            "schema": SCHEMA,
            "id": self.identity,
            "title": self.title,
            "about": self.about,
            "kind": self.kind,
            "options": dict(self.options),
            "agreed": [entry.entry() for entry in self.agreed],
        }

    def _truth_text(self) -> str:
        """Return the truth as JSON with a line for every agreed value."""
        truth = self.truth()
        agreed = truth.pop("agreed")
        head = json.dumps(truth, indent=1, ensure_ascii=False).removesuffix("\n}")
        lines = ",\n".join("  " + json.dumps(entry, ensure_ascii=False) for entry in agreed)
        return f'{head},\n "agreed": [\n{lines}\n ]\n}}\n'

    def _facts(self) -> str:
        specimen = {"id": f"standard set {self.identity}", "kind": "buffer", "max_stroke_mm": 105.0}
        tables = {"specimen": {**specimen, **self.specimen}, "test": {"kind": self.kind, **self.test}}
        lines = []
        for name, entries in tables.items():
            lines.append(f"[{name}]")
            lines += [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in entries.items()]
            lines.append("")
        return "\n".join(lines)


def csv_text(
    columns: Sequence[tuple[str, FloatArray, int]], *, separator: str = ",", comma: bool = False
) -> str:
    """Return columns as text, one row a line."""
    cells = []
    for _, values, decimals in columns:
        texts = ["" if np.isnan(value) else _shortest(value, decimals) for value in values]
        cells.append([text.replace(".", ",") for text in texts] if comma else texts)
    head = separator.join(name for name, _, _ in columns)
    rows = (separator.join(row) for row in zip(*cells, strict=True))
    return "\n".join((head, *rows)) + "\n"


def _shortest(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
