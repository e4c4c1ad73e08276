"""What the lock files pin: names, versions, where they are for, and the hashes of what may be installed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
RUN, ALL = "requirements-run.lock", "requirements.lock"
_HEAD = re.compile(r"(?P<name>[A-Za-z0-9_.-]+)==(?P<version>[^ ;\\]+)(?: *; *(?P<marker>[^\\]+))?")
_HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})")


@dataclass(frozen=True)
class Pin:
    """A package of a lock file.

    Parameters
    ----------
    name, version : str
    marker : str
        On which systems it is installed; empty for all.
    sha256 : tuple of str
        Of the distribution files that may be installed.
    """

    name: str
    version: str
    marker: str
    sha256: tuple[str, ...]

    @property
    def purl(self) -> str:
        """Return its package URL."""
        return f"pkg:pypi/{self.name}@{self.version}"


def pins(lock: Path) -> list[Pin]:
    """Return what a lock file pins, in its order.

    Raises
    ------
    ValueError
        If a line is not what such a file has.
    """
    found = []
    for entry in re.sub(r"\\\n\s*", " ", lock.read_text(encoding="utf-8")).splitlines():
        if not entry.strip() or entry.startswith("#"):
            continue
        head = _HEAD.match(entry)
        hashes = tuple(_HASH.findall(entry))
        if head is None or not hashes:
            raise ValueError(f"{lock.name}: neither a package with its hashes nor a comment: {entry[:80]}")
        marker = (head["marker"] or "").partition("--hash")[0].strip()
        found.append(Pin(head["name"], head["version"], marker, hashes))
    return found
