"""A file that the PDF of a report has inside."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256


@dataclass(frozen=True)
class Attachment:
    """A file inside the PDF (an associated file of PDF/A-3, with relationship “Data”).

    Attributes
    ----------
    name : str
        Name of the file.
    description : str
        What it is, as readers show it beside the name.
    media_type : str
        Such as ``application/json``.
    data : bytes
    """

    name: str
    description: str
    media_type: str
    data: bytes

    @property
    def sha256(self) -> str:
        """Hash of the bytes."""
        return sha256(self.data).hexdigest()
