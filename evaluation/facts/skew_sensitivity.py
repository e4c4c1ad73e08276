"""What a millisecond between force and stroke changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

ClosedForm = Literal["sine-stroke", "constant-speed", "none"]


@dataclass(frozen=True)
class SkewSensitivity:
    """What changes when the force is moved earlier by 1 ms (``delay_s`` of its channel raised by 1 ms).

    Attributes
    ----------
    cycles : tuple of int
        Cycles that were shifted; the figures are means over them.
    absorbed_energy_J_per_ms, damping_per_ms : mapping
        ``by_shifting``: figures of the shifted loop; ``closed_form``: that of ``form``. None: not to be had.
    form : str
        ``sine-stroke``: ΔW_a = π ω K′ x_a² τ, half of it on the loading branch; ``constant-speed``:
        ΔW_a = (v_loading + v_unloading) (F_top - F_bottom) τ, the first part on the loading branch.
    """

    cycles: tuple[int, ...]
    absorbed_energy_J_per_ms: Mapping[str, float | None]
    damping_per_ms: Mapping[str, float | None]
    form: ClosedForm
