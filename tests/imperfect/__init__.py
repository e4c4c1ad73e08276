"""Imperfect records with known truth, made from the documents by somebody who had not read the code.

`world` makes record NUMBER, `judge` compares its evaluation with the truth, `study` does it many times.
`python -m tests.imperfect NUMBER --out DIR` writes one record for a look by hand.
"""
