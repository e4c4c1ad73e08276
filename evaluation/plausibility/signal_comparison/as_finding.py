"""Makes a finding of the run from a doubt about a signal."""

from __future__ import annotations

from bufferstand.evaluation.facts import Effect, Finding, FindingKind
from bufferstand.evaluation.plausibility.run_view import RunView

CABLE = "look at its cable and plug"
SETTING = "[[controller.channel]] of the stand file"
SECOND = "[amplifier.channel] of the stand file"
SENSOR = "[[temperature.sensor]] of the stand file"


def doubt(
    look: RunView,
    kind: FindingKind,
    channel: str,
    size: float | None,
    unit: str,
    text: str,
    *,
    effect: Effect = "spoils",
) -> Finding:
    """Return a finding about a whole run.

    Parameters
    ----------
    look : Look
    kind, channel, size, unit, text, effect
        As in :class:`Finding`. Of a signal that no figure is read from the effect is ``noted``.
    """
    start_s, end_s = float(look.samples.time_s[0]), float(look.samples.time_s[-1])
    cycles = look.all_cycles if effect == "spoils" else ()
    return Finding(kind, channel, start_s, end_s, cycles, size, unit, text, effect, whole_record=True)
