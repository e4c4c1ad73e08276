"""Steps of a run: groups of cycles that belong together, each with a summary of its own.

What makes the figures of a step is in :mod:`bufferstand.evaluation.steps.sum_up`; it is slow to import, and
documents and archives do without.
"""
