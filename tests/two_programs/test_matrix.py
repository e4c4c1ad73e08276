"""Every pair of commands in every phase: all of the matrix, several stands side by side."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.two_programs.matrix import cells, fill


@pytest.mark.long
def test_no_command_disturbs_another_and_every_end_is_safe(tmp_path: Path) -> None:
    rows = fill(cells(), tmp_path)
    wrong = {str(row.cell): row.wrong for row in rows if row.wrong}
    assert not wrong, f"{len(wrong)} of {len(rows)}: {wrong}"
