"""The golden table of the original connector types, and what described robots become: Python reads it as written."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.words.described import DescribedConnector, described_catalogue
from mosaic_core.words.original_types import ORIGINAL_DRIVES, ORIGINAL_TYPES, DriveCommand

ROOT = Path(__file__).parents[2]
GOLDEN = json.loads((Path(__file__).parent / "original_types.json").read_text())
WIDGETS = ROOT / "dashboard" / "packages" / "widgets" / "src" / "widgets.ts"


def test_the_types_are_the_golden_ones_in_their_order() -> None:
    assert [entry.wire() for entry in ORIGINAL_TYPES.values()] == GOLDEN["types"]
    assert [drive.wire() for drive in ORIGINAL_DRIVES.values()] == GOLDEN["drives"]


@pytest.mark.parametrize("case", [pytest.param(case, id=case["name"]) for case in GOLDEN["described"]])
def test_what_was_written_down_becomes_the_golden_entries(case: dict[str, Any]) -> None:
    catalogue = described_catalogue(DescribedConnector.model_validate(row) for row in case["connectors"])
    assert [entry.wire() for entry in catalogue.entries] == case["entries"]


def test_every_widget_of_the_table_is_one_that_the_dashboard_has() -> None:
    known = set(re.findall(r"^    id: '([a-z-]+)'", WIDGETS.read_text(), re.MULTILINE))
    hints = {entry.widget for entry in ORIGINAL_TYPES.values() if entry.widget is not None}
    assert hints <= known


def number_at(command: dict[str, Any], path: str) -> Any:
    *parents, last = path.split(".")
    for parent in parents:
        command = command[parent]
    return command[last]


@pytest.mark.parametrize("drive", ORIGINAL_DRIVES.values(), ids=ORIGINAL_DRIVES)
def test_the_zero_of_a_drive_has_a_nought_at_each_of_its_paths(drive: DriveCommand) -> None:
    paths = [drive.ahead, drive.left, *([drive.sideways] if drive.sideways else [])]
    assert [number_at(drive.zero, path) for path in paths] == [0] * len(paths)
