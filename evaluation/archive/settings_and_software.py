"""Hashes of what an evaluation depends on besides the run: settings and software."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import cache, cached_property
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.requirements import LimitSet, shipped_limit_set
from bufferstand.foundation.files import content_hash

ROOMS = ("evaluation", "recording", "foundation")
"""Rooms whose code makes the figures …"""
_NOT_OF_FIGURES = (
    "evaluation/figures",
    "evaluation/publication",
    "evaluation/report",
    "evaluation/validation",
)
"""… but for what only shows or checks them."""
LIBRARIES = ("numpy", "scipy", "h5py", "GTC", "orjson")
"""Libraries whose other version may give another last digit, or write it otherwise."""
THREADS = "OPENBLAS_NUM_THREADS"
"""Sums of the linear algebra library differ in the last bit with its number of threads: one everywhere."""


@dataclass(frozen=True)
class EvaluationSettings:
    """How runs are evaluated: options and limit set."""

    options: Options = field(default_factory=Options)
    limit_set: LimitSet = field(default_factory=shipped_limit_set)

    @cached_property
    def content(self) -> dict[str, Any]:
        """Everything that changes a figure or a verdict of a run, as JSON holds it."""
        inspections = [inspection.record() for inspection in self.options.inspections]
        plain = {f.name: getattr(self.options, f.name) for f in fields(self.options)}
        return {**plain, "inspections": inspections, "limit_set": self.limit_set.sha256}

    @cached_property
    def sha256(self) -> str:
        """Hash of the content."""
        return content_hash(self.content)


def settings_entry(content: Mapping[str, Any], named: Sequence[str]) -> dict[str, Any]:
    """Return ``settings`` of the evaluation document: everything that changes a figure, a verdict or a
    statement, and the hash of it.

    Parameters
    ----------
    content : mapping
        :attr:`EvaluationSettings.content`, or ``settings`` of a document.
    named : sequence of str
        Ids of the runs that the user named as conformity tests. They change no figure of any run, so that the
        cache does not hang on them; but purposes and statements do. Without any the hash is that of
        :class:`EvaluationSettings`.
    """
    whole = {key: value for key, value in content.items() if key not in ("sha256", "conformity")}
    if named:
        whole["conformity"] = sorted(named)
    return {"sha256": content_hash(whole), **whole}


@dataclass(frozen=True)
class Software:
    """The code that evaluates: its version, the hash of its source, and the libraries that compute."""

    version: str
    code_sha256: str
    python: str
    libraries: tuple[tuple[str, str], ...]

    @cached_property
    def sha256(self) -> str:
        """Hash of all of it."""
        return content_hash(asdict(self))

    @property
    def text(self) -> str:
        """Version and the first digits of the code's hash, as tables state it: ``0.1.0+0f3a52c9d1b7``."""
        return f"{self.version}+{self.code_sha256[:12]}"

    def difference(self, other: Software) -> str:
        """Return in what another one differs, in words; nothing where it is the same."""
        parts = []
        if self.version != other.version or self.code_sha256 != other.code_sha256:
            parts.append(f"bufferstand {other.text} instead of {self.text}")
        if self.python != other.python:
            parts.append(f"Python {other.python} instead of {self.python}")
        mine, its = dict(self.libraries), dict(other.libraries)
        parts += [f"{n} {its.get(n, 'missing')} instead of {v}" for n, v in mine.items() if its.get(n) != v]
        return ", ".join(parts)


@cache
def software() -> Software:
    """Return what this process evaluates with."""
    return Software(
        version=metadata.version("bufferstand"),
        code_sha256=_code_hash(),
        python=".".join(platform.python_version_tuple()[:2]),
        libraries=tuple((name, metadata.version(name)) for name in LIBRARIES),
    )


def _code_hash() -> str:
    """Return the hash of the source and the shipped limit sets, whatever version they call themselves."""
    digest = hashlib.sha256()
    for room in ROOMS:
        spec = find_spec(f"bufferstand.{room}")
        assert spec is not None
        assert spec.origin is not None
        folder = Path(spec.origin).parent
        for path in sorted(p for p in folder.rglob("*") if p.suffix in (".py", ".toml")):
            place = f"{room}/{path.relative_to(folder).as_posix()}"
            if not place.startswith(_NOT_OF_FIGURES):
                digest.update(f"{place}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


@dataclass(frozen=True)
class EvaluatingProcess:
    """A process that evaluates: its software, its processor's vector instructions, its threads."""

    software: Software
    vector_instructions: tuple[str, ...]
    one_thread: bool


def place() -> EvaluatingProcess:
    """Return the facts of this process on which the last bit hangs."""
    flags: set[str] = set()
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith(("flags", "Features")):
                flags.update(line.partition(":")[2].split())
                break
    except OSError:
        pass  # nothing is known of the processor then; its architecture is
    known = tuple(sorted(flags & {"avx", "avx2", "fma", "avx512f", "asimd", "sve"}))
    return EvaluatingProcess(software(), (platform.machine(), *known), os.environ.get(THREADS) == "1")
