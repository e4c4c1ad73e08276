"""Make the page of commands from their own help: python -m tests.docs.commands_page > docs/commands.md"""

from __future__ import annotations

from collections.abc import Iterator

import click

from bufferstand.cli.lazy import LazyGroup
from bufferstand.cli.main import bufferstand

WIDTH = 110
HEAD = """\
# Commands

Made from the commands' own `--help` by `python -m tests.docs.commands_page`; a test compares it.

Scripts may rely on commands, options and exit statuses: a later version may add some, and renames or drops
none. What `--json` prints stands on standard output with nothing else; progress and logs go to standard
error, without colour or bars where that is no terminal.

| exit status | everywhere |
|---|---|
| 0 | done; of `evaluate`: evaluated, whatever the verdict |
| 1 | the specimen failed; only with `evaluate --strict` |
| 2 | bad input or usage: one message that names file, place, what is wrong and what to do |
| 3 | stopped by a limit or the operator; data kept, stand seen to be safe |
| 4 | a device or wire failed, or no safe state was seen; data kept, the last line says what was seen last |
"""


def commands(group: click.Group, parent: click.Context) -> Iterator[tuple[str, str]]:
    """Yield name and help of every command of a group, and of the groups in it."""
    for name in group.list_commands(parent):
        command = group.get_command(parent, name)
        assert command is not None
        with click.Context(command, info_name=name, parent=parent, max_content_width=WIDTH) as context:
            context.terminal_width = WIDTH
            yield context.command_path, command.get_help(context)
            if isinstance(command, click.Group):
                yield from commands(command, context)


def page() -> str:
    """Return the page."""
    assert isinstance(bufferstand, LazyGroup)
    with click.Context(bufferstand, info_name="bufferstand") as root:
        parts = [
            f"## `{path}`\n\n```text\n{text.rstrip()}\n```\n" for path, text in commands(bufferstand, root)
        ]
    return "\n".join([HEAD, *parts])


if __name__ == "__main__":
    print(page(), end="")
