"""First contact of a run, as the record shows it."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.evaluation.facts.document_types import FirstContactEntry


@dataclass(frozen=True)
class FirstContact:
    """First contact as the record shows it; what it does not show is None, and ``why`` says why.

    Attributes
    ----------
    stroke_mm : float or None
        Place of the contact on the recorded stroke.
    expanded_uncertainty : float or None
        Half of the stretch in which it surely lies, noise of the stroke included [mm].
    recorded_zero_offset_mm : float or None
        Recorded zero of the stroke as counted from the contact: negative where the zero lies before it.
    rest_force_kN : float or None
        Force before contact.
    stated_zero_mm : float
        Limit of the error of the zero that the stroke channels state (0: none).
    beyond : bool
        Whether the zero is off by more than U and what is stated.
    how : str
        ``jump`` (preload), ``rise`` (none to be seen) or ``not on record``.
    why : str
    """

    stroke_mm: float | None
    expanded_uncertainty: float | None
    recorded_zero_offset_mm: float | None
    rest_force_kN: float | None
    stated_zero_mm: float
    beyond: bool
    how: str
    why: str

    def entry(self) -> FirstContactEntry:
        """Return it as the document holds it."""
        return {
            "stroke_mm": self.stroke_mm,
            "expanded_uncertainty": self.expanded_uncertainty,
            "recorded_zero_offset_mm": self.recorded_zero_offset_mm,
            "rest_force_kN": self.rest_force_kN,
            "stated_zero_mm": self.stated_zero_mm,
            "beyond": self.beyond,
            "how": self.how,
            "why": self.why,
        }
