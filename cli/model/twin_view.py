"""What the twin says of recorded runs: a table, alarms, and the same as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click
import numpy as np

from bufferstand.cli.terminal_tables import show_table
from bufferstand.model.twin import FAULT_KINDS, CycleJudgement, TwinAlarm, TwinStep

SCHEMA = "bufferstand/model-twin/1"


def show_twin(steps: Sequence[TwinStep]) -> None:
    """Print one row a run: every kind of fault by itself, its mean over the cycles ± U; then the alarms."""
    groups: dict[str, list[CycleJudgement]] = {}
    for step in steps:
        for one in step.judged:
            groups.setdefault(one.cycle.run, []).append(one)
    rows = []
    for run, group in groups.items():
        change = np.mean([one.alone for one in group], axis=0)
        spread = 2.0 * np.mean([np.hypot(one.alone_u, one.alone_noise) for one in group], axis=0)
        rows.append(
            [
                run,
                str(len(group)),
                f"{100.0 * np.mean([one.share_outside for one in group]):.0f}",
                *(
                    f"{kind.factor * value:+.{kind.digits}f} ± {kind.factor * half:.{kind.digits}f}"
                    for kind, value, half in zip(FAULT_KINDS, change, spread, strict=True)
                ),
            ]
        )
    headings = ("stiffness %", "loss %", "F zero kN", "x zero mm", "x gain %", "delay ms")
    show_table(
        [("run", "whole"), ("cycles", "right"), ("outside %", "right"), *((h, "right") for h in headings)],
        rows,
        title="Each kind of fault, were it the only one (± U, k = 2)",
    )
    for alarm in alarms_of(steps):
        click.echo(f"{alarm.run}: {alarm.sentence}")
    if not alarms_of(steps):
        click.echo("no run of cycles lies outside the model's band")


def alarms_of(steps: Sequence[TwinStep]) -> list[TwinAlarm]:
    """Return all alarms, in the order of time."""
    return [alarm for step in steps for alarm in step.alarms]


def twin_document(steps: Sequence[TwinStep]) -> dict[str, Any]:
    """Return what ``model twin --json`` writes."""
    return {
        "schema": SCHEMA,
        "cycles": [_cycle(one) for step in steps for one in step.judged],
        "alarms": [alarm_entry(alarm) for alarm in alarms_of(steps)],
    }


def _cycle(one: CycleJudgement) -> dict[str, Any]:
    cycle = one.cycle
    deviation = np.sqrt(np.diag(one.together_covariance))
    u = np.hypot(one.alone_u, one.alone_noise)
    return {
        "run": cycle.run,
        "start_s": cycle.start_s,
        "end_s": cycle.end_s,
        "temperature_C": cycle.temperature_C,
        "share_outside": one.share_outside,
        "rms_kN": float(np.sqrt(np.mean(cycle.residual_kN**2))),
        "alone": {
            kind.name: {"value": float(value), "standard_uncertainty": float(half)}
            for kind, value, half in zip(FAULT_KINDS, one.alone, u, strict=True)
        },
        "together": {
            kind.name: {"value": float(value), "standard_uncertainty": float(half)}
            for kind, value, half in zip(FAULT_KINDS, one.together, deviation, strict=True)
        },
    }


def alarm_entry(alarm: TwinAlarm) -> dict[str, Any]:
    """Return an alarm as JSON."""
    return {
        "run": alarm.run,
        "since_cycle": alarm.since_cycle,
        "cycle": alarm.cycle,
        "since_s": alarm.since_s,
        "at_s": alarm.at_s,
        "explained": alarm.explained,
        "moved": [
            {
                "name": one.kind.name,
                "value": one.change,
                "standard_uncertainty": one.standard_uncertainty,
                "left_kN": one.left_kN,
            }
            for one in alarm.moved
        ],
        "sentence": alarm.sentence,
    }
