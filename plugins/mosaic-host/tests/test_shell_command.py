"""Programs that an operator may run: nothing else runs, nothing is read into arguments, and nothing is left over."""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.absence import thirty_seconds

from mosaic_core.contract.handler import Refused
from mosaic_core.contract.host import Sender
from mosaic_core.contract.request_handler import Request
from mosaic_core.testing import Answered, ask, build, connector, fake_host, joined
from mosaic_core.words.errors import ConfigError
from mosaic_host.commands.output import KeptOutput
from mosaic_host.commands.shell_command import ShellCommand, ShellCommandConfigurer

TELL = "import json, os, sys; print(json.dumps([sys.argv[1:], dict(os.environ), os.getcwd()]))"
WORDS = {"word": {"pattern": ".+"}, "count": {"min": -1, "max": 5, "type": "integer"}, "speed": {"min": 0, "max": 1}}


def python(code: str, *words: str, **more: Any) -> dict[str, Any]:
    return {"argv": [sys.executable, "-IS", "-c", code, *words], **more}


def handler(**params: Any) -> ShellCommand[Any]:
    return build(ShellCommandConfigurer, params=params)


def run(command: dict[str, Any], arguments: dict[str, Any] | None = None, **params: Any) -> Answered:
    made = handler(commands={"it": command}, **params)
    return ask(made, {"command": "it", "arguments": arguments or {}})


def test_arguments_stay_single_words_whatever_is_in_them() -> None:
    told = python(TELL, "{word}", "--count={count}", "{speed}", arguments=WORDS)
    evil = "a b; $(touch x) `id` > /tmp/x | * {count} \" '"
    done = run(told, {"word": evil, "count": -1, "speed": 0.25}).answer
    assert done["exit_code"] == 0
    assert json.loads(done["output"])[0] == [evil, "--count=-1", "0.25"]


def test_nothing_of_the_robots_environment_gets_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MOSAIC_TOKEN", "secret")
    done = run(python(TELL), folder=str(tmp_path), environment={"ROS_DOMAIN_ID": "7"}).answer
    _, environment, folder = json.loads(done["output"])
    assert set(environment) <= {"PATH", "LANG", "ROS_DOMAIN_ID", "LC_CTYPE"}
    assert folder == str(tmp_path)


def test_no_open_file_of_the_robot_gets_there(tmp_path: Path) -> None:
    code = "import os; print(sorted(map(int, os.listdir('/proc/self/fd'))))"
    with (tmp_path / "secret").open("w") as file:
        os.set_inheritable(file.fileno(), True)
        done = run(python(code)).answer
    assert json.loads(done["output"]) == [0, 1, 2, 3]  # 3: the folder that it lists


@pytest.mark.parametrize(
    "arguments",
    [
        {}, {"word": "-rf", "count": 1, "speed": 0}, {"word": "", "count": 1, "speed": 0},
        {"word": "a\nb", "count": 1, "speed": 0}, {"word": "a\0b", "count": 1, "speed": 0},
        {"word": "x" * 65, "count": 1, "speed": 0}, {"word": "a", "count": 6, "speed": 0},
        {"word": "a", "count": 1.5, "speed": 0}, {"word": "a", "count": 1, "speed": 2},
        {"word": "a", "count": 1, "speed": 0, "more": "x"}, {"word": 3, "count": 1, "speed": 0},
    ],
)  # fmt: skip
def test_an_argument_that_does_not_fit_runs_nothing(arguments: dict[str, Any], tmp_path: Path) -> None:
    ran = tmp_path / "ran"
    told = python(f"open({str(ran)!r}, 'w')", "{word}", "{count}", "{speed}", arguments=WORDS)
    refused = run(told, arguments).refused
    assert refused is not None
    assert refused.code == "channel.invalid"
    assert not ran.exists()


@given(st.text(max_size=80))
def test_only_what_matches_as_a_whole_is_taken(text: str) -> None:
    made = handler(commands={"it": {"argv": ["/bin/echo", "{a}"], "arguments": {"a": {"pattern": "[a-z]+|[0-9]+"}}}})
    runnable = made._known["it"]
    fits = text.isascii() and 0 < len(text) <= 64 and (text.isdigit() or (text.isalpha() and text.islower()))
    if fits:
        assert runnable.words({"a": text}) == ["/bin/echo", text]
    else:
        with pytest.raises(Refused):
            runnable.words({"a": text})


@pytest.mark.parametrize("question", [{"command": "other"}, {"command": ["/bin/true"]}, b"\xff", {}])
def test_only_commands_of_the_file_are_known(question: Any) -> None:
    refused = ask(handler(commands={"it": python("")}), question).refused
    assert refused is not None
    assert refused.code == "channel.invalid"


def test_exit_code_and_both_pipes_are_answered() -> None:
    done = run(python("import sys; print('out', flush=True); sys.stderr.write('err'); sys.exit(3)")).answer
    assert (done["exit_code"], done["is_cut"]) == (3, False)
    assert sorted(done["output"].split()) == ["err", "out"]


def test_of_a_flood_the_end_is_kept() -> None:
    done = run(python("print('x' * 3000000 + 'end')"), max_output_bytes=256).answer
    assert done["output"].endswith("end\n")
    assert len(done["output"]) == 256
    assert (done["output_bytes"], done["is_cut"]) == (3_000_004, True)


def test_a_program_that_is_not_there_is_refused() -> None:
    refused = run({"argv": ["/no/such/program"]}).refused
    assert refused is not None
    assert refused.code == "plugin.no_device"


def test_a_program_that_is_away_for_thirty_seconds_is_refused_and_run_again_when_it_is_back(tmp_path: Path) -> None:
    """As one on a disk that is mounted late."""
    program = tmp_path / "tool"
    made = handler(commands={"it": {"argv": [str(program)]}})
    clock = fake_host(made).clock
    for there in (True, *(False for _ in thirty_seconds(clock)), True):
        if there:
            program.write_text("#!/bin/sh\necho there\n")
            program.chmod(0o755)
        else:
            program.unlink(missing_ok=True)
        asked = ask(made, {"command": "it"})
        assert (asked.refused is None) is there
        assert not there or asked.answer["output"] == "there\n"


def test_bytes_that_are_no_text_are_answered_as_text() -> None:
    done = run(python("import sys; sys.stdout.buffer.write(b'\\xff\\x00\\xfeok')")).answer
    assert done["output"].endswith("ok")
    assert done["output_bytes"] == 5
    json.dumps(done, allow_nan=False).encode()


SPAWN = """
import os, signal, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = os.fork()
if child == 0:
    time.sleep(600)
print(os.getpid(), child, flush=True)
time.sleep(600)
"""


class Watched(Request):
    """A request that remembers what it was told, and is cancelled as soon as ``word`` occurs in it."""

    def __init__(self, word: str | None = None) -> None:
        self.told: list[Any] = []
        self.word = word
        super().__init__(Sender("p", "s"), self.hear)

    def hear(self, value: Any) -> None:
        self.told.append(value)
        if self.word is not None and self.word in value["output"]:
            self.cancel()


def answered_for_real(made: ShellCommand[Any], request: Request, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(made, "monotonic_s", time.monotonic)
    question: Any = type(made).__orig_bases__[0].__args__[0](command="it")  # type: ignore[attr-defined]
    return made.answer(question, request)


def are_gone(pids: list[int]) -> bool:
    """Whether none of them runs; one that is dead and not yet collected by its new parent counts as gone."""
    deadline_s = time.monotonic() + 5
    while time.monotonic() < deadline_s:
        if not any(is_alive(pid) for pid in pids):
            return True
        threading.Event().wait(0.01)
    return False


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_cancelling_ends_the_whole_group_even_if_it_does_not_want_to(monkeypatch: pytest.MonkeyPatch) -> None:
    request = Watched("\n")
    answered_for_real(handler(commands={"it": python(SPAWN, timeout_s=60)}), request, monkeypatch)
    pids = [int(pid) for pid in request.told[0]["output"].split()]
    assert len(pids) == 2
    assert are_gone(pids)


def test_a_program_that_takes_too_long_is_ended_and_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    code = f"import os, time; open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid())); time.sleep(600)"
    with pytest.raises(Refused, match=r"ended after 0\.5 s") as refused:
        answered_for_real(handler(commands={"it": python(code, timeout_s=0.5)}), Watched(), monkeypatch)
    assert refused.value.code == "request.timeout"
    assert are_gone([int((tmp_path / "pid").read_text())])


def test_closing_its_output_saves_no_program_from_the_time_out(monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import os, time; os.close(1); os.close(2); time.sleep(600)"
    with pytest.raises(Refused, match="ended after"):
        answered_for_real(handler(commands={"it": python(code, timeout_s=0.5)}), Watched(), monkeypatch)


def test_whoever_is_left_behind_in_the_background_ends_too(monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import os, time\npid = os.fork()\nif pid == 0: time.sleep(600)\nprint(pid, flush=True)"
    done = answered_for_real(handler(commands={"it": python(code)}), Watched(), monkeypatch)
    assert done.exit_code == 0
    assert are_gone([int(done.output)])


def test_needs_say_who_may() -> None:
    command = {"it": python("")}
    asked = {"command": "it"}
    assert handler(commands=command).requires_lease
    assert not handler(commands=command, needs="operator").requires_lease
    owners = handler(commands=command, needs="supervisor")
    refused = ask(owners, asked).refused
    assert refused is not None
    assert refused.code == "lease.forbidden"
    assert ask(owners, asked, sender=Sender("p", "s", role="supervisor")).answer["exit_code"] == 0


async def test_an_operator_of_a_whole_robot_runs_a_program() -> None:
    params = {"needs": "operator", "commands": {"it": python("print('hello')")}}
    async with joined(connector(ShellCommandConfigurer, label="programs", params=params)) as link:
        done = await link.connection.request("programs", {"command": "it"})
    assert done["output"] == "hello\n"


@given(st.lists(st.binary(max_size=20)), st.integers(1, 30))
def test_the_end_of_an_output_is_kept(pieces: list[bytes], max_bytes: int) -> None:
    kept, whole = KeptOutput(max_bytes), b"".join(pieces)
    for piece in pieces:
        kept.add(piece)
    assert kept.text() == whole[-max_bytes:].decode(errors="replace")
    assert (kept.total_bytes, kept.is_cut) == (len(whole), len(whole) > max_bytes)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ({"argv": ["systemctl"]}, "whole path"), ({"argv": ["/bin/sh", "-c", "x"]}, "is a shell"),
        ({"argv": ["/usr/bin/env", "bash"]}, "is a shell"),
        ({"argv": ["/bin/{a}"], "arguments": {"a": {"pattern": "x"}}}, "whole"),
        ({"argv": ["/bin/echo", "{a}"]}, "must stand both"),
        ({"argv": ["/bin/echo"], "arguments": {"a": {"pattern": "x"}}}, "must stand both"),
        ({"argv": ["/bin/echo", "{a}"], "arguments": {"a": {}}}, "what is allowed"),
        ({"argv": ["/bin/echo", "{a}"], "arguments": {"a": {"pattern": "x", "min": 0, "max": 1}}}, "what is allowed"),
        ({"argv": ["/bin/echo", "{a}"], "arguments": {"a": {"min": 0}}}, "what is allowed"),
        ({"argv": ["/bin/echo", "{a}"], "arguments": {"a": {"min": 2, "max": 1}}}, "greater than max"),
        ({"argv": ["/bin/echo", "{a}"], "arguments": {"a": {"pattern": "(["}}}, "no regular expression"),
        ({"argv": ["/bin/echo", "{a}"], "arguments": {"a": {"pattern": "a)|(b"}}}, "no regular expression"),
        ({"argv": ["/bin/echo"], "environment": {"A": "b"}}, "environment"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused_at_once(command: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        handler(commands={"it": command})
