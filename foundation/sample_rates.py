"""The sample rate of records."""

from __future__ import annotations

LOGGER_HZ = (0.001, 1e7)
"""Least and greatest sample rate of a record without time: no logger of a stand is slower or faster [Hz]."""
