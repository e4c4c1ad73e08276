"""What is said of one record."""

from __future__ import annotations

from dataclasses import dataclass, field

Finding = tuple[str, str, str]  # category, what, detail

# Falsehoods: none is allowed in any record. The other categories are counted and published.
FALSE = (
    "generator",
    "crash",
    "refused record",
    "false pass",
    "false fail",
    "unfounded",
    "mixed",
    "numbering",
    "unnamed",
    "false alarm",
    "document",
)
COUNTED = ("not distinguishable", "beyond U", "gross", "spoilt", "quiet", "needless", "no U")


@dataclass
class Judgement:
    """What the judge says of one record."""

    number: int
    kinds: list[str]
    findings: list[Finding] = field(default_factory=list)
    # figure and error over U (or over half_width_95), where U must hold
    ratios: list[tuple[str, float]] = field(default_factory=list)
    off: list[tuple[str, float, float, str]] = field(
        default_factory=list
    )  # figure, start, end: wrong beyond U
    held: list[tuple[str, float, float]] = field(
        default_factory=list
    )  # figure, start, end: compared with the truth
    chance: float = 0.0  # verdicts on the wrong side by 1 to 1.5 U that an honest U makes, expected number
    seconds: float = 0.0  # processor time of import and evaluation
    refused: int = 0  # cycles on the record without figures
    whole: int = 0

    def say(self, category: str, what: str, detail: str) -> None:
        """Note a finding."""
        self.findings.append((category, what, detail))

    @property
    def falsehoods(self) -> list[Finding]:
        """Return the findings that no record may have."""
        return [f for f in self.findings if f[0] in FALSE]
