"""What docs/house.md and the how-to pages say is to be done, for the tests that do it."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "house.md"


def files_of(heading: str, name: str = "NAME") -> list[str]:
    """Return the files that the page says are to be touched for a thing of this name, in its order."""
    text = PAGE.read_text(encoding="utf-8")
    found = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    assert found is not None, f"docs/house.md has no heading “{heading}”"
    files = re.findall(r"^\d+\. `([^`]+)`", found[1], re.MULTILINE)
    assert files, f"“{heading}” of docs/house.md names no file"
    return [file.replace("NAME", name) for file in files]


def source_of(heading: str, name: str) -> str:
    """Return the one file of source or settings among them; tests and pages come on top."""
    (source,) = (file for file in files_of(heading, name) if not file.startswith(("tests/", "docs/")))
    return source


def example_of(page: str, language: str) -> str:
    """Return the first example of a how-to page in a language."""
    text = (ROOT / "docs" / "how-to" / page).read_text(encoding="utf-8")
    found = re.search(rf"^( *)```{language}\n(.*?)^ *```", text, re.MULTILINE | re.DOTALL)
    assert found is not None, f"{page} has no example in {language}"
    return re.sub(rf"^{found[1]}", "", found[2], flags=re.MULTILINE)


def package_with(folder: Path, file: str, text: str) -> Path:
    """Make a package like this one that has one more file, and return what to put on the import path.

    Parameters
    ----------
    folder : Path
        Where it is made: the folders that lead to the file are real, all others are links to this one's.
    file : str
        Path of the file from the root of the repository; its folder is there already.
    text : str
    """
    here, theirs = folder / "bufferstand", ROOT / "bufferstand"
    for part in (*Path(file).parent.parts, None):
        here.mkdir(exist_ok=True)
        for entry in theirs.iterdir():
            if entry.name not in (part, "__pycache__"):
                (here / entry.name).symlink_to(entry.resolve())
        if part is not None:
            here, theirs = here / part, theirs / part
    (here / Path(file).name).write_text(text, encoding="utf-8")
    return folder
