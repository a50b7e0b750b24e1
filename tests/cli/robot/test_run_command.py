"""`mosaic run` as a process: lines for programs, a table for people, and an end within two seconds."""

from __future__ import annotations

import io
import json
import logging
import os
import pty
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console
from websockets.sync.server import ServerConnection, serve

from mosaic_core.cli.robot.live_table import duration, robot_table, size
from mosaic_core.cli.robot.service_unit import ServiceUnit, unit_text
from mosaic_core.cli.terminal.error_report import REPLACED, USAGE
from mosaic_core.cli.terminal.log_output import JsonLines, LogFormat, LogLevel, set_up_logging
from mosaic_core.runtime.observation.counters import (
    ConnectorSnapshot,
    LeaseSnapshot,
    LoopSnapshot,
    PeerSnapshot,
    RobotSnapshot,
    ServerSnapshot,
    StopSnapshot,
)
from mosaic_core.words.codes import CloseCode

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]


@contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen([*MOSAIC, "run", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=5)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_tells_its_state_as_json_and_ends_at_once_on_a_signal(robot_yaml: Path, number: signal.Signals) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    with running(str(robot_yaml), "--json", "--log-format", "json", "--metrics", address) as process:
        assert process.stdout is not None
        for line in process.stdout:
            snapshot = json.loads(line)
            if snapshot["connectors"]:
                break
        assert snapshot["robot_id"] == "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
        assert snapshot["state"] in ("connecting", "offline")
        assert [row["label"] for row in snapshot["connectors"]] == ["link"]
        with urllib.request.urlopen(f"http://{address}/metrics", timeout=5) as page:
            assert b'mosaic_connector_messages_total{connector="link"} ' in page.read()
        signalled_at_s = time.monotonic()
        process.send_signal(number)
        _, log = process.communicate(timeout=10)
        assert process.returncode == 0
        assert time.monotonic() - signalled_at_s < 2.0
        entries = [json.loads(line) for line in log.splitlines()]
        assert [entry["code"] for entry in entries if "code" in entry] == ["signal.unreachable"]


def test_hints_are_told_once_at_the_start_and_stand_in_every_line_for_programs(robot_yaml: Path) -> None:
    robot_yaml.write_text(robot_yaml.read_text().replace("label: link", "label: Link-1"))
    with running(str(robot_yaml), "--json", "--log-format", "json") as process:
        assert process.stdout is not None
        lines = [json.loads(process.stdout.readline()) for _ in range(2)]
        process.send_signal(signal.SIGTERM)
        _, log = process.communicate(timeout=10)
    said = "the label 'Link-1' is not snake_case"
    assert [[(one["path"], one["message"]) for one in line["hints"]] for line in lines] == [
        [("connectors[0].label", said)]
    ] * 2
    told = [entry for entry in map(json.loads, log.splitlines()) if entry["message"].startswith("hint: ")]
    assert [entry["level"] for entry in told] == ["warning"]
    assert f"{robot_yaml}:6: connectors[0].label: {said}" in told[0]["message"]


def test_mistakes_end_it_before_anything_starts(robot_yaml: Path) -> None:
    robot_yaml.write_text(robot_yaml.read_text().replace("label: link", "lable: link"))
    done = subprocess.run([*MOSAIC, "run", str(robot_yaml)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "unknown key 'lable'" in done.stderr
    assert "did you mean 'label'?" in done.stderr


def test_a_robot_that_was_replaced_ends_by_a_code_that_no_service_starts_again(robot_yaml: Path) -> None:
    def put_off(socket: ServerConnection) -> None:
        socket.close(CloseCode.REPLACED)

    with serve(put_off, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        port = server.socket.getsockname()[1]
        robot_yaml.write_text(robot_yaml.read_text().replace("127.0.0.1:9", f"127.0.0.1:{port}"))
        done = subprocess.run([*MOSAIC, "run", str(robot_yaml)], capture_output=True, text=True, timeout=60)
    assert done.returncode == REPLACED, done.stderr
    assert "code: signal.replaced" in done.stderr
    unit = ServiceUnit("rover", "", (), Path("/"), ("mosaic", "run"), Path("/etc/mosaic"))
    assert f"RestartPreventExitStatus={USAGE} {REPLACED}" in unit_text(unit).splitlines()


def test_on_a_terminal_it_shows_a_table(robot_yaml: Path) -> None:
    ours, theirs = pty.openpty()
    process = subprocess.Popen([*MOSAIC, "run", str(robot_yaml)], stdout=theirs, stderr=theirs, stdin=theirs)
    os.close(theirs)
    shown = b""
    try:
        while b"link" not in shown:
            shown += os.read(ours, 4096)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=10) == 0
    finally:
        process.kill()
        process.wait(timeout=5)
        os.close(ours)
    assert b"ws://127.0.0.1:9" in shown


def snapshot(**changes: object) -> RobotSnapshot:
    row = {
        "label": "front", "type": "camera", "kind": "video", "direction": "to-operator", "delivery": "latest",
        "state": "running", "peers": 2, "messages": 5, "rate_hz": 29.97, "size_bytes": 10, "bytes_per_s": 1.5e6,
        "queue_messages": 3, "queue_bytes": 4500, "replaced": 0, "dropped": 2, "too_large": 0, "thinned": 0, "lost": 0,
        "resent": 0, "refused": 1, "failures": 0, "last_error": "", "age_s": 0.04, **changes,
    }  # fmt: skip
    peer = PeerSnapshot("p", "s", "o", "Alice", "operator", "open", 3.0, (), ())
    servers = (ServerSnapshot("fleet", "wss://example.org", "ready"),)
    rows = (ConnectorSnapshot(**row),)  # type: ignore[arg-type]
    return RobotSnapshot("robot-1", "ready", 75.0, rows, (peer,), servers=servers)


def drawn(shown: RobotSnapshot) -> list[list[str]]:
    console = Console(file=io.StringIO(), width=120)
    console.print(robot_table(shown))
    assert isinstance(console.file, io.StringIO)
    return [line.split() for line in console.file.getvalue().splitlines()]


@pytest.mark.parametrize(("ago_s", "is_shown"), [(3.0, True), (90.0, False)])
def test_whose_code_held_up_the_event_loop_stands_above_the_table_for_a_while(ago_s: float, is_shown: bool) -> None:
    loop = LoopSnapshot({"front": 1}, 0.8, "front", "camera.py:42 in Camera.frames", 0.8, ago_s)
    lines = [" ".join(words) for words in drawn(replace(snapshot(), loop=loop))]
    text = "event loop blocked for 0.8 s by front (camera.py:42 in Camera.frames), 3.0 s ago"
    assert (text in lines) is is_shown


@pytest.mark.parametrize(("code", "state"), [("plugin.no_device", "no device"), ("plugin.failed", "failed")])
def test_what_fails_is_shown_with_why_and_when_it_is_tried_again(code: str, state: str) -> None:
    failing = {"last_error": "no such camera: /dev/video0", "failure_code": code, "tries_again_in_s": 7.2}
    lines = [" ".join(line) for line in drawn(snapshot(state="failed", **failing))]
    assert lines[3].startswith(f"front camera {state} 2")
    assert f"front no such camera: /dev/video0 ({code}), tries again in 8 s" in lines


def test_a_message_with_line_ends_and_orders_to_the_terminal_stays_one_line() -> None:
    failing = {"last_error": "gone\nrow two\x1b[2J", "failure_code": "plugin.no_device", "tries_again_in_s": 7.2}
    lines = [" ".join(line) for line in drawn(snapshot(state="failed", **failing))]
    assert "front gone\\u000arow two\\u001b[2J (plugin.no_device), tries again in 8 s" in lines


def test_the_table_has_a_row_per_connector() -> None:
    assert drawn(snapshot()) == [
        ["server", "wss://example.org", "ready", "up", "1", "min"],
        ["robot", "robot-1", "operators", "Alice"],
        ["connector", "type", "state", "peers", "rate", "data", "queue", "drops", "age", "speed"],
        ["front", "camera", "running", "2", "30.0/s", "1.5", "MB/s", "3", "4.5", "KB", "3", "0.0", "s", "–"],
        ["drops", "front", "2", "full,", "1", "refused"],
    ]


def test_the_table_fits_eighty_columns_with_every_number_in_full() -> None:
    busy = snapshot(
        label="camera_front", peers=12, rate_hz=1234.5, bytes_per_s=123.4e6, queue_messages=512, queue_bytes=999_400,
        replaced=123456, age_s=12.0, limit_factor=1.0,
    )  # fmt: skip
    console = Console(file=io.StringIO(), width=80)
    console.print(robot_table(busy, 80))
    assert isinstance(console.file, io.StringIO)
    lines = console.file.getvalue().splitlines()
    header, row = lines[2:4]
    assert header.split() == ["connector", "state", "peers", "rate", "data", "queue", "drops", "age", "speed"]
    expected = "camera_front running 12 1234.5/s 123.4 MB/s 512 999.4 KB 123459 12 s 100%"
    assert row.split() == expected.split()
    assert lines[4:] == ["drops   camera_front 2 full, 1 refused, 123456 replaced"]


def test_drops_are_told_by_reason_and_what_was_resent_below_the_table() -> None:
    (worst,) = snapshot(label="events", dropped=3, too_large=1, lost=2, thinned=4, replaced=5, resent=6).connectors
    well = replace(worst, label="pose", dropped=0, too_large=0, lost=0, refused=0, thinned=0, replaced=0, resent=0)
    repeated = replace(well, label="chat", resent=9)
    lines = drawn(replace(snapshot(), connectors=(worst, well, repeated, replace(well, label="map", thinned=7))))
    assert [" ".join(line) for line in lines[-2:]] == [
        "drops events 3 full, 1 too large, 2 lost, 1 refused, 4 thinned, 5 replaced · map 7 thinned",
        "resent events 6 · chat 9",
    ]
    assert len(drawn(replace(snapshot(), connectors=(well,)))) == 4


def test_every_line_fits_a_hundred_columns() -> None:
    row = snapshot(label="camera_front_left", lost=123456, replaced=123456, resent=123456, limit_factor=1.0).connectors
    console = Console(file=io.StringIO(), width=100)
    console.print(robot_table(replace(snapshot(), connectors=row * 9), 100))
    assert isinstance(console.file, io.StringIO)
    lines = console.file.getvalue().splitlines()
    assert max(map(len, lines)) <= 100
    assert "…" not in console.file.getvalue()


def test_the_table_tells_who_commands_who_asks_who_watches_and_how_fast() -> None:
    lease = LeaseSnapshot("motion", 7, "p", "Alice", True, ("Bob",))
    watcher = PeerSnapshot("q", "t", "", "Wanda", "observer", "open", 3.0, (), (), is_original=True)
    base = snapshot(limit_factor=0.25)
    lines = drawn(replace(base, leases=(lease,), peers=(*base.peers, watcher)))
    assert lines[1] == ["robot", "robot-1", "motion", "Alice", "asking", "Bob", "watching", "Wanda", "(original)"]
    assert lines[3][-1] == "25%"


def test_the_table_shouts_that_the_robot_is_stopped() -> None:
    line = " ".join(drawn(replace(snapshot(), stop=StopSnapshot("Bob", "a dog", 12.0)))[2])
    assert line == "STOPPED by Bob: a dog, 12 s ago; no command acts until cleared"


@pytest.mark.parametrize(("count", "text"), [(0, "0 B"), (999, "999 B"), (1500, "1.5 KB"), (2e9, "2.0 GB")])
def test_sizes_are_short(count: float, text: str) -> None:
    assert size(count) == text


@pytest.mark.parametrize(("seconds", "text"), [(0.31, "0.3 s"), (42, "42 s"), (240, "4 min"), (7200, "2.0 h")])
def test_durations_are_short(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_json_log_lines_have_the_known_fields_only() -> None:
    record = logging.makeLogRecord(
        {
            "name": "mosaic",
            "levelname": "WARNING",
            "msg": "peer %s",
            "args": ("x",),
            "peerId": "p",
            "robot_id": "r",
            "sdp": "v=0",
        }
    )
    line = json.loads(JsonLines().format(record))
    assert line.pop("time").endswith("+00:00")
    assert line == {"level": "warning", "logger": "mosaic", "message": "peer x", "robotId": "r", "peerId": "p"}


def test_tracebacks_are_in_json_log_lines_too() -> None:
    try:
        raise ValueError("x")
    except ValueError:
        record = logging.makeLogRecord({"msg": "failed", "exc_info": sys.exc_info()})
    assert "ValueError: x" in json.loads(JsonLines().format(record))["traceback"]


@pytest.fixture
def _logging_as_before() -> Iterator[None]:
    names = ("", "aiortc", "aioice", "websockets", "av", "libav", "httpx", "httpcore", "asyncio")
    root = logging.getLogger()
    handlers, levels = root.handlers[:], {name: logging.getLogger(name).level for name in names}
    yield
    root.handlers[:] = handlers
    for name, level in levels.items():
        logging.getLogger(name).setLevel(level)


@pytest.mark.usefixtures("_logging_as_before")
def test_frames_with_tokens_are_logged_at_no_level() -> None:
    set_up_logging(LogLevel.DEBUG)
    assert not logging.getLogger("websockets.client").isEnabledFor(logging.DEBUG)
    assert logging.getLogger("aioice.ice").isEnabledFor(logging.INFO)
    set_up_logging(LogLevel.INFO, LogFormat.JSON)
    assert not logging.getLogger("aioice.ice").isEnabledFor(logging.INFO)


@pytest.mark.usefixtures("_logging_as_before")
def test_log_lines_go_above_the_table() -> None:
    console = Console(file=io.StringIO(), width=40)
    set_up_logging(LogLevel.INFO, console=console)
    logging.getLogger("mosaic").warning("[red]not markup[/red] and a line longer than the terminal is wide")
    assert isinstance(console.file, io.StringIO)
    assert "WARNING [red]not markup[/red] and a line longer" in console.file.getvalue()


@pytest.mark.usefixtures("_logging_as_before")
@pytest.mark.parametrize("log_format", LogFormat)
def test_a_plugin_that_wants_to_see_everything_changes_no_level_of_the_command(
    log_format: LogFormat, capsys: pytest.CaptureFixture[str]
) -> None:
    set_up_logging(LogLevel.INFO, log_format)
    logging.getLogger().setLevel(logging.DEBUG)  # as a plugin does at its import
    logging.getLogger("mosaic_core.runtime").debug("each try")
    logging.getLogger("mosaic_core.runtime").info("once")
    told = capsys.readouterr().err
    assert ("each try" in told, "once" in told) == (False, True)
