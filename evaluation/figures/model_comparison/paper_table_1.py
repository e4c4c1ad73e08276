"""Table 1 of the paper: what a buffer of category A stores and absorbs when two wagons meet."""

from __future__ import annotations

from bufferstand.evaluation.figures.model_comparison.paper_rows import PaperRow
from bufferstand.model import SpringModel, impact_to

WAGON_t = 80.0
REACH = 0.999
"""Share of the full stroke to which the impact goes: beyond it stands the stop."""
_TEMPERATURE_C = 20.0


def table_1(buffer: SpringModel) -> list[PaperRow]:
    """Return stored energy and absorbed share of the impact that just uses the buffer's stroke up."""
    done = impact_to(buffer, WAGON_t, REACH * buffer.curves.end_mm, _TEMPERATURE_C)
    what = f"two wagons of {WAGON_t:g} t, {done.speed_m_per_s * 3.6:.1f} km/h, {done.stroke_mm:.1f} mm"
    least = "the least that category A asks; the specimen was made to show it"
    return [
        PaperRow("T. 1", f"stored energy in an impact ({what})", "kJ", 30.0,
                 done.stored_energy_J / 1e3, least),
        PaperRow("T. 1", "absorbed share of it", "%", 60.0, 100.0 * done.damping, least),
        PaperRow("T. 1", "largest force in it", "kN", None, done.peak_force_kN, ""),
    ]  # fmt: skip
