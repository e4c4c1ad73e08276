"""What a report rests on, with hashes: the file ``proof.json`` inside its PDF."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

PROOF_NAME = "proof.json"
PROOF_SCHEMA = "bufferstand/report-proof/1"
_Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore", frozen=True)


class NamedFile(_Part):
    """A file and its hash."""

    file: str
    sha256: _Hash


class NamedRun(NamedFile):
    """A run file and its hash."""

    id: str


class Amended(_Part):
    """The report that this one replaces; without a hash where only its id was given."""

    report: str
    sha256: _Hash | None = None


class Proof(_Part):
    """What a report rests on, as its PDF has it inside."""

    schema_: Literal["bufferstand/report-proof/1"] = Field(alias="schema")
    report: str
    draft: bool
    evaluations: list[NamedFile]
    attached: list[NamedFile] = Field(default_factory=list)
    """What else is inside."""
    runs: list[NamedRun]
    amends: Amended | None = None
