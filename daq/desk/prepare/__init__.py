"""Preparing a campaign: the form made from its JSON Schema, the file's text beside it, and the plan."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.desk.prepare.edits import (
        add_step,
        changed,
        without_step,
    )
    from bufferstand.daq.desk.prepare.fields import (
        Field,
        Group,
        groups_of,
        value_of,
    )
    from bufferstand.daq.desk.prepare.order import (
        moved_step,
    )
    from bufferstand.daq.desk.prepare.pages import (
        Prepare,
    )
    from bufferstand.daq.desk.prepare.planned_steps import (
        plan_view,
    )

__all__ = [
    "Field",
    "Group",
    "Prepare",
    "add_step",
    "changed",
    "groups_of",
    "moved_step",
    "plan_view",
    "value_of",
    "without_step",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
