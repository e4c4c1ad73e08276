"""Where the source of a limit set is unclear or at odds with itself: each reading a named option."""

from __future__ import annotations

from typing import Literal

from bufferstand.foundation.settings import Settings


class LimitSetReadings(Settings):
    """How a limit set reads what its source leaves open (docs/limit-sets.md); defaults where a set is silent.

    Attributes
    ----------
    static_extent : str
        How far a static cycle must go: to ``full-stroke``, or to the ``proof-load`` F1 of the same set.
    absorbed_energy : str
        W_a beside a W_s that ends at the force cap: between the same limits of stroke
        (``same-stroke-limits``), or of the ``whole-cycle``.
    force_cap_crossing : str
        Where a loading branch that crosses the cap more than once is cut: ``first`` or ``last`` crossing.
    comparator : str
        A least value itself meets the requirement (``at-least``), or fails where the source prints “greater”
        (``as-printed``; the set lists these under ``printed_greater``).
    force_cycles : str
        Which of the judged cycles the force windows bind: ``all``, ``first`` or ``last``.
    preload : str
        Line through the loading branch ``extrapolated`` to stroke 0, or the force ``at-0.5mm``.
    rest : str
        Rest after assembly ``at-least`` so long, or ``exactly`` so long within ``rest_tolerance_h``.
    block_contact : str
        Force windows that reach into block contact: ``flag`` in words, or ``inconclusive``.
    """

    static_extent: Literal["full-stroke", "proof-load"] = "full-stroke"
    absorbed_energy: Literal["same-stroke-limits", "whole-cycle"] = "same-stroke-limits"
    force_cap_crossing: Literal["first", "last"] = "first"
    comparator: Literal["at-least", "as-printed"] = "at-least"
    force_cycles: Literal["all", "first", "last"] = "all"
    preload: Literal["extrapolated", "at-0.5mm"] = "extrapolated"
    rest: Literal["at-least", "exactly"] = "at-least"
    block_contact: Literal["flag", "inconclusive"] = "flag"
