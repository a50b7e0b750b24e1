"""`mosaic operator` against a real server and a real robot process; and what it says when it can't."""

from __future__ import annotations

import asyncio
import io
import json
import os
import pty
import re
import select
import subprocess
import sys
import time
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, NoReturn, TextIO
from unittest.mock import patch

import pytest

from mosaic_core.cli.main import main
from mosaic_core.cli.operator import operator_session
from mosaic_core.operator import LeaseDenied, MosaicOperator
from mosaic_server.roles import Role
from mosaic_server.storage.accounts import Membership, add_account
from mosaic_server.storage.database import Database
from mosaic_server.storage.grants import Actor, set_role
from mosaic_server.storage.robots import robot_by_id

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main", "operator"]
CONNECTORS = """\
  - { type: host-load, label: host, params: { period_s: 0.1 } }
  - { type: test-pattern, label: front, params: { width: 160, height: 120 } }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: log } } }
  - { type: sim-survey, label: survey }
"""
Run = Callable[..., subprocess.CompletedProcess[str]]


@contextmanager
def keyboard(is_terminal: bool) -> Iterator[TextIO]:
    """Nobody touches it."""
    if not is_terminal:
        yield io.StringIO()
        return
    ours, theirs = pty.openpty()
    try:
        with os.fdopen(theirs) as terminal:
            yield terminal
    finally:
        os.close(ours)


def run(*words: str, is_at_terminal: bool = False, **environ: str) -> subprocess.CompletedProcess[str]:
    """`mosaic operator …` in this process, on a thread of its own, for somebody who has said `environ` and nothing else
    of ours: forty processes would start for a second each."""
    said = {key: value for key, value in os.environ.items() if not key.startswith("MOSAIC_")} | environ
    out, err = io.StringIO(), io.StringIO()

    def ended() -> int:
        with pytest.raises(SystemExit) as caught:
            main(["operator", *words])
        return int(caught.value.code or 0)

    with (
        keyboard(is_at_terminal) as stdin,
        patch.object(sys, "stdin", stdin),
        patch.dict(os.environ, said, clear=True),
        redirect_stdout(out),
        redirect_stderr(err),
        ThreadPoolExecutor(1) as elsewhere,
    ):
        code = elsewhere.submit(ended).result(60)
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


@pytest.fixture
def unsigned(mosaic: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """`mosaic operator …` in this process, in whose environment nobody has said who they are."""
    for name in [name for name in os.environ if name.startswith("MOSAIC_")]:
        monkeypatch.delenv(name)
    return lambda *words: mosaic("operator", *words)


def test_signing_in_needs_an_account_and_a_password(unsigned: Any) -> None:
    ended = unsigned("robots")
    assert ended.code == 2
    assert "--email" in ended.err
    ended = unsigned("robots", "--email", "a@b.c")
    assert ended.code == 2
    assert "MOSAIC_PASSWORD" in ended.err


def test_a_server_that_is_not_there_is_an_error_without_a_traceback(
    unsigned: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MOSAIC_PASSWORD", "x")
    ended = unsigned("robots", "--server", "http://127.0.0.1:9", "--email", "a@b.c")
    assert ended.code == 1
    assert "code: signal.unreachable" in ended.err
    assert "Traceback" not in ended.err


def test_a_question_that_is_no_json_is_told_before_anybody_signs_in(unsigned: Any) -> None:
    ended = unsigned("call", "Test robot", "survey", "{duration_s: 1}", "--code", "x", "--server", "http://127.0.0.1:9")
    assert ended.code == 2
    assert ended.err.startswith("error: a question is JSON, and this is none: ")
    assert ended.err.splitlines()[1:] == ["""  cure: write it in single quotes: '{"n": 1}'"""]


@pytest.fixture(scope="module")
def operator(server: Any, seed: Any, start_robot: Any) -> Run:
    start_robot(CONNECTORS)

    def run_signed_in(*words: str, is_at_terminal: bool = False, **environ: str) -> subprocess.CompletedProcess[str]:
        signed_in = {"MOSAIC_SERVER": server.url, "MOSAIC_EMAIL": seed.email, "MOSAIC_PASSWORD": seed.password}
        return run(*words, is_at_terminal=is_at_terminal, **{**signed_in, **environ})

    return run_signed_in


def add_observer(server: Any, seed: Any, email: str, name: str) -> None:
    """An account beside the seed's, which may only watch its robot."""
    database = Database(server.data_dir)
    try:
        robot = database.work(robot_by_id, seed.robot_id)
        membership = Membership(robot.organization_id)
        person = database.work(add_account, email, seed.password, name, membership=membership)
        database.work(set_role, seed.robot_id, person.id, Role.OBSERVER, Actor("test"))
    finally:
        database.close()


ONE_WAY = "\n  code: channel.wrong_direction\n  cure: Those that do: survey.\n"


@pytest.mark.webrtc
class TestWithARobot:
    def test_robots_are_listed_with_their_connectors(self, operator: Run, seed: Any) -> None:
        robot = json.loads(operator("robots", "--json").stdout)
        assert (robot["id"], robot["name"], robot["isOnline"]) == (seed.robot_id, "Test robot", True)
        assert robot["connectors"] == ["host", "front", "cmd_vel", "survey"]
        assert seed.robot_id in operator("robots").stdout

    def test_a_connector_is_asked_and_answers(self, operator: Run, seed: Any) -> None:
        done = operator("call", "Test robot", "survey", '{"duration_s": 0.3}')
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["looks"] == 3
        assert [json.loads(line)["percent"] for line in done.stderr.splitlines()] == [33.3, 66.7, 100.0]
        line = operator("call", seed.robot_id, "survey", '{"duration_s": 0}', "--json").stdout
        assert json.loads(line)["looks"] == 1
        assert line.count("\n") == 1

    @pytest.mark.parametrize(
        ("label", "question", "says"),
        [
            ("survey", '{"duration_s": 21}', "duration_s"),
            ("survey", '{"duration_s": 21}', "cure: `mosaic operator call 'Test robot' survey --schema` shows"),
            (
                "host",
                "{}",
                "'host' answers no requests.\n  code: channel.wrong_direction\n  cure: Those that do: survey.",
            ),
            (
                "cmd_vel",
                "{}",
                "'cmd_vel' answers no requests.\n  code: channel.wrong_direction\n  cure: Those that do: survey.",
            ),
            ("surwey", "{}", "survey"),
        ],
    )
    def test_what_can_not_be_answered_is_told(self, operator: Run, label: str, question: str, says: str) -> None:
        done = operator("call", "Test robot", label, question)
        assert done.returncode == 1
        assert says in done.stderr
        assert "Traceback" not in done.stderr

    def test_what_may_be_asked_is_shown_and_nothing_is(self, operator: Run) -> None:
        done = operator("call", "Test robot", "survey", "--schema")
        assert done.returncode == 0, done.stderr
        question, answer = done.stdout.partition("\nanswer")[::2]
        assert re.search(r"^duration_s +number ≥ 0, ≤ 20 +3\.0 +s +How long to look\.", question, re.MULTILINE)
        assert re.search(r"^looks +integer", answer, re.MULTILINE)
        schemas = json.loads(operator("call", "Test robot", "survey", "--schema", "--json").stdout)
        assert schemas["label"] == "survey"
        assert "duration_s" in schemas["question"]["properties"]
        assert "looks" in schemas["answer"]["properties"]

    def test_what_answers_nothing_has_no_question_to_show(self, operator: Run) -> None:
        assert operator("call", "Test robot", "host", "--schema").stderr.endswith(f"answers no requests.{ONE_WAY}")

    def test_messages_and_pictures_are_tailed(self, operator: Run, seed: Any) -> None:
        done = operator("tail", "Test robot", "host", "-n", "2")
        assert done.returncode == 0, done.stderr
        assert all("cpu_percent" in json.loads(line) for line in done.stdout.splitlines())
        line = json.loads(operator("tail", seed.robot_id, "host", "-n", "1", "--json").stdout)
        assert line["label"] == "host"
        assert "cpu_percent" in line["data"]
        line = json.loads(operator("tail", seed.robot_id, "front", "-n", "2", "--json").stdout.splitlines()[-1])
        assert (line["width"], line["height"]) == (160, 120)
        assert line["fps"] > 0

    def test_commands_are_sent_and_refusals_told(self, operator: Run, seed: Any) -> None:
        done = operator("send", seed.robot_id, "cmd_vel", '{"linear": {"x": 0.1}}', "--for-s", "0.5")
        assert (done.returncode, done.stdout) == (0, "6 sent, 0 refused\n")
        assert "holding the lease of 'motion'" in done.stderr
        done = operator("send", seed.robot_id, "cmd_vel", '{"linear": {"x": "fast"}}')
        assert (done.returncode, done.stdout) == (1, "1 sent, 1 refused\n")
        assert "refused at the gate envelope: safety.out_of_range: linear.x" in done.stderr

    def test_a_stop_holds_until_it_is_cleared(self, operator: Run, seed: Any) -> None:
        done = operator("stop", seed.robot_id, "--reason", "a test", "--json")
        assert done.returncode == 0, done.stderr
        report = json.loads(done.stdout)
        assert report["is_safe"]
        assert 0 < report["acknowledged_s"] < 5
        done = operator("send", seed.robot_id, "cmd_vel", '{"linear": {"x": 0.1}}')
        assert done.returncode == 1
        assert "refused at the gate stop: safety.stopped" in done.stderr
        assert "stopped by" in operator("lease", seed.robot_id).stdout
        done = operator("clear", seed.robot_id)
        assert (done.returncode, "code: safety.person_clears" in done.stderr) == (1, True), "a script is no person"
        done = operator("clear", seed.robot_id, is_at_terminal=True)
        assert (done.returncode, done.stdout.partition(".")[0].strip()) == (0, "cleared: commands act again"), (
            done.stderr
        )
        done = operator("send", seed.robot_id, "cmd_vel", '{"linear": {"x": 0.1}}')
        assert done.returncode == 0, done.stderr

    async def test_a_supervisor_takes_the_right_to_stop_from_one_observer_and_gives_it_back(
        self, operator: Run, seed: Any, server: Any
    ) -> None:
        add_observer(server, seed, "wanda@example.org", "Wanda")

        async def stop_right(*words: str, **environ: str) -> subprocess.CompletedProcess[str]:
            return await asyncio.to_thread(operator, "stop-right", seed.robot_id, *words, **environ)

        async with await MosaicOperator.login(server.url, "wanda@example.org", seed.password, is_person=True) as wanda:
            watching = await wanda.connect(seed.robot_id, timeout_s=30)
            done = await stop_right("Wanda", MOSAIC_EMAIL="wanda@example.org")
            assert (done.returncode, "code: auth.forbidden" in done.stderr) == (1, True), done.stderr
            done = await stop_right("Walter")
            assert done.returncode == 2
            assert "nobody here is called 'Walter'; connected: " in done.stderr
            assert "Wanda" in done.stderr

            done = await stop_right("Wanda")
            assert (done.returncode, done.stdout) == (0, "Wanda may no longer say stop\n"), done.stderr
            with pytest.raises(LeaseDenied) as denied:
                await watching.control.stop("again")
            assert denied.value.code == "safety.stop_taken"

            assert watching.peer_id is not None
            done = await stop_right(watching.peer_id, "--give-back", "--json")
            assert json.loads(done.stdout) == {"peer_id": watching.peer_id, "may_stop": True}, done.stderr
            assert (await watching.control.stop("now")).is_safe
        assert (await asyncio.to_thread(operator, "clear", seed.robot_id, is_at_terminal=True)).returncode == 0

    def test_the_lease_is_shown_freed_and_misused_in_words(self, operator: Run, seed: Any) -> None:
        lease = json.loads(operator("lease", seed.robot_id, "--json").stdout)
        assert (lease["resource"], lease["holder"]) == ("motion", None)
        done = operator("lease", seed.robot_id, "--release")
        assert done.returncode == 0, done.stderr
        assert "'motion' is free" in done.stdout
        done = operator("lease", seed.robot_id, "--take", "--resource", "arm")
        assert done.returncode == 1
        assert "code: lease.unknown_resource" in done.stderr

    def test_somebody_drives_from_a_terminal_stops_clears_and_leaves(
        self, operator: Run, seed: Any, server: Any
    ) -> None:
        signed_in = {"MOSAIC_SERVER": server.url, "MOSAIC_EMAIL": seed.email, "MOSAIC_PASSWORD": seed.password}
        ours, theirs = pty.openpty()
        process = subprocess.Popen(
            [*MOSAIC, "drive", seed.robot_id, "cmd_vel", "--json"], env={**os.environ, **signed_in},
            stdin=theirs, stdout=theirs, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            shown = ""
            for keys, sign in ((b"w", '"linear_mps": 0.3'), (b"x", "stopped in"), (b"C", '"note": "cleared"')):
                ends_at_s = time.monotonic() + 30
                while sign not in shown and time.monotonic() < ends_at_s:
                    os.write(ours, keys)
                    if select.select([ours], [], [], 0.2)[0]:
                        shown += os.read(ours, 65536).decode(errors="replace")
                assert sign in shown, shown
            os.write(ours, b"q")
            assert process.wait(timeout=20) == 0
        finally:
            process.kill()
            process.wait(timeout=5)
            os.close(ours)
            os.close(theirs)

    def test_driving_needs_a_terminal(self, operator: Run, seed: Any) -> None:
        done = operator("drive", seed.robot_id, "cmd_vel")
        assert done.returncode == 2
        assert "run it on a terminal" in done.stderr

    @pytest.mark.parametrize(
        ("words", "message", "code"),
        [
            (("tail", "Test robot", "hots"), "did you mean 'host'?", "channel.unknown_label"),
            (("tail", "Nobody", "host"), "no robot 'Nobody'", "auth.unknown_robot"),
            (("tail", "Test robot", "cmd_vel"), "sends nothing", "channel.wrong_direction"),
            (("send", "Test robot", "host", "{}"), "takes nothing", "channel.wrong_direction"),
            (("send", "Test robot", "front", "{}"), "takes nothing", "channel.wrong_direction"),
            (("tail", "Test robot", "host", "--data-type", "json-u2r"), "not json-u2r", "channel.wrong_direction"),
        ],
    )
    def test_what_cannot_be_is_told(self, operator: Run, words: tuple[str, ...], message: str, code: str) -> None:
        done = operator(*words)
        assert done.returncode == 1
        assert message in done.stderr
        assert f"code: {code}\n" in done.stderr
        assert "Traceback" not in done.stderr

    def test_a_wrong_password_is_told(self, operator: Run) -> None:
        done = operator("robots", MOSAIC_PASSWORD="wrong")  # noqa: S106
        assert done.returncode == 1
        assert "code: auth.failed" in done.stderr


@pytest.mark.parametrize(("interrupted", "code"), [("", 0), ("no answer had come", 1)])
def test_ctrl_c_ends_a_look_and_cuts_a_question_short(
    interrupted: str, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def ended(work: Coroutine[Any, Any, int]) -> NoReturn:
        work.close()
        raise KeyboardInterrupt

    monkeypatch.setattr(operator_session, "run_event_loop", ended)
    asked: Any = None  # nobody signs in any more
    assert operator_session.run(asked, asked, interrupted=interrupted) == code
    assert capsys.readouterr().err.strip() == interrupted
