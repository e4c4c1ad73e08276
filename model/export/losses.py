"""What an export cannot express of the model: written into every export and into the docs."""

from __future__ import annotations

FMU = (
    "Co-Simulation without the stroke rate is one step late: the force is that of the step's beginning.",
    "Model Exchange: temperature, heat and work change only when the solver completes a step.",
    "Model Exchange: a reversal inside a step is seen only if the solver locates the rate's zero.",
    "Curves and alpha are fixed; another spring is another FMU.",
)
"""Of the FMU."""

C_SOURCE = (
    "Nothing of the model is lost: same step, same tables. Curves and alpha are fixed in the header.",
    "No check of the numbers that a caller writes into the law: negative ones give nonsense.",
)
"""Of the C header."""

TABLES = (
    "The temperature does not follow the heat: each table holds at its one temperature.",
    "No memory: how an element crosses from one curve to the other is its own law; here is how far it goes.",
    "No rate: the viscous branch and the flat spectrum are left out; the curves are those of a slow stroke.",
    "Beyond the last stroke there is no stop; its stiffness is stated only.",
    "Points between the given strokes are the reading tool's own interpolation.",
)
"""Of the CSV and JSON tables."""

FANCHER = (
    "The temperature does not follow the heat: the table holds at its one temperature.",
    "No rate: the viscous branch and the flat spectrum are left out.",
    "Envelopes and beta vary with the stroke; an element of one beta a direction needs a choice from them.",
    "Fancher's step is exact for small strokes only: beside beta a step must be short.",
)
"""Of the table in Fancher's form."""

MULTIBODY = (
    "The temperature does not follow the heat: each table holds at its one temperature.",
    "No memory: neither has a table element that crosses from one curve to the other; that is the user's.",
    "No rate: the viscous branch and the flat spectrum are left out; the curves are those of a slow stroke.",
    "Between the given strokes the curves are straight; a preload rises within 0.1 mm before contact.",
)
"""Of the tables for Modelica and MBDyn."""
