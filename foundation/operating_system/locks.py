"""A lock on an open file, which goes with the process that holds it, however that ends."""

from __future__ import annotations

import os
import sys

_LOCKED_AT = 1 << 20
"""Windows locks bytes, and nobody else can read those: one that lies far behind what the file holds."""

if sys.platform == "win32":
    import msvcrt

    def is_lock_taken(handle: int, *, shared: bool = False) -> bool:  # noqa: ARG001 - exclusive ones only
        """Lock a file until it is closed, if nobody else has; return whether it was taken.

        Parameters
        ----------
        handle : int
            Descriptor of the open file; opened for writing on Windows.
        shared : bool
            Whether others may hold a shared lock, too; on Windows every lock is an exclusive one.
        """
        try:
            os.lseek(handle, _LOCKED_AT, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            os.lseek(handle, 0, os.SEEK_SET)
        except OSError:
            return False
        return True

else:
    import fcntl

    def is_lock_taken(handle: int, *, shared: bool = False) -> bool:
        """Lock a file until it is closed, if nobody else has; return whether it was taken.

        Parameters
        ----------
        handle : int
            Descriptor of the open file; opened for writing on Windows.
        shared : bool
            Whether others may hold a shared lock, too; on Windows every lock is an exclusive one.

        Raises
        ------
        OSError
            If the file system knows no locks.
        """
        try:
            fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
