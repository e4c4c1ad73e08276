"""Files of the desk's folder that a report can be made with: spring models, and keys that sign."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

MOST = 100
"""So many of a kind are offered; others are typed."""
MODEL_MARK = "bufferstand/spring-model"
KEY_SUFFIXES = ("p12", "pfx")


def model_files(root: Path) -> list[str]:
    """Return the files of spring models in a folder and two below it, from there; blocking."""
    return _named((path for path in toml_files(root) if MODEL_MARK in head_of(path)), root)


def key_files(root: Path) -> list[str]:
    """Return the files of keys (PKCS#12) in a folder and two below it, from there; blocking."""
    return _named((path for suffix in KEY_SUFFIXES for path in _files(root, suffix)), root)


def toml_files(root: Path) -> Iterator[Path]:
    """Give the settings files in a folder and two below it, whatever they state."""
    return _files(root, "toml")


def head_of(path: Path) -> str:
    """Return the beginning of a text file; empty where it is none."""
    try:
        with path.open(encoding="utf-8") as stream:
            return stream.read(20_000)
    except (OSError, UnicodeDecodeError):
        return ""


def _files(root: Path, suffix: str) -> Iterator[Path]:
    for depth in range(3):
        yield from sorted(root.glob(f"{'*/' * depth}*.{suffix}"))


def _named(found: Iterator[Path], root: Path) -> list[str]:
    return sorted(path.relative_to(root).as_posix() for path, _ in zip(found, range(MOST), strict=False))
