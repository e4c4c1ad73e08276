"""Checks of the wiring: signals of one motion compared with each other and with the plan.

Each check is a pure function from a :class:`bufferstand.evaluation.plausibility.Look` to findings, in its own
module. What is found joins the findings of the run (:mod:`bufferstand.evaluation.plausibility`) and has their
effects.
"""
