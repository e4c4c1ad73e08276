"""Which steps of a plan are those of an earlier plan, though files were edited in between.

A plan hash covers limits and the specimen's data, too. Where these were edited, a step is the same test if it
asks for the same (the keys of its ``[[step]]``, without names, waits and limits), or has the same motions, on
the same specimen: the k-th of its kind is the k-th that was planned before.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from bufferstand.protocols.planning import Plan, asked_text, canonical_text


def same_steps(plan: Plan, before: Mapping[str, Any]) -> dict[str, str]:
    """Return the hashes of an earlier plan's steps, each with the present hash of the same step.

    Parameters
    ----------
    plan : Plan
        As it is now.
    before : mapping
        The earlier plan as data (``plan`` of ``campaign.json``).
    """
    now = [step.as_dict() for step in plan.steps if not step.pause]
    was = [step for step in before.get("steps", ()) if not step.get("pause")]
    present = {step["plan_hash"] for step in now}
    found = {step["plan_hash"]: step["plan_hash"] for step in was if step["plan_hash"] in present}
    if before.get("specimen", {}).get("id") != plan.specimen.id:
        return found
    for key in (_motions, _asked):
        left: dict[str, list[str]] = defaultdict(list)
        for step in was:
            if step["plan_hash"] not in found and (text := key(step)):
                left[text].append(step["plan_hash"])
        taken = set(found.values())
        for step in now:
            same = left.get(key(step))
            if step["plan_hash"] not in taken and same:
                found[same.pop(0)] = step["plan_hash"]
    return found


def _motions(step: Mapping[str, Any]) -> str:
    return canonical_text([step.get(key) for key in ("motions", "proof_load", "steady")])


def _asked(step: Mapping[str, Any]) -> str:
    return asked_text(step.get("asked"), compensate=step.get("compensate"))
