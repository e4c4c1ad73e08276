"""Groups of commands whose modules are imported only when called, so that --help answers at once."""

from __future__ import annotations

import difflib
import importlib
import keyword
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import click

from bufferstand.foundation.operating_system import need_linux


def module_name(command: str) -> str:
    """Return the name of the module that holds a command: ``simulate-stand`` is in ``simulate_stand``."""
    stem = command.replace("-", "_")
    return f"{stem}_" if keyword.iskeyword(stem) else stem


class LazyGroup(click.Group):
    """A group whose sub-commands are imported when called; each module holds its ``command``.

    Parameters
    ----------
    modules : mapping
        Name → module.
    summaries : mapping
        Name → what it does, in the order in which they are listed.
    sections : mapping, optional
        Title → names, for a list in parts; names that no part has come last.
    of_stand : collection of str, optional
        Those that work a stand, and so need Linux.
    """

    def __init__(
        self,
        *args: Any,
        modules: Mapping[str, str],
        summaries: Mapping[str, str],
        sections: Mapping[str, Sequence[str]] | None = None,
        of_stand: Collection[str] = (),
        **options: Any,
    ) -> None:
        super().__init__(*args, **options)
        self._modules = dict(modules)
        self._summaries = dict(summaries)
        self._sections = dict(sections or {})
        self._of_stand = frozenset(of_stand)

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names in their own order, not of the alphabet."""
        return list(self._summaries)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:  # noqa: ARG002
        """Return the sub-command, imported now; None if there is none of that name.

        Raises
        ------
        BadInput
            If it needs Linux, and this is another system.
        """
        if name not in self._modules:
            return None
        if name in self._of_stand:
            need_linux(name)
        command = importlib.import_module(self._modules[name]).command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the sub-command; for an unknown one name the nearest that there is."""
        near = difflib.get_close_matches(args[0], self._summaries, n=1)
        if near and args[0] not in self._summaries:
            ctx.fail(f"there is no command “{args[0]}”; did you mean “{near[0]}”?")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the list of commands, part by part, without importing any."""
        named = {name for names in self._sections.values() for name in names}
        rest = [name for name in self._summaries if name not in named]
        for title, names in [*self._sections.items(), ("More" if named else "Commands", rest)]:
            if names:
                with formatter.section(title):
                    formatter.write_dl([(name, self._summaries[name]) for name in names])
