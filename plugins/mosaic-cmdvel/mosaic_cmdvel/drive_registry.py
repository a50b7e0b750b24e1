"""Finds drives through the entry-point group ``mosaic.drives``: listed without importing, loaded when used."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from mosaic_cmdvel.drive import Drive

GROUP = "mosaic.drives"


class DriveNotFound(ValueError):
    """The wanted drive type can't be used; the text names the culprit and the cure."""


@cache
def installed_drives() -> tuple[EntryPoint, ...]:
    """One entry per drive type and distribution, by name; looked up once in a process, as that reads a file of every
    distribution."""
    found = {(entry.name, _distribution(entry), entry.value): entry for entry in entry_points(group=GROUP)}
    return tuple(found[key] for key in sorted(found))


def load_drive(drive_type: str, installed: Iterable[EntryPoint] | None = None) -> type[Drive[Any]]:
    """The class behind ``drive_type``. Raises :class:`DriveNotFound`: unknown, claimed twice, or broken."""
    entries = tuple(installed_drives() if installed is None else installed)
    claims = [entry for entry in entries if entry.name == drive_type]
    if not claims:
        raise DriveNotFound(_unknown(drive_type, sorted({entry.name for entry in entries})))
    if len(claims) > 1:
        claimants = " and ".join(sorted(_distribution(entry) for entry in claims))
        raise DriveNotFound(f"drive type '{drive_type}' is claimed by {claimants}; uninstall one of them")
    return _loaded(claims[0])


def _loaded(entry: EntryPoint) -> type[Drive[Any]]:
    try:
        drive = entry.load()
    except Exception as error:  # a stranger's import may fail in any way
        cause = f"{type(error).__name__}: {error}"
        raise DriveNotFound(f"drive type '{entry.name}' of {_distribution(entry)} can't be loaded: {cause}") from error
    if not (isinstance(drive, type) and issubclass(drive, Drive)):
        raise DriveNotFound(
            f"drive type '{entry.name}' of {_distribution(entry)}: {entry.value} is no mosaic_cmdvel.Drive"
        )
    return drive


def _unknown(drive_type: str, names: list[str]) -> str:
    near = difflib.get_close_matches(drive_type, names, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ";"
    return f"no drive type '{drive_type}'{hint} Installed: {', '.join(names) or 'none'}"


def _distribution(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value
