"""Which reason code an error of the disk has."""

from __future__ import annotations

import errno

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""No space, no quota, or more than the file system takes in one file."""


def code_of(error: OSError) -> str:
    """``recorder.disk_full`` or ``recorder.write_failed``."""
    return "recorder.disk_full" if error.errno in _FULL else "recorder.write_failed"
