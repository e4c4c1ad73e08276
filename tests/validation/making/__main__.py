"""``python -m tests.validation.making``: writes the standard data sets anew."""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.validation.making.every import every_set

SETS = Path(__file__).resolve().parents[3] / "evaluation" / "validation" / "sets"

if __name__ == "__main__":
    shutil.rmtree(SETS, ignore_errors=True)
    for one in every_set():
        one.write(SETS)
