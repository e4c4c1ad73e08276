"""Thousands of runs evaluated again: only what changed, on all cores or on a cluster, to the last bit.

Start with :func:`bufferstand.evaluation.archive.evaluate.evaluate_archive`; docs/archives.md and
docs/cluster.md.
"""
