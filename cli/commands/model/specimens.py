"""``bufferstand model specimens``: how do specimens of one kind vary, do used ones differ?"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bufferstand.cli.options import EXISTING, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import BadInput, ExitStatus

if TYPE_CHECKING:
    from bufferstand.model import SpringModel
    from bufferstand.model.specimens import Between, FigureSpread

SCHEMA = "bufferstand/model-specimens/1"


@click.command("specimens", epilog="Example:  bufferstand model specimens a.toml b.toml c.toml")
@click.argument("model_files", metavar="MODEL.toml...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "--used",
    "used_files",
    metavar="MODEL.toml",
    multiple=True,
    type=EXISTING,
    help="A model of a second group, as of used specimens; three or more of them.",
)
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write every figure as JSON; - is standard output."
)
def command(model_files: tuple[Path, ...], used_files: tuple[Path, ...], json_file: str | None) -> int:
    """Say how fitted models of several specimens vary: mean and spread of every figure.

    Each model must be of model fit, from one specimen's runs, with its uncertainties ([fit]): the spread is
    what is left beyond them (docs/specimens.md).
    """
    from bufferstand.model.specimens import compare_specimens

    for files, what in ((model_files, "MODEL.toml"), (used_files, "--used")):
        if len(files) < 3 and (files or what == "MODEL.toml"):
            raise BadInput(
                f"{len(files)} specimens do not tell how specimens vary",
                file=what,
                remedy="give three models or more",
            )
    found = compare_specimens([_loaded(file) for file in model_files], [_loaded(file) for file in used_files])
    if json_file is not None:
        write_json({"schema": SCHEMA, "figures": [_entry(one) for one in found]}, json_file)
    if json_file != "-":
        _show(found)
    return ExitStatus.DONE


def _loaded(file: Path) -> SpringModel:
    from bufferstand.model import load_model

    model = load_model(file)
    try:
        _ = model.stated_fit
    except BadInput as error:
        raise error.of_file(file) from None
    return model


def _show(found: tuple[FigureSpread, ...]) -> None:
    second = any(one.second is not None for one in found)
    columns = [
        ("figure", "whole"),
        ("mean", "right"),
        ("95 %", "right"),
        ("spread", "right"),
        ("95 %", "right"),
    ]
    columns += [("next", "right"), ("own %", "right")]
    if second:
        columns += [("used", "right"), ("difference", "right"), ("95 %", "right"), ("told apart", "whole")]
    rows = []
    for one in found:
        row = [f"{one.name} {one.unit}".strip(), *_cells(one, one.first)]
        if one.second is not None and one.difference is not None:
            low, high = one.difference.interval
            row += [
                _value(one, one.second.mean),
                _change(one, one.difference.value),
                f"{_change(one, low)} … {_change(one, high)}",
                "yes" if one.difference.distinguished else "no",
            ]
        rows.append(row)
    show_table(columns, rows, title="Specimens: mean, and spread beyond what their fits do not know")


def _cells(one: FigureSpread, group: Between) -> list[str]:
    low, high = group.interval
    near, far = group.next_interval
    narrow, wide = group.spread_interval
    return [
        _value(one, group.mean),
        f"{_value(one, low)} … {_value(one, high)}",
        _size(one, group.spread),
        f"{_size(one, narrow)} … {_size(one, wide)}",
        f"{_value(one, near)} … {_value(one, far)}",
        f"{100.0 * group.own_share:.0f}",
    ]


def _value(one: FigureSpread, value: float) -> str:
    return f"{math.exp(value) if one.relative else value:.4g}"


def _size(one: FigureSpread, value: float) -> str:
    return f"{100.0 * value:.2g} %" if one.relative else f"{value:.2g}"


def _change(one: FigureSpread, value: float) -> str:
    return f"{100.0 * math.expm1(value):+.2g} %" if one.relative else f"{value:+.2g}"


def _entry(one: FigureSpread) -> dict[str, Any]:
    difference = one.difference
    return {
        "name": one.name,
        "unit": one.unit,
        "logarithm": one.relative,
        "group": _group(one.first),
        "used": None if one.second is None else _group(one.second),
        "difference": None
        if difference is None
        else {
            "value": difference.value,
            "standard_uncertainty": difference.standard_uncertainty,
            "interval_95": list(difference.interval),
            "distinguished": difference.distinguished,
        },
    }


def _group(group: Between) -> dict[str, Any]:
    return {
        "specimens": group.specimens,
        "mean": group.mean,
        "standard_uncertainty": group.standard_uncertainty,
        "interval_95": list(group.interval),
        "spread": group.spread,
        "spread_interval_95": list(group.spread_interval),
        "next_95": list(group.next_interval),
        "own_share": group.own_share,
    }
