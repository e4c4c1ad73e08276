"""The simulated stand as a process of its own, for ``demo`` and ``run --simulate``."""

from __future__ import annotations
