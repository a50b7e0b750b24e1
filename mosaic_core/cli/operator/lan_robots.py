"""Lists the robots of this network: those that announce themselves, and those that this machine is paired with."""

from __future__ import annotations

import asyncio
from typing import Any

from mosaic_core.adapters.lan.robot_search import announced_robots
from mosaic_core.cli.terminal.rich_table import show
from mosaic_core.operator.lan.paired_robots import PairedRobots

SEARCH_S = 2.0


def list_lan_robots(*, as_json: bool) -> None:
    """``mosaic operator robots --lan``; raises :class:`MosaicError`."""
    paired = {one.robot_id: one for one in PairedRobots().all()}
    found = asyncio.run(announced_robots(SEARCH_S))
    lines: list[dict[str, Any]] = [
        {"name": one.name, "id": one.robot_id, "urls": one.urls, "announced": True,
         "asksForPin": one.robot_id not in paired, "version": one.version, "fingerprint": one.fingerprint}
        for one in found
    ]  # fmt: skip
    away = paired.keys() - {one.robot_id for one in found}
    lines += [
        {"name": paired[one].name, "id": one, "urls": (paired[one].url,), "announced": False, "asksForPin": False}
        for one in sorted(away, key=lambda one: paired[one].name)
    ]
    rows = [(one["name"], one["id"], "  ".join(one["urls"]), _state(one)) for one in lines]
    empty = "no robot announces itself here; does it run with `mosaic run --serve`, in this network?"
    show(("name", "id", "address", "state"), rows, lines, as_json=as_json, empty=empty, whole=("name", "id"))


def _state(line: dict[str, Any]) -> str:
    if line["asksForPin"]:
        return "asks for a PIN"
    return "paired" if line["announced"] else "paired, not announced now"
