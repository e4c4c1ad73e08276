"""What is said of one record."""

from __future__ import annotations

from dataclasses import dataclass, field

Finding = tuple[str, str, str]  # category, what, detail


@dataclass
class Judgement:
    """What the judge says of one record."""

    number: int
    kinds: list[str]
    findings: list[Finding] = field(default_factory=list)
    ratios: list[tuple[str, float]] = field(
        default_factory=list
    )  # figure, error / U; of those that must be within U
    seconds: float = 0.0  # processor time of import and evaluation
    refused: int = 0  # cycles on the record without figures
    whole: int = 0

    def say(self, category: str, what: str, detail: str) -> None:
        """Note a finding."""
        self.findings.append((category, what, detail))
