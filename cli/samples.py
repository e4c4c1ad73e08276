"""Where the shipped samples are: beside the packages in a checkout, inside ``cli`` in an installed wheel."""

from __future__ import annotations

from pathlib import Path

from bufferstand.foundation import BadInput


def sample(name: str) -> Path:
    """Return the path of a shipped sample, e.g. ``demo.toml``.

    Raises
    ------
    BadInput
        If this installation has no samples.
    """
    here = Path(__file__).resolve().parent
    for folder in (here.parent / "sample_runs", here / "sample_runs"):
        if (path := folder / name).exists():
            return path
    raise BadInput(
        f"this installation has no sample {name}", remedy="install bufferstand from a checkout or its wheel"
    )
