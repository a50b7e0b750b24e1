"""The doctor reads the source of plugins, and names the lines that would hold up the event loop."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.doctor.code_checks import WAITS, blocking_lines, code_checks
from mosaic_core.testing.pytest_plugin import InstallDistribution

SOURCE = """
import time


class Gauge:
    async def messages(self):
        for tick in self.every(0.1):
            yield tick
        async for tick in self.every(0.1):
            time.sleep(1)
            if self.pause(1):
                return

        def elsewhere():
            time.sleep(1)

    def frames(self):
        for tick in self.every(0.1):
            time.sleep(1)
            yield tick
"""


def test_what_blocks_in_an_async_def_is_found_with_its_line() -> None:
    assert sorted(blocking_lines(SOURCE)) == [
        (7, "for … in every(…)"),
        (10, "time.sleep(…)"),
        (11, "self.pause(…)"),
    ]


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        ("import subprocess as sp", "sp.run(['x'])"),
        ("from subprocess import check_output as out", "out(['x'])"),
        ("import urllib.request", "urllib.request.urlopen('x')"),
        ("import httpx", "httpx.get('x')"),
        ("import requests", "requests.post('x')"),
        ("import socket", "socket.create_connection(('x', 1))"),
        ("import serial", "serial.Serial('x').readline()"),
        ("from time import sleep", "sleep(1)"),
    ],
)
def test_a_call_that_waits_is_found_whatever_it_was_imported_as(lines: str, found: str) -> None:
    ((line, what),) = blocking_lines(f"{lines}\nasync def messages():\n    {found}\n")
    assert line == 3
    assert what.removesuffix("(…)") in WAITS


@pytest.mark.parametrize(
    "line", ["await to_thread(subprocess.run, ['x'])", "await client.get('x')", "self.run()", "sleep(1)", "(f())()"]
)
def test_what_is_awaited_or_nobody_knows_is_left_alone(line: str) -> None:
    assert not [*blocking_lines(f"import subprocess\nfrom .mine import sleep\nasync def messages():\n    {line}\n")]


def read_of(*modules: str, local: Any = None) -> Any:
    installed = SimpleNamespace(local=local)
    made = [SimpleNamespace(configurer=SimpleNamespace(__module__=module), installed=installed) for module in modules]
    return SimpleNamespace(connectors=made)


async def test_a_plugin_is_named_with_file_and_line_and_a_good_one_passes(
    install_distribution: InstallDistribution,
) -> None:
    modules = {"acme_slow": SOURCE, "acme_good": "async def messages(): pass\n"}
    folder = install_distribution("acme-gauges", modules=modules)
    for name in ("acme_slow", "acme_good"):
        importlib.import_module(name)
    findings = [finding async for finding in code_checks(read_of("acme_slow", "acme_good", "mosaic_core.x"))]
    assert [(finding.check, finding.code) for finding in findings] == [
        ("code.acme_good", "check.ok"),
        *[("code.acme_slow", "plugin.blocks_loop")] * 3,
    ]
    assert f"{folder / 'acme_slow.py'}:7" in findings[1].sentence


async def test_a_folder_beside_the_file_is_told_by_its_path_and_not_by_the_name_that_python_knows() -> None:
    local = SimpleNamespace(file=Path("/robot/connectors/lamp.py"))
    (finding,) = [one async for one in code_checks(read_of("local_connectors_ed2f2175.lamp", local=local))]
    assert finding.check == "code.connectors"
    assert finding.sentence == "Nothing in /robot/connectors is seen to block the event loop."


async def test_a_file_without_a_connector_that_can_be_read_is_told() -> None:
    [finding] = [finding async for finding in code_checks(read_of())]
    assert (finding.check, finding.status) == ("code.connectors", "skipped")
