"""The code of the page "Drive from Python" runs, at a robot with a cmd-vel."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path
from typing import Any

import pytest

from mosaic_cmdvel.cmd_vel import CmdVelConfigurer
from mosaic_core.testing import connector, joined

PAGE = Path(__file__).parents[3] / "docs/howto/drive-from-python.md"


def names_of_the_page() -> dict[str, Any]:
    names: dict[str, Any] = {}
    for code in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL):
        exec(compile(code, PAGE.name, "exec"), names)  # noqa: S102 - our own documentation
    return names


async def test_the_page_drives_and_stops_a_robot(capsys: pytest.CaptureFixture[str]) -> None:
    names = names_of_the_page()

    base = connector(CmdVelConfigurer, label="cmd_vel", params={"drive": {"type": "log"}})
    async with asyncio.timeout(30), joined(base, takes_leases=False) as link:
        refused: list[str] = []
        link.connection.on_refusal(lambda refusal: refused.append(refusal.code))
        await names["drive"](link.connection)
        assert refused == []
        (row,) = link.robot.snapshot().connectors
        assert row.messages >= 10  # of twenty; newer ones replace those that a busy machine has not taken yet
        await names["stop"](link.connection)
    assert re.search(r"standing after \d+ ± \d+ ms", capsys.readouterr().out)
