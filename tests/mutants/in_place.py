"""Put a mutant in the place of code that is imported already: by the code of its functions.

A change inside a function needs no new import: every function of the file that is alive gets its new code.
One of what is run at import (constants, defaults, classes, decorators) needs one.
"""

from __future__ import annotations

import gc
import inspect
from types import CodeType, FunctionType

Key = tuple[str, int]


def _is_function(code: CodeType) -> bool:
    """Return whether code is that of a function, not of a class, a module, or a comprehension."""
    return (bool(code.co_flags & inspect.CO_OPTIMIZED) and not code.co_name.startswith("<")) or (
        code.co_name == "<lambda>"
    )


def run_at_import(code: CodeType) -> tuple[object, ...]:
    """Return what is run of code when it is imported, to be compared: all but the bodies of functions."""
    constants = tuple(
        (const.co_qualname if _is_function(const) else run_at_import(const))
        if isinstance(const, CodeType)
        else (type(const), repr(const))
        for const in code.co_consts
    )
    return code.co_code, code.co_names, code.co_varnames, constants


def functions(code: CodeType) -> dict[Key, CodeType] | None:
    """Return the code of every function by name and line, None where two cannot be told apart."""
    found: dict[Key, CodeType] = {}
    for const in code.co_consts:
        if isinstance(const, CodeType):
            inner = functions(const)
            own = {(const.co_qualname, const.co_firstlineno): const} if _is_function(const) else {}
            if inner is None or (found.keys() | own.keys()) & inner.keys() or found.keys() & own.keys():
                return None
            found |= own | inner
    return found


class InPlace:
    """The functions of a file that are alive in this process.

    Parameters
    ----------
    file : str
        The file, as its code names it.
    source : str
        What is in it.
    """

    def __init__(self, file: str, source: str) -> None:
        self._file = file
        self._import = run_at_import(compile(source, file, "exec", dont_inherit=True))
        self._alive = [
            one
            for one in gc.get_objects()
            if isinstance(one, FunctionType) and one.__code__.co_filename == file
        ]

    def put(self, source: str, *, try_only: bool = False) -> bool:
        """Give every function its code of another source.

        Parameters
        ----------
        try_only : bool
            Whether nothing is changed.

        Returns
        -------
        bool
            Whether that is all that the sources differ in; if not, nothing is changed.
        """
        code = compile(source, self._file, "exec", dont_inherit=True)
        new = functions(code)
        if new is None or run_at_import(code) != self._import:
            return False
        pairs = [
            (one, new.get((one.__code__.co_qualname, one.__code__.co_firstlineno))) for one in self._alive
        ]
        if any(other is None or one.__code__.co_freevars != other.co_freevars for one, other in pairs):
            return False
        if not try_only:
            for one, other in pairs:
                assert other is not None
                one.__code__ = other
        return True
