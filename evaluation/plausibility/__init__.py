"""Plausibility of each channel and of the set of cycles: what on record no specimen and no motion make.

Each detector is a pure function from a :class:`Look` to findings, in a module of its own;
:data:`DETECTORS` lists them.
"""
