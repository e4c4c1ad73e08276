"""The laboratory's own template as data: files that put other blocks in the place of shipped ones."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class TemplateFile:
    """A file of an own template."""

    name: str
    data: bytes = field(repr=False)


@dataclass(frozen=True)
class OwnTemplate:
    """An own template.

    Parameters
    ----------
    files : tuple of TemplateFile
        In the order of their names.
    folder : Path
        Where they lie, for messages; what a report says does not depend on it.
    """

    files: tuple[TemplateFile, ...]
    folder: Path = field(metadata={"said": False})

    def text(self, name: str) -> str | None:
        """Return the text of a file, or None where it is not there."""
        return next((one.data.decode("utf-8-sig") for one in self.files if one.name == name), None)

    def pictures(self) -> tuple[TemplateFile, ...]:
        """Return the pictures that its files may show."""
        return tuple(one for one in self.files if not one.name.startswith("report."))
