"""Makes the standard data sets of ``bufferstand validate`` from closed forms, without the evaluation's code.

``python -m tests.validation.making`` writes them anew into ``evaluation/validation/sets``.
"""
