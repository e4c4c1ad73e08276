"""Chooses the keys of a step by its kind, which is read first."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence

from bufferstand.foundation.settings import WrongKeyError


def checked_kind(
    kinds: Sequence[str], elsewhere: Sequence[str] = (), why: str = ""
) -> Callable[[object], object]:
    """Return what refuses a step without kind, or with an unknown one, before its keys are looked at.

    Parameters
    ----------
    kinds : sequence of str
        What there is.
    elsewhere : sequence of str
        Kinds that are known, but not at this place.
    why : str
        Why not.
    """

    def check(value: object) -> object:
        if not isinstance(value, dict):
            return value
        if "kind" not in value:
            raise ValueError(f"this step has no kind; give kind = one of {', '.join(kinds)}")
        kind = value["kind"]
        if kind in elsewhere:
            raise WrongKeyError(f"kind = “{kind}” is not possible here: {why}", "kind")
        if kind not in kinds:
            near = difflib.get_close_matches(str(kind), kinds, n=1, cutoff=0.4)
            hint = f"did you mean “{near[0]}”?" if near else f"use one of {', '.join(kinds)}"
            raise WrongKeyError(f"unknown kind of step “{kind}”; {hint}", "kind")
        return value

    return check
