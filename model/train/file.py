"""The train file (TOML): springs by name, and rows of equal vehicles in the order of the track."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import (
    LENGTH_MM,
    TEMPERATURE_C,
    Settings,
    Within,
    demand_named,
    load_settings,
    place_of,
    read_text,
)
from bufferstand.model.file import load_model
from bufferstand.model.spring import SpringModel
from bufferstand.model.train.scene import Gap, Springs, Train, Vehicle

MASS_T = Within(0.1, 10_000.0, "a trolley has 100 kg, and no vehicle 10 000 t")
SPEED_KM_H = Within(-360.0, 360.0, "no vehicle runs onto its buffers at 100 m/s")
DURATION_S = Within(1e-3, 3600.0, "a train is at peace again within an hour")
STEP_S = Within(1e-6, 5e-3, "an impact onto the stops lasts some milliseconds")
COUNT = Within(1, 500, "no train has more vehicles")
ABREAST = Within(1, 2, "a vehicle has a buffer in the middle, or one at each side")
MOST_STEPS = 20_000_000
"""Steps of all gaps together: a quarter of an hour and more of computing."""


class TrainHead(Settings):
    """``[train]``: what is watched, and how."""

    name: str = Field(min_length=1)
    """The case, for people."""
    temperature_C: Annotated[float, TEMPERATURE_C] = 20.0
    """Of all springs and of the air at the beginning [°C]."""
    duration_s: Annotated[float, DURATION_S]
    """How long it is watched [s]."""
    step_s: Annotated[float, STEP_S] = 0.0005
    """Step of the integration [s]."""


class SpringTable(Settings):
    """``[spring.NAME]``: a spring that vehicles name."""

    model: str = Field(min_length=1)
    """Path of its model file, from the folder of this file."""


class VehicleRow(Settings):
    """``[[vehicle]]``: equal vehicles in a row, from the left; positive speeds run to the right."""

    name: str = Field(min_length=1)
    """What they are called; of several, a number is added."""
    count: Annotated[int, COUNT] = 1
    """How many."""
    mass_t: Annotated[float, MASS_T]
    """Mass of each [t]."""
    speed_km_h: Annotated[float, SPEED_KM_H]
    """Speed of each at the beginning [km/h]."""
    buffer: str
    """Spring of its buffers, one of those above."""
    buffers_abreast: Annotated[int, ABREAST] = 2
    """Buffers beside each other at an end: two at the sides, or one in the middle."""
    draw_gear: str | None = None
    """Spring of its draw gear; without it the vehicle cannot be coupled."""
    coupled: bool | None = None
    """Whether the first of the row is coupled to the vehicle before; by default if both have a draw gear."""
    gap_mm: Annotated[float, LENGTH_MM] = 0.0
    """Between the first's buffers and those of the vehicle before it [mm]; within a row they touch."""
    play_mm: Annotated[float, LENGTH_MM] = 0.0
    """How far its couplings open before they pull [mm]: to the vehicle before, and within the row."""


class TrainFile(Settings):
    """A whole train file."""

    format: Literal["bufferstand/train"]
    """Kind of file."""
    format_version: Literal[1]
    """Version of this schema."""
    train: TrainHead
    spring: dict[str, SpringTable] = Field(min_length=1)
    """The springs by name."""
    vehicle: Annotated[list[VehicleRow], Field(min_length=1, max_length=500)]
    """Rows of vehicles, from the left."""


def load_train(path: str | Path) -> Train:
    """Read a train file and the model files that it names.

    Raises
    ------
    BadInput
        If a file cannot be read or breaks its schema, a spring is not there, or what is to be coupled has no
        draw gear; also if there is but one vehicle, or too much to compute.
    """
    path = Path(path)
    content = load_settings(path, TrainFile)
    models = {}
    for name, table in content.spring.items():
        file = demand_named(path.parent / table.model, path, ("spring", name, "model"))
        models[name] = load_model(file)
    rows, vehicles, gaps = content.vehicle, [], []
    for position, row in enumerate(rows):
        before = rows[position - 1] if position else None
        for number in range(row.count):
            label = row.name if row.count == 1 else f"{row.name} {number + 1}"
            vehicles.append(Vehicle(label, row.mass_t, row.speed_km_h / 3.6))
            other = before if number == 0 else row
            if other is not None:
                gaps.append(_gap(other, row, position, number == 0, models, path))
    if len(vehicles) < 2:
        raise _wrong(path, ("vehicle",), "one vehicle has nobody to meet", "give two or more")
    head = content.train
    if head.duration_s < head.step_s:
        raise _wrong(path, ("train", "duration_s"), "it is shorter than one step", "give a shorter step_s")
    if (steps := head.duration_s / head.step_s * len(gaps)) > MOST_STEPS:
        raise _wrong(
            path,
            ("train", "duration_s"),
            f"{len(gaps)} gaps over {head.duration_s:g} s at {head.step_s:g} s are {steps:.3g} steps",
            f"give fewer vehicles, a shorter time or a longer step_s: at most {MOST_STEPS:.0e} steps in all",
        )
    return Train(head.name, tuple(vehicles), tuple(gaps), head.temperature_C, head.duration_s, head.step_s)


def _gap(
    before: VehicleRow,
    row: VehicleRow,
    position: int,
    first: bool,
    models: dict[str, SpringModel],
    path: Path,
) -> Gap:
    """Return what is between a vehicle of a row and the one before it, which may be of the row before."""
    at = position - 1 if first else position

    def of(name: str, where: int, key: str) -> SpringModel:
        if name not in models:
            known = ", ".join(models)
            raise _wrong(
                path, ("vehicle", where, key), f"there is no spring “{name}”", f"give one of {known}"
            )
        return models[name]

    if before.buffers_abreast != row.buffers_abreast:
        raise _wrong(
            path,
            ("vehicle", position, "buffers_abreast"),
            "buffers in the middle do not meet those at the sides",
            "give both vehicles the same buffers_abreast",
        )
    push = Springs(of(before.buffer, at, "buffer"), of(row.buffer, position, "buffer"), row.buffers_abreast)
    coupled = row.coupled if first else None
    both = before.draw_gear is not None and row.draw_gear is not None
    if coupled and not both:
        raise _wrong(
            path,
            ("vehicle", position, "coupled"),
            "it is to be coupled to the vehicle before it, and one of them has no draw gear",
            "give both a draw_gear, or leave coupled out",
        )
    pull = None
    if before.draw_gear is not None and row.draw_gear is not None and coupled is not False:
        left, right = of(before.draw_gear, at, "draw_gear"), of(row.draw_gear, position, "draw_gear")
        pull = Springs(left, right, 1)
    return Gap(push, pull, row.gap_mm if first else 0.0, row.play_mm)


def _wrong(path: Path, key: tuple[str | int, ...], problem: str, remedy: str) -> BadInput:
    return BadInput(problem, file=path, place=place_of(key, read_text(path)), remedy=remedy)
