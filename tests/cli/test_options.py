"""Options take what has a meaning: finite numbers, names that are not empty; what is wrong is said once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from bufferstand.cli.main import bufferstand, main
from bufferstand.cli.options import FiniteFloat, FiniteRange

STAND = Path(__file__).parents[2] / "sample_runs" / "stand.toml"
DEMO = STAND.with_name("demo.toml")
RUNS = STAND.with_name("runs")
MODEL = STAND.with_name("models") / "category-a-elastomer.toml"
SINE = ("--prestress", "20", "--amplitude", "5")


def commands(group: click.Group, *names: str) -> Iterator[tuple[str, click.Command]]:
    """Give every command with its full name."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from commands(command, *names, name)
        else:
            yield " ".join((*names, name)), command


ALL = dict(commands(bufferstand))


@pytest.mark.parametrize("name", ALL)
def test_no_option_takes_a_number_that_is_none(name: str) -> None:
    for parameter in ALL[name].params:
        if isinstance(parameter.type, click.types.FloatParamType | click.FloatRange):
            assert isinstance(parameter.type, FiniteFloat | FiniteRange), parameter.name


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ("stand", "jog", STAND, "--by", "nan"),
            "--by': nan is no finite number (bufferstand stand jog --help)",
        ),
        (("run", DEMO, "--simulate", "--speed", "nan", "--out", "x"), "nan is no finite number"),
        (("simulate-stand", STAND, "--speed", "inf"), "inf"),
        (
            ("run", DEMO, "--simulate", "--out", ""),
            "--out': it is empty; give a name (bufferstand run --help)",
        ),
        (
            ("model", "simulate", MODEL, "--prestress", "1e308", "--amplitude", "1", "--frequency", "1"),
            "x<=1000",
        ),
        (("model", "simulate", MODEL, *SINE, "--frequency", "5e-324"), "0.0001<=x"),
        (("model", "simulate", MODEL, *SINE, "--frequency", "0.0001", "--cycles", "9"), "give at most 2, or"),
        (("model", "simulate", MODEL, *SINE, "--frequency", "1", "--temperature", "1e308"), "x<=200"),
        (("import", DEMO, "--out", "x", "--sample-rate", "1e308"), "x<=10000000"),
        (("evaluate", RUNS, "--moving-mass", "1e308"), "give kilograms, 0 to 10000"),
        (("stand", "read", "nix.toml"), "'nix.toml' does not exist (bufferstand stand read --help)"),
    ],
)
def test_what_has_no_meaning_is_refused_before_anything_is_done(
    words: tuple[object, ...], told: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    assert ended.value.code == 2
    assert told in (said := capfd.readouterr().err)
    assert said.count("\n") == 1
