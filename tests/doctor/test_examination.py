"""Checks run side by side, none can stop or delay the others, and their report has a stable form."""

from __future__ import annotations

import asyncio
import io
import json
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from platformdirs import user_data_path
from rich.console import Console

from mosaic_core.cli.diagnosis.doctor_examination import json_document, print_report
from mosaic_core.doctor import server_checks
from mosaic_core.doctor.config_checks import config_checks, device_checks, device_finding, read_config
from mosaic_core.doctor.examination import CheckRun, Examined, Progress, examined
from mosaic_core.doctor.install_checks import lockstep
from mosaic_core.doctor.machine_checks import loop_lag_check, machine_checks
from mosaic_core.doctor.plan import Plan, Subject
from mosaic_core.words.codes import REASONS
from mosaic_core.words.finding import Finding, failed, passed, skipped, warned

ROBOT = """\
version: 1
server:
  ws_url: ws://127.0.0.1:9
  auth: { type: no-authorization, robot_id: 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11 }
connectors:
  - { type: connection-check, label: link }
"""


async def good() -> AsyncIterator[Finding]:
    yield passed("a.one", "One.")
    await asyncio.sleep(0)
    yield warned("a.two", "check.no_uvloop")


async def endless() -> AsyncIterator[Finding]:
    yield passed("b.one", "One.")
    await asyncio.Event().wait()


async def broken() -> AsyncIterator[Finding]:
    yield passed("c.one", "One.")
    raise OSError("the cable is gone")


async def collected(checks: AsyncIterator[Finding]) -> list[Finding]:
    return [finding async for finding in checks]


async def test_a_broken_and_an_endless_check_are_findings_and_delay_nobody() -> None:
    runs = [CheckRun("c", broken), CheckRun("b", endless, timeout_s=0.2), CheckRun("a", good)]
    began_s = time.monotonic()
    result = await examined(runs)
    assert [(one.check, one.status) for one in result.findings] == [
        ("c.one", "ok"), ("c.all", "fail"), ("b.one", "ok"), ("b.all", "warn"), ("a.one", "ok"), ("a.two", "warn"),
    ]  # fmt: skip
    assert "the cable is gone" in result.findings[1].sentence
    assert result.has_failed
    assert time.monotonic() - began_s < 5


async def test_heavy_checks_run_one_after_the_other() -> None:
    running, most = 0, 0

    async def heavy() -> AsyncIterator[Finding]:
        nonlocal running, most
        running += 1
        most = max(most, running)
        await asyncio.sleep(0.01)
        running -= 1
        yield passed("h.x", "X.")

    await examined([CheckRun("h", heavy, is_heavy=True) for _ in range(3)])
    assert most == 1


async def test_whoever_looks_sees_findings_come() -> None:
    heard: list[str] = []

    class Listener(Progress):
        def began(self, name: str) -> None:
            heard.append(f"+{name}")

        def found(self, finding: Finding) -> None:
            heard.append(finding.check)

        def ended(self, name: str) -> None:
            heard.append(f"-{name}")

    await examined([CheckRun("a", good)], Listener())
    assert heard == ["+a", "a.one", "a.two", "-a"]


def test_the_json_has_its_keys() -> None:
    result = Examined((passed("a.one", "One.", ms=3), failed("server.tcp", "signal.unreachable")), 1.234)
    document = json.loads(json_document(result))
    assert set(document) == {"version", "ok", "tookS", "findings", "first"}
    assert (document["version"], document["ok"], document["tookS"]) == (1, False, 1.23)
    assert set(document["findings"][0]) == {"check", "status", "code", "sentence", "cure", "facts"}
    assert [one["check"] for one in document["first"]] == ["server.tcp"]


def test_the_report_groups_findings_and_ends_with_what_to_do_first() -> None:
    result = Examined(
        (passed("machine.python", "Python 3."), failed("server.tcp", "signal.unreachable"), skipped("x.y", "Not now.")),
        0.5,
    )
    output = io.StringIO()
    print_report(Console(file=output, width=200, highlight=False, markup=False), result)
    text = output.getvalue()
    assert text.index("This machine") < text.index("Server")
    assert "✗  The server can't be reached." in text
    assert "signal.unreachable" in text
    assert "→ Check the server's address and the network." in text
    assert "1 fine, 0 warnings, 1 failed, 1 skipped" in text
    assert text.index("What to do first") < text.rindex("1. The server can't be reached.")


def test_what_a_stranger_named_begins_no_line_of_the_report() -> None:
    output = io.StringIO()
    finding = failed("config.yaml", "config.invalid", "unknown key 'a\nOK\x1b[2J'.", "Known:\nb.")
    print_report(Console(file=output, width=200, highlight=False, markup=False), Examined((finding,), 0.5))
    assert r"unknown key 'a\u000aOK\u001b[2J'." in output.getvalue()
    assert output.getvalue().count(r"Known:\u000ab.") == 2


async def test_the_machine_is_looked_at_without_failures_of_the_checks_themselves() -> None:
    found = await collected(machine_checks())
    assert {"machine.python", "machine.disk", "machine.udp_buffer", "machine.realtime"} <= {one.check for one in found}
    [lag] = await collected(loop_lag_check())
    assert lag.facts["p95Ms"] >= lag.facts["medianMs"]
    assert all(one.code in REASONS for one in [*found, lag])


@pytest.mark.parametrize(("days", "status"), [(14.1, "ok"), (13.9, "warn"), (0.5, "warn")])
def test_certificates_end_soon_two_weeks_before(days: float, status: str) -> None:
    assert server_checks._term(days, "an authority").status == status


async def test_the_disk_is_that_of_the_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path / "data"))
    [disk] = [one for one in await collected(machine_checks()) if one.check == "machine.disk"]
    assert disk.facts["folder"] == str(tmp_path / "data")
    monkeypatch.delenv("MOSAIC_DATA_DIR")
    [disk] = [one for one in await collected(machine_checks()) if one.check == "machine.disk"]
    assert disk.facts["folder"] == str(user_data_path("mosaic", appauthor=False))


class Installed:
    def __init__(self, name: str, version: str) -> None:
        self.metadata, self.version = {"Name": name}, version


@pytest.mark.parametrize(("camera", "status"), [("0.1.7", "ok"), ("0.2.0", "warn")])
def test_our_distributions_belong_together(camera: str, status: str) -> None:
    others = [Installed("mosaic-core", "0.1.0"), Installed("mosaic-from-somebody-else", "9.9")]
    assert lockstep([*others, Installed("mosaic_camera", camera)]).status == status  # type: ignore[list-item]


async def test_a_mistake_is_told_with_its_line_and_the_server_is_known_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(ROBOT + "  - { type: camra, label: front }\n")
    read = read_config(path)
    [finding] = await collected(config_checks(read))
    assert finding.code == "config.unknown_type"
    assert "robot.yaml:7" in finding.sentence
    assert read.server is not None
    assert read.server.ws_url == "ws://127.0.0.1:9"
    assert [one.config.label for one in read.connectors] == ["link"]


async def test_what_a_connector_refuses_when_it_is_made_is_no_valid_file_either(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(ROBOT + "  - { type: gps-nmea, label: gps, safety: { max_rate_hz: 3 } }\n")
    [finding] = await collected(config_checks(read_config(path)))
    assert finding.status == "fail"
    assert "receives nothing that could be limited" in finding.sentence
    assert "robot.yaml:7" in finding.sentence


async def test_a_file_that_can_not_be_read_is_a_finding(tmp_path: Path) -> None:
    read = read_config(tmp_path / "none.yaml")
    assert read.server is None
    assert [one.code for one in await collected(config_checks(read))] == ["config.unreadable"]
    assert await collected(device_checks(read)) == []


def test_devices_are_there_absent_or_forbidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    port = tmp_path / "ttyX0"
    assert device_finding("base", port).code == "plugin.no_device"
    (tmp_path / "ttyX1").touch()
    assert "ttyX1" in device_finding("base", port).cure
    port.touch()
    assert device_finding("base", port).status == "ok"
    monkeypatch.setattr("os.access", lambda *_: False)
    assert device_finding("base", port).code == "plugin.no_permission"


async def test_only_the_wanted_groups_are_run(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(ROBOT)

    def names(*only: str) -> list[str]:
        return [one.name for one in Plan(Subject(read_config(path), only=frozenset(only))).checks()]

    assert names("config", "machine") == ["config", "machine", "machine", "machine"]
    everything = names()
    assert {"config", "server", "ice", "webrtc", "relay", "video", "device", "camera"} <= set(everything)
