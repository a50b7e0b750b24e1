"""The journal, as a stand-in for journalctl writes its bytes, and as the real one does."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.absence import thirty_seconds

from mosaic_core.messages import Log
from mosaic_core.testing import build, collect, fake_host
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_host.logs import journal_tail
from mosaic_host.logs.journal_entry import log_of
from mosaic_host.logs.journal_tail import JournalTail, JournalTailConfigurer
from mosaic_host.running_program import RunningProgram

ENTRY = (
    b'{"__CURSOR":"s=1;i=2","__REALTIME_TIMESTAMP":"1764000000123456","__MONOTONIC_TIMESTAMP":"5","_BOOT_ID":"b1",'
    b'"PRIORITY":"4","SYSLOG_IDENTIFIER":"sshd","_PID":"812","_SYSTEMD_UNIT":"ssh.service","_UID":"0",'
    b'"MESSAGE":"Connection closed"}\n'
)
Install = Callable[[str], None]


@pytest.fixture
def journalctl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Puts a program of this name where programs are looked for; it writes down its arguments and itself."""
    monkeypatch.setattr(journal_tail, "SEARCH_PATH", str(tmp_path))

    def install(body: str) -> None:
        note = f"open({str(tmp_path / 'seen')!r}, 'w').write(json.dumps([sys.argv, os.getpid(), dict(os.environ)]))"
        program = tmp_path / "journalctl"
        program.write_text(
            f"#!{sys.executable} -IS\nimport json, os, sys, time\n{note}\nout = sys.stdout.buffer\n{body}\n"
        )
        program.chmod(0o755)

    return install


def says(data: bytes, then: str = "time.sleep(60)") -> str:
    return f"out.write({data!r}); out.flush()\n{then}"


def tail(**params: Any) -> JournalTail:
    return build(JournalTailConfigurer, params={"units": ["ssh.service"], **params})


def seen(tmp_path: Path) -> Any:
    return json.loads((tmp_path / "seen").read_text())


def test_an_entry_is_a_message_and_the_child_ends_with_the_body(
    journalctl: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MOSAIC_TOKEN", "secret")
    journalctl(says(ENTRY))
    (message,) = collect(tail(units=["ssh.service", "mosaic.service"], level="warn"), 1)
    assert message.model_dump() == {
        "level": "warn", "message": "Connection closed", "name": "ssh.service", "timestamp": 1764000000123456,
    }  # fmt: skip
    argv, pid, environment = seen(tmp_path)
    assert argv[1:] == [
        "--output=json", "--follow", "--lines=0", "--no-pager", "--quiet", "--priority=warning", "--unit=ssh.service",
        "--unit=mosaic.service",
    ]  # fmt: skip
    assert "MOSAIC_TOKEN" not in environment
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_garbage_is_refused_and_counted_and_the_next_entry_arrives(journalctl: Install) -> None:
    garbage = b'\xff\xfe\n[1]\n{\n{"MESSAGE":null}\n{"MESSAGE":[300]}\n{}\n' + b"x" * 50_000 + b"\n"
    journalctl(says(garbage + ENTRY))
    handler = tail()
    collect(handler, 1)
    assert fake_host(handler).losses == {"refused": 7}


def test_a_flood_is_thinned_and_counted(journalctl: Install) -> None:
    journalctl(says(ENTRY * 2000, "sys.exit(0)"))
    handler = tail(max_rate_hz=8)
    sent: list[Log] = []
    with pytest.raises(DeviceGone):
        sent.extend(handler.messages())
    losses = fake_host(handler).losses["thinned"]
    assert losses >= 1990


def test_a_journal_that_is_away_for_thirty_seconds_is_gone_with_its_reason_and_read_again(journalctl: Install) -> None:
    handler = tail()
    journalctl("sys.stderr.write('No journal files were opened\\n'); sys.exit(1)")
    for _ in thirty_seconds(fake_host(handler).clock):
        with pytest.raises(DeviceGone, match=r"journalctl ended \(1\): No journal files were opened"):
            collect(handler, 1)
    journalctl(says(ENTRY, "sys.exit(0)"))
    fake_host(handler).arm()
    with closing(handler.messages()) as messages:
        assert next(messages).name == "ssh.service"
        with pytest.raises(DeviceGone, match="told no reason"):
            next(messages)


def test_complaints_without_end_stop_nobody(journalctl: Install) -> None:
    journalctl("sys.stderr.write('x' * 1000000); sys.stderr.flush()\n" + says(ENTRY))
    collect(tail(), 1)


def test_without_journalctl_the_cure_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(journal_tail, "SEARCH_PATH", str(tmp_path))
    with pytest.raises(DeviceGone, match="comes with systemd"):
        collect(tail(), 1)


def test_the_real_one_takes_these_arguments() -> None:
    program = shutil.which(journal_tail.PROGRAM)
    if program is None:
        pytest.skip("no journalctl on this machine")
    once = [one for one in tail().params.arguments if one != "--follow"]
    said = b""
    with RunningProgram([program, *once, "--directory=/nowhere/at/all"]) as child:
        while not (looked := child.look()).is_over:
            said += looked.error
    assert b"option" not in said


@pytest.mark.parametrize(
    ("message", "text"),
    [
        ("[104,105]", "hi"), ("[255,104]", "�h"), ('"\\u001b[31mred\\u001b[0m"', "red"), ('["one","two"]', "one"),
        ("[[104,105],[106]]", "hi"), ('""', ""),
    ],
)  # fmt: skip
def test_a_message_of_the_journal_has_many_forms(message: str, text: str) -> None:
    assert log_of(f'{{"MESSAGE":{message}}}'.encode()).message == text


@pytest.mark.parametrize(
    ("priority", "level"), [("0", "fatal"), ("3", "error"), ("6", "info"), ("7", "debug"), ("9", "info")]
)
def test_priorities_of_syslog_are_levels(priority: str, level: str) -> None:
    assert log_of(f'{{"MESSAGE":"x","PRIORITY":"{priority}"}}'.encode()).level == level


VALUES = st.recursive(
    st.none() | st.text(max_size=5) | st.integers(), lambda one: st.lists(one, max_size=3), max_leaves=6
)
KEYS = st.sampled_from(["MESSAGE", "PRIORITY", "_SYSTEMD_UNIT", "__REALTIME_TIMESTAMP", "UNIT"])


@given(st.dictionaries(KEYS, VALUES))
def test_whatever_an_entry_holds_it_is_a_message_or_refused(entry: dict[str, Any]) -> None:
    line = json.dumps(entry).encode()
    if isinstance(entry.get("MESSAGE"), str):
        assert log_of(line).level
    else:
        with suppress(ValueError):
            assert log_of(line).message is not None


@pytest.mark.parametrize("units", [[], ["*"], ["--file=/etc/shadow"], ["a b"], ["ssh.service\n"]])
def test_only_names_of_units_are_taken(units: list[str]) -> None:
    with pytest.raises(ConfigError):
        build(JournalTailConfigurer, params={"units": units})
