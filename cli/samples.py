"""Where the shipped samples are: beside the packages in a checkout, inside ``cli`` in an installed wheel."""

from __future__ import annotations

import shutil
from pathlib import Path

from bufferstand.foundation import BadInput


def copy_samples(folder: Path) -> list[Path]:
    """Copy all samples into a folder, which is made where it is not there; return what was written.

    Raises
    ------
    BadInput
        If a file of that name is there, or the folder cannot be written.
    """
    source = sample("README.md").parent
    files = [path.relative_to(source) for path in sorted(source.rglob("*")) if path.is_file()]
    written = [folder / file for file in files]
    if there := next((path for path in written if path.exists()), None):
        raise BadInput(
            "there is a file already", file=there, remedy="name another folder; nothing was copied"
        )
    try:
        for file, path in zip(files, written, strict=True):
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / file, path)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror}", file=error.filename or folder) from None
    return written


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
