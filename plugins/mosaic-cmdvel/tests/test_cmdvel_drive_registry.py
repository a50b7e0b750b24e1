"""Drives are found by entry points, and every way to miss one is told apart."""

from __future__ import annotations

from importlib.metadata import Distribution, EntryPoint
from os import PathLike
from typing import Any

import pytest

from mosaic_cmdvel.drive_registry import DriveNotFound, installed_drives, load_drive
from mosaic_cmdvel.drives.log import LogDrive


class InMemoryDistribution(Distribution):
    def __init__(self, name: str) -> None:
        self._name = name

    def read_text(self, filename: str) -> str | None:
        return f"Metadata-Version: 2.1\nName: {self._name}\nVersion: 1.2.3\n" if filename == "METADATA" else None

    def locate_file(self, path: str | PathLike[str]) -> Any:
        raise NotImplementedError


def entry(name: str, value: str, distribution: str) -> EntryPoint:
    made = EntryPoint(name, value, "mosaic.drives")
    vars(made).update(dist=InMemoryDistribution(distribution))
    return made


LOG = "mosaic_cmdvel.drives.log:LogDrive"


def test_our_own_drives_are_installed() -> None:
    assert {"log", "unicycle", "callback"} <= {found.name for found in installed_drives()}
    assert load_drive("log") is LogDrive


def test_listing_imports_no_drive() -> None:
    broken = [entry("a", "no_such_module:Drive", "a-dist"), entry("log", LOG, "b-dist")]

    assert load_drive("log", broken) is LogDrive


def test_an_unknown_drive_is_told_with_the_nearest_name_and_all_installed() -> None:
    with pytest.raises(DriveNotFound, match=r"no drive type 'lgo'; did you mean 'log'\? Installed: log, sim"):
        load_drive("lgo", [entry("log", LOG, "x"), entry("sim", LOG, "y")])


def test_a_drive_far_from_any_name_is_told_without_a_guess() -> None:
    with pytest.raises(DriveNotFound, match=r"no drive type 'hovercraft'; Installed: none"):
        load_drive("hovercraft", [])


def test_two_distributions_with_one_drive_are_both_named() -> None:
    twice = [entry("log", LOG, "mosaic-cmdvel"), entry("log", LOG, "other-drives")]

    with pytest.raises(DriveNotFound, match=r"claimed by mosaic-cmdvel 1\.2\.3 and other-drives 1\.2\.3; uninstall"):
        load_drive("log", twice)


def test_a_drive_that_cannot_be_imported_names_its_distribution_and_the_cause() -> None:
    with pytest.raises(DriveNotFound, match=r"'bad' of bad-drives 1\.2\.3 can't be loaded: ModuleNotFoundError"):
        load_drive("bad", [entry("bad", "no_such_module:Drive", "bad-drives")])


def test_an_entry_point_that_is_no_drive_is_refused() -> None:
    with pytest.raises(DriveNotFound, match=r"json:loads is no mosaic_cmdvel\.Drive"):
        load_drive("odd", [entry("odd", "json:loads", "odd-drives")])
