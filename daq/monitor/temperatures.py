"""What a page shows of temperatures: readings of each sensor, and where the warmest on the specimen goes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bufferstand.daq.campaign_folder import CampaignRecord
    from bufferstand.model import HeatBalance

SHOWN_READINGS = 300
"""Of each sensor."""


class Temperatures:
    """Readings by stream, and which of them are on the specimen."""

    def __init__(self) -> None:
        self.guards: Mapping[str, Any] = {}
        """The guards of the campaign as they state themselves; empty before they are known."""
        self.heat: HeatBalance | None = None
        """The heat balance of the campaign's specimen, where it is known."""
        self._readings: dict[str, list[tuple[float, float]]] = {}

    def take(self, stream: str, readings: Iterable[tuple[float, float]]) -> None:
        """Take readings of a sensor as (time [s], °C); of many, the older ones are thinned out."""
        kept = self._readings.setdefault(stream, [])
        kept.extend((at_s, value) for at_s, value in readings)
        while len(kept) > 2 * SHOWN_READINGS:
            del kept[1:-SHOWN_READINGS:2]

    def newest_C(self) -> dict[str, float]:  # noqa: N802 - the unit keeps its capital
        """Return the newest reading of each sensor [°C]."""
        return {name: kept[-1][1] for name, kept in self._readings.items() if kept}

    def warmest_C(self, known: Mapping[str, float]) -> float | None:  # noqa: N802 - as above
        """Return the warmest of these readings that is on the specimen [°C]."""
        on_it = {one["stream"] for one in self._guarded() if one["resume_C"] is not None}
        return max((value for name, value in known.items() if not on_it or name in on_it), default=None)

    def section(
        self, record: CampaignRecord | None, progress: Mapping[str, Any], *, stopping: bool
    ) -> dict[str, Any]:
        """Return the page's section of temperatures.

        Parameters
        ----------
        record : CampaignRecord or None
            Has the plan, and how far it has come.
        progress : mapping
            What the campaign said last of itself.
        stopping : bool
            It ends before its plan does: nothing is foretold then.
        """
        sensors = [
            {
                "name": guard["stream"],
                "place": guard["place"],
                "specimen": guard["resume_C"] is not None,
                "points": self._readings.get(guard["stream"], [])[-SHOWN_READINGS:],
            }
            for guard in self._guarded()
        ]
        forecast = None if stopping else self._forecast(sensors, record, progress)
        return {"sensors": sensors, "forecast": forecast}

    def _guarded(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.guards.get("temperatures", [])
        return found

    def _ambient_C(self, record: CampaignRecord) -> float:  # noqa: N802 - as above
        """Return the temperature of the air: a sensor's, if one is there for it, else the campaign file's."""
        for guard in self._guarded():
            kept = self._readings.get(guard["stream"])
            if guard["stop_C"] is None and guard["resume_C"] is None and kept:
                return kept[-1][1]
        return float(record.plan["conditions"]["ambient_C"])

    def _forecast(
        self, sensors: list[dict[str, Any]], record: CampaignRecord | None, progress: Mapping[str, Any]
    ) -> dict[str, Any] | None:
        """Return where the warmest specimen sensor goes, None where nothing can be said."""
        warm = [s["points"] for s in sensors if s["specimen"] and s["points"]]
        left_s = progress.get("remaining_s")
        if self.heat is None or record is None or not warm or left_s is None:
            return None
        from bufferstand.daq.monitor.forecast import foresee, slope, stretches  # noqa: PLC0415 - as in heat_of

        points = max(warm, key=lambda kept: kept[-1][1])
        plan = stretches(
            record.plan["steps"], [step.status for step in record.steps], progress.get("step", 0), left_s
        )
        stop_C = record.plan["limits"]["test"].get("temperature_stop_C")
        found = foresee(self.heat, points[-1][1], slope(points), self._ambient_C(record), plan, stop_C)
        start_s = points[-1][0]
        return {
            "points": [(round(start_s + at_s, 1), round(value, 2)) for at_s, value in found.points],
            "reach_s": None if found.reach_s is None else round(found.reach_s),
            "step": found.step,
            "end_C": round(found.points[-1][1], 1),
        }


def heat_of(folder: Path, campaign_file: str) -> HeatBalance | None:
    """Return the heat balance of a campaign's specimen, None where it is not known; may block."""
    # The spring model's libraries take seconds on a busy machine: the page is served before.
    from bufferstand.daq.monitor.forecast import heat_balance_of  # noqa: PLC0415

    return heat_balance_of(folder, campaign_file)
