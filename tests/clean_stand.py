"""The sample stand without its imperfections: for closed forms, and for what is off on purpose."""

from __future__ import annotations

from pathlib import Path

SAMPLE_STAND = Path(__file__).parents[1] / "sample_runs" / "stand.toml"
IMPERFECTIONS = (
    "servo_lag_s",
    "reversal_s",
    "force_speed",
    "force_flicker_kN",
    "force_hum_kN",
    "stroke_flicker_mm",
    "stroke_hum_mm",
    "force_drift_kN_per_h",
    "force_zero_kN",
    "wire_zero_mm",
    "gap_mm",
    "frame_stiffness_kN_per_mm",
    "warm_up_K",
    "force_zero_kN_per_K",
    "force_gain_per_K",
    "wire_zero_mm_per_K",
    "wire_gain_per_K",
    "wire_drift_mm_per_h",
    "reply_latency_s",
    "reply_jitter_s",
    "missed_cycles_per_h",
)
"""Keys of the table ``[simulation]`` that a clean stand leaves out."""


def clean_stand_text() -> str:
    """Return the sample stand file without the imperfections in ``[simulation]``."""
    before, head, table = SAMPLE_STAND.read_text(encoding="utf-8").partition("[simulation]\n")
    kept = [line for line in table.splitlines() if line.partition(" =")[0] not in IMPERFECTIONS]
    return before + head + "\n".join(kept) + "\n"


def stiff_stand(folder: Path) -> Path:
    """Return the sample stand, written to a folder, with the frame that it states: the paper's machine.

    Everything else is as imperfect as it is.
    """
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith("frame_stiffness_kN_per_mm")]
    path = folder / "stand.toml"
    whole = "\n".join(kept).replace('model = "models/', f'model = "{SAMPLE_STAND.parent}/models/')
    path.write_text(whole + "\n", encoding="utf-8")
    return path
