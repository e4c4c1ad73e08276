"""``bufferstand model``: the spring's computational model."""

from __future__ import annotations

import click

from bufferstand.cli.lazy import LazyGroup

COMMANDS = {
    "fit": "Identify a model from recorded runs, with intervals, and say what the runs do not tell.",
    "families": "Which kind of spring it is: eight families on the same runs, and the run that tells them.",
    "next": "Which step to run next: what each admissible one would tell, for a minute of stand time.",
    "simulate": "Force, heat and temperature over a stroke history: a table and a picture.",
    "compare": "A model against measured runs: damping, end force, temperature, residuals, pictures.",
    "twin": "Which cycles lie outside a fitted model's band, and what has moved: spring, zero, sensor.",
    "specimens": "How fitted models of several specimens vary: mean and spread, new against used.",
    "train": "Vehicles with springs of their own models run into each other: forces, speeds, energies.",
    "export": "Hand a model on to multibody tools.",
    "paper": "The paper's figures from simulated runs, and a table of differences.",
}


@click.group(
    "model",
    cls=LazyGroup,
    modules={name: f"bufferstand.cli.commands.model.{name}" for name in COMMANDS},
    summaries=COMMANDS,
    epilog="Example:  bufferstand model fit campaign/runs --out spring.toml",
)
def command() -> None:
    """The spring's computational model: from recorded runs to force, heat and temperature."""
