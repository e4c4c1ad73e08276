"""What can be chosen at the export, on its own: options name it before anything heavy is imported."""

from __future__ import annotations

from typing import Literal

Units = Literal["SI", "mm-kN"]
Positive = Literal["loading", "compression", "tension"]
