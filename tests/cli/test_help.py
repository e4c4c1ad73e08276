"""--help answers at once: no command imports what it works with before it works."""

from __future__ import annotations

import subprocess
import sys

import pytest

from bufferstand.cli.commands.model.group import COMMANDS as MODEL_COMMANDS
from bufferstand.cli.main import COMMANDS

HEAVY = ("numpy", "scipy", "pandas", "h5py", "matplotlib", "pydantic", "pymodbus", "numba", "rich", "jinja2")
EVERY = [*COMMANDS, *(f"model {name}" for name in MODEL_COMMANDS)]
ASK = """
import sys
from bufferstand.cli.main import main
for command in sys.argv[1:]:
    try:
        main([*command.split(), "--help"])
    except SystemExit as end:
        assert end.code == 0, command
    print("LOADED", command, *sorted(name for name in {heavy!r} if name in sys.modules))
"""


@pytest.fixture(scope="module")
def answers() -> dict[str, str]:
    """Return what was loaded when each command, one after the other in one process, had shown its help."""
    asked = subprocess.run(
        [sys.executable, "-P", "-c", ASK.format(heavy=HEAVY), "", *EVERY],
        capture_output=True,
        text=True,
        check=True,
    )
    lines = [line.split(" ", 1)[1] for line in asked.stdout.splitlines() if line.startswith("LOADED")]
    return dict(zip(["", *EVERY], lines, strict=True))


@pytest.mark.parametrize("command", ["", *EVERY])
def test_help_loads_nothing_heavy(answers: dict[str, str], command: str) -> None:
    assert answers[command].strip() == command
