"""A release that goes on though the specimen has been let go: its force is none of the specimen's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.scaling import ScaledBlock

BACK_MM = 10.0
"""So far the piston draws back, and so far it stands behind its zero then: no frame springs back by as much
(600 kN on a machine of 80 kN/mm give way by 7.5 mm), and no specimen touches a piston that far behind first
contact, nor a piston's own zero that nobody has set anew."""
SAME_KN, SAME_SHARE = 2.0, 0.1
"""The force is the same where it changes by no more than this and this share of it: drift, hum …"""
SAME_MM = 1.0
"""… and the draw wires are, where they change by no more than this."""


@dataclass(frozen=True)
class _Place:
    position_mm: float
    force_kN: float
    stroke_mm: float | None


class LetGo:
    """Follows a piston that draws back; begins with the first block."""

    def __init__(self) -> None:
        self._since: _Place | None = None
        self._now: _Place | None = None

    def take(self, block: ScaledBlock) -> None:
        """Take a block of the controller: where its force or the draw wires change, the specimen is there."""
        if not len(block) or not {"position", "force"} <= block.values.keys():
            return
        stroke = block.values.get("stroke")
        now = _Place(
            float(np.mean(block.values["position"])),
            float(np.mean(block.values["force"])),
            None if stroke is None else float(np.mean(stroke)),
        )
        self._now = now
        if self._since is None or not _same(self._since, now):
            self._since = now

    def seen(self) -> str:
        """Return in words that nothing changes any more while the piston draws back, empty if it may yet."""
        if self._since is None or self._now is None:
            return ""
        back_mm = self._since.position_mm - self._now.position_mm
        if not (back_mm >= BACK_MM and self._now.position_mm <= -BACK_MM):
            return ""
        wires = "" if self._now.stroke_mm is None else " and the draw wires"
        return (
            f"the piston drew back by {back_mm:.1f} mm to {self._now.position_mm:.1f} mm, and the force "
            f"({self._now.force_kN:.1f} kN){wires} stayed the same: it is not the specimen's force, look at "
            "its zero and its wiring"
        )


def _same(one: _Place, other: _Place) -> bool:
    """Return whether force and stroke are the same; what is no number never is."""
    if not abs(one.force_kN - other.force_kN) <= SAME_KN + SAME_SHARE * abs(one.force_kN):
        return False
    if one.stroke_mm is None or other.stroke_mm is None:
        return True
    return abs(one.stroke_mm - other.stroke_mm) <= SAME_MM
