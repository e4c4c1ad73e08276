"""The kinds of imperfections, and which of them a record gets."""

from __future__ import annotations

import numpy as np

from .chain import Scene
from .kinds import channels, noise, rows, stamps, statements, thermometers
from .kinds.common import Kind

KINDS: tuple[Kind, ...] = (
    Kind("noise-coloured", 0, "noise", noise.coloured),
    Kind("hum", 0, "hum", noise.hum),
    Kind("drift-within", 0, "drift", noise.drift_within),
    Kind("wire-period", 0, "wire", noise.wire_period),
    Kind("drift-beyond", 0, "drift", channels.drift_beyond),
    Kind("force-late-beyond", 0, "late", statements.force_late),
    Kind("zero-off", 0, "zero", statements.zero_off),
    Kind("force-zero-off", 0, "drift", statements.force_zero_off),
    Kind("gain-jump", 0, "jump", channels.gain_jump),
    Kind("offset-jump", 0, "jump", channels.offset_jump),
    Kind("stroke-slip", 0, "jump", channels.stroke_slip),
    Kind("spikes", 1, "spikes", channels.spikes),
    Kind("sentinel", 3, "spikes", channels.sentinels),
    Kind("clipped-force", 1, "clip", channels.clipped_force),
    Kind("clipped-stroke", 1, "clip", channels.clipped_stroke),
    Kind("quantised", 1, "quantised", noise.quantised),
    Kind("held", 1, "held", channels.held),
    Kind("frozen", 1, "frozen", channels.frozen),
    Kind("temperature-sparse", 2, "temperature", thermometers.sparse),
    Kind("temperature-first-second", 2, "temperature", thermometers.first_second),
    Kind("temperature-hole", 2, "temperature", thermometers.hole),
    Kind("temperature-85", 2, "temperature", thermometers.power_on),
    Kind("temperature-127", 2, "temperature", thermometers.disconnected),
    Kind("temperature-swapped", 2, "temperature", thermometers.swapped),
    Kind("temperature-missing", 2, "temperature", thermometers.missing),
    Kind("lost-single", 3, "lost-single", rows.lost_single),
    Kind("lost-burst", 3, "lost-burst", rows.lost_burst),
    Kind("lost-turn", 3, "lost-turn", rows.lost_turn),
    Kind("lost-branch", 3, "lost-burst", rows.lost_branch),
    Kind("lost-stroke", 3, "lost-burst", rows.lost_stroke),
    Kind("lost-pause", 3, "lost-pause", rows.lost_pause),
    Kind("rate-change", 3, "rate", rows.slower_at_rest),
    Kind("few-samples", 3, "rate", rows.few_samples),
    Kind("rate-change-moving", 3, "rate", rows.slower_in_motion),
    Kind("stops-at-rest", 3, "rate", rows.stops_at_rest),
    Kind("event-log", 3, "rate", rows.by_event),
    Kind("nan-cells", 3, "nan", rows.no_numbers),
    Kind("nan-burst", 3, "nan", rows.no_numbers_burst),
    Kind("blanks", 3, "rate", rows.slower_force),
    Kind("interleaved", 3, "rate", rows.interleaved),
    Kind("doubled", 4, "stamps", stamps.doubled),
    Kind("backward", 4, "stamps", stamps.backward),
    Kind("clock-set-back", 4, "stamps", stamps.clock_back),
    Kind("rounded-stamps", 4, "stamps", stamps.rounded),
    Kind("jitter", 4, "stamps", stamps.jittered),
    Kind("unit-N-as-kN", 5, "export", statements.newtons),
    Kind("unit-lbf-as-kN", 5, "export", statements.pounds),
    Kind("unit-m-as-mm", 5, "export", statements.metres),
    Kind("unit-in-as-mm", 5, "export", statements.inches),
    Kind("times-ten", 5, "export", statements.times_ten),
    Kind("sign-force", 5, "export", statements.sign_force),
    Kind("sign-stroke", 5, "export", statements.sign_stroke),
)


def put_in(rng: np.random.Generator, scene: Scene, only: str | None = None) -> None:
    """Put none to four imperfections in, each with a size of its own, in the order in which they arise."""
    if only is not None:
        chosen = [kind for kind in KINDS if kind.name == only]
    else:
        wanted = int(rng.choice([0, 1, 2, 3, 4], p=[0.08, 0.37, 0.3, 0.17, 0.08]))
        chosen = []
        for i in rng.permutation(len(KINDS)):
            kind = KINDS[i]
            if len(chosen) < wanted and all(kind.group != other.group for other in chosen):
                chosen.append(kind)
    for kind in sorted(chosen, key=lambda kind: kind.stage):
        made = kind.make(rng, scene)
        if made is not None:
            scene.applied.append(made)
