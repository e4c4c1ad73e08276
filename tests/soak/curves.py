"""What was seen of memory, handles, threads and files over time, and whether any of it grows."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Self

QUARTERS = 4


@dataclass
class Curves:
    """Looks at a program: one value of each quantity a look.

    Parameters
    ----------
    at_h : list of float
        When each look was taken, in hours of the stand since the first campaign began.
    values : dict
        Of each quantity, with its unit in its name: one value a look.
    """

    at_h: list[float] = field(default_factory=list)
    values: dict[str, list[float]] = field(default_factory=dict)

    def add(self, at_h: float, found: Mapping[str, float]) -> None:
        """Take a look.

        Raises
        ------
        ValueError
            If its quantities are others than those of the first one.
        """
        if self.at_h and set(found) != set(self.values):
            raise ValueError(f"a look at {sorted(found)}, the first one was at {sorted(self.values)}")
        self.at_h.append(at_h)
        for name, value in found.items():
            self.values.setdefault(name, []).append(float(value))

    def quarters(self, name: str) -> tuple[float, float]:
        """Return the median of the second quarter of the looks, and of the last one.

        The first quarter is left out: imports, caches and pools fill then. Under four looks: first and last.
        """
        looks = self.values[name]
        size = max(1, len(looks) // QUARTERS)
        second = looks[size : 2 * size] if len(looks) >= QUARTERS else looks[:1]
        return median(second), median(looks[-size:])

    def grown(self, limits: Mapping[str, float]) -> list[str]:
        """Return what has grown beyond its limit, one sentence each.

        Parameters
        ----------
        limits : mapping
            Of each quantity: the largest allowed ratio of the last quarter to the second.
        """
        found = []
        for name, limit in limits.items():
            second, last = self.quarters(name)
            if last > limit * second:
                found.append(
                    f"{name} grew from {second:.6g} to {last:.6g}; at most {limit:g} times as much is flat"
                )
        return found

    def table(self, limits: Mapping[str, float]) -> str:
        """Return a Markdown table: first look, quarters, greatest, ratio and limit."""
        lines = [
            "| quantity | first look | second quarter | last quarter | greatest | last / second | limit |",
            "|---|---|---|---|---|---|---|",
        ]
        for name, looks in self.values.items():
            second, last = self.quarters(name)
            ratio = f"{last / second:.3f}" if second else "–"
            limit = f"{limits[name]:g}" if name in limits else "–"
            lines.append(
                f"| {name.replace('_', ' ')} | {looks[0]:.6g} | {second:.6g} | {last:.6g} | {max(looks):.6g} "
                f"| {ratio} | {limit} |"
            )
        return "\n".join(lines) + "\n"

    def save(self, file: Path) -> None:
        """Write them as JSON."""
        file.write_text(json.dumps({"at_h": self.at_h, "values": self.values}) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, file: Path) -> Self:
        """Read what :meth:`save` wrote."""
        read = json.loads(file.read_text(encoding="utf-8"))
        return cls(read["at_h"], read["values"])

    def draw(self, file: Path) -> None:
        """Draw each quantity over time, from zero, as a picture."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.0, 1.3 * len(self.values) + 0.6), layout="constrained")
        axes = figure.subplots(len(self.values), 1, sharex=True, squeeze=False)[:, 0]
        for place, (name, looks) in zip(axes, self.values.items(), strict=True):
            place.plot(self.at_h, looks, linewidth=1.0)
            place.set_ylim(0.0, 1.15 * max(*looks, 1e-9))
            place.set_title(name.replace("_", " "), loc="left", fontsize=9)
            place.grid(linewidth=0.3)
        axes[-1].set_xlabel("time [h]")
        figure.savefig(file, dpi=90)
