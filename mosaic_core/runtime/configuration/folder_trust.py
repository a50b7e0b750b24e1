"""Tells whether a folder of code could have been written by others than the author of the file that uses it."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

MANY_FILES = 10_000
"""A link to a whole disk would be looked at for minutes."""


def doubt_about(folder: Path, config: Path) -> str:
    """Why code in ``folder`` may be another user's than the author's of ``config``; empty if nothing speaks for that.

    Everything in it counts, as the code may import it. Users and groups are POSIX's; elsewhere nothing is known.
    """
    if os.name != "posix":
        return ""
    trusted = {0, os.geteuid(), *([config.stat().st_uid] if config.exists() else [])}
    for number, path in enumerate(_everything_in(folder)):
        if number == MANY_FILES:
            return f"{folder} leads to more than {MANY_FILES} files, too many to look at each"
        if not path.exists():  # a link to nothing
            continue
        status = path.stat()
        if status.st_uid not in trusted:
            return f"{path} belongs to another user than {config.name}"
        if status.st_mode & stat.S_IWOTH or (status.st_mode & stat.S_IWGRP and not _is_owners_own_group(status)):
            return f"{path} can be written by other users than its owner (chmod go-w)"
    return ""


def _everything_in(folder: Path) -> Iterator[Path]:
    """It and all below it, also where a link leads, each folder once."""
    yield folder
    seen: set[str] = set()
    for place, folders, files in os.walk(folder, followlinks=True):
        yield from (Path(place, name) for name in sorted((*folders, *files)))
        seen.add(os.path.realpath(place))
        folders[:] = sorted(name for name in folders if os.path.realpath(Path(place, name)) not in seen)


def _is_owners_own_group(status: os.stat_result) -> bool:
    """Whether nobody but the file's owner is in its group, which many systems make for each user."""
    import grp
    import pwd

    try:
        members = {pwd.getpwnam(name).pw_uid for name in grp.getgrgid(status.st_gid).gr_mem}
    except KeyError:  # a group or member that this machine doesn't know
        return False
    members |= {user.pw_uid for user in pwd.getpwall() if user.pw_gid == status.st_gid}
    return members <= {0, status.st_uid}
