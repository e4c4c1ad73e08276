"""Measurements of speed. Every file here is one benchmark, and states its goals and sizes as ``BENCHMARK``.

    python -m benchmarks [NAME …] [--smoke]

What they share lies in ``common``. Only ratios of what was measured in the same run mean anything.
"""
