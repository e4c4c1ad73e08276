"""Holds the requirements of impacts and proof loads, and that draw gear has none, against the truth."""

from __future__ import annotations

from typing import Any

import numpy as np

from .chain import Scene, Stated
from .holding import regular
from .judgement import Judgement
from .requirements import MARGIN, hidden
from .truth import TrueCycle

# limit-sets.md: the impact of category A, and what it must absorb of what it stores
CATEGORY_A_J, ABSORBED = 30_000.0, 0.60
SAMPLES = 5  # a proof load is the largest mean of five samples in a row


def hold_other_tests(
    j: Judgement, scene: Scene, run: dict[str, Any], strokes: dict[int, TrueCycle | None], *, disturbed: bool
) -> None:
    """Note false verdicts of an impact, a proof load, or a specimen that the limit set is not for."""
    if scene.facts["what"] == "draw-gear":
        for row in run["requirements"]:
            if row["verdict"] in {"pass", "fail", "invalid"}:
                j.say(f"false {row['verdict']}", row["id"], "EN 15551 is not for draw gear")
        return
    true = [c for c in scene.cycles if c.whole and regular(scene, c)]
    for row in run["requirements"]:
        name, verdict = row["id"], row["verdict"]
        if scene.motion.kind == "proof":
            _proof(j, scene, row, disturbed=disturbed)
            continue
        limit = {"stored-energy-category": CATEGORY_A_J, "absorbed-energy-ratio": ABSORBED}.get(name)
        key = "stored_energy_J" if name == "stored-energy-category" else "damping"
        if limit is None or hidden(scene, key):
            continue
        if len(true) != 1:
            if verdict in {"pass", "fail"}:
                j.say(f"false {verdict}", name, "the buffer does not come back on record")
            continue
        value, u = true[0].figures[key][0], row["expanded_uncertainty"] or 0.005 * limit
        said = f"{verdict}, measured {row['measured']}, {row['why']}"
        why = f"true {value:.5g}, at least {limit:g}, ± {u:.3g}: {said}"
        if verdict == "pass" and value < limit - MARGIN * u:
            j.say("false pass", name, why)
        elif verdict == "fail" and value > limit + MARGIN * u:
            j.say("false fail", name, why)
        elif verdict not in {"pass", "fail"} and not disturbed:
            j.say("needless", name, why)


def _proof(j: Judgement, scene: Scene, row: dict[str, Any], *, disturbed: bool) -> None:
    """Hold the force of a proof load: reached is a pass, not reached is no failure of the specimen."""
    wanted = next(v for k, v in scene.motion.facts.items() if k.startswith("F"))
    if not row["id"].startswith("proof-load") or hidden(scene, "force_max_kN"):
        return
    at = scene.true_time_s[np.isfinite(scene.force_read_kN)]
    force = np.interp(np.sort(at), scene.motion.time_s, scene.force_kN)
    true = float(np.convolve(force, np.ones(SAMPLES) / SAMPLES, "valid").max())
    of = scene.stated.get("force", Stated())
    u = of.zero + wanted * of.accuracy_percent / 100.0 + 3.0 * float(str(scene.facts["noise_kN"]))
    verdict, why = row["verdict"], f"true {true:.5g} of {wanted:g} kN: {row['verdict']}, {row['why']}"
    if verdict == "fail":
        j.say("false fail", row["id"], why)
    elif verdict == "pass" and true < wanted - u:
        j.say("false pass", row["id"], why)
    elif verdict not in {"pass", "fail"} and true > wanted + u and not disturbed:
        j.say("needless", row["id"], why)
