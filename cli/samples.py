"""Where the shipped samples are: beside the packages in a checkout, inside ``cli`` in an installed wheel."""

from __future__ import annotations

import shutil
from pathlib import Path

from bufferstand.foundation import BadInput

LIMIT_SETS = "limit_sets"
"""Where among the samples the shipped limit sets are put, to make sets of one's own from."""


def copy_samples(folder: Path) -> list[Path]:
    """Copy all samples and limit sets into a folder, made where it is not there; return what was written.

    Raises
    ------
    BadInput
        If a file of that name is there, or the folder cannot be written.
    """
    from bufferstand.evaluation.requirements import shipped_files  # noqa: PLC0415 - other commands need it not

    source = sample("README.md").parent
    files = {path: folder / path.relative_to(source) for path in sorted(source.rglob("*")) if path.is_file()}
    files |= {path: folder / LIMIT_SETS / path.name for path in shipped_files()}
    written = list(files.values())
    if there := next((path for path in written if path.exists()), None):
        raise BadInput(
            "there is a file already", file=there, remedy="name another folder; nothing was copied"
        )
    try:
        for original, path in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(original, path)
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
