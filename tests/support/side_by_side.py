"""Shares out the tests among processes that each have a network of their own. They are forks of one that has collected
the tests: sixteen seconds of a processor that none of them needs again."""

from __future__ import annotations

import os
import traceback
import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NoReturn

import pytest

from support.own_network import enter_own_network

ONE_BY_ONE = "tests/webrtc/original/"
"""Every test there makes its own robot; elsewhere those of a module share one, and stay together."""
LONGEST_FIRST = (
    "test_sim_demo_whole",
    "test_operator_command",
    "test_whole_system",
    "test_roaming",
    "test_aiortc_peers",
    "test_who_may",
    "test_black_hole",
    "test_everything_that_moves",
    "test_sim_demo_own",
    "test_plugin_new",
    "test_ladder_rules",
    "test_server_compatibility",
    "test_a_refused_robot_goes_on",
    "test_vanished_operator",
    "test_server_cli",
    "test_video_on_a_shared_link",
    "test_drill.py",
    "test_turn.py",
    "test_thirty_plugins",
    "test_shell_blocks",
    "test_reload.py",
    "test_ros2_over_dds",
    "test_command_line",
    "test_ros2_drill",
    "test_pairing_programs",
    "test_original_server",
    "test_recorder_robot",
    "test_viewers_come_and_go",
    "test_server_sockets",
    "test_original_dashboard",
    "test_ipv6",
    "test_overload",
    "test_an_operator_that_never_appears",
    "test_server_rest.py",
    "test_doctor_with_server",
    "test_entrance",
    "test_fuzzed_control",
    "test_video_over_bad_links",
    "test_lan_child",
    "test_a_camera_asked_for_later",
    "test_recorder_movie_file",
    "test_control_walks",
    "test_shared_video",
    "test_server_role_changes",
    "test_ice_probes",
    "test_gstreamer",
    "test_codec_refusals",
    "test_grant_properties",
    "test_server_grants",
    "test_recorder_clip",
    "test_mosaic_bench",
    "test_libdatachannel_peers",
    "test_control_with_robot",
    "test_quick_sctp",
    "test_forged_tickets",
)
"""What takes longest comes first, so that at the end no process works alone."""

Unit = Sequence[int]
"""Places in the session of tests that one process runs, one after the other."""


class SideBySide:
    """The pytest plugin of `--own-networks`: runs what was collected in ``count`` forks of this process, which itself
    moves into such a network: some modules ask for the machine's address while they are imported."""

    def __init__(self, count: int) -> None:
        self._count = count
        enter_own_network()

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items.sort(key=_rank)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool | None:
        if session.testsfailed or session.config.option.collectonly:
            return None  # pytest says what it is about
        Foreman(session).run(self._count)
        return True


def _rank(item: pytest.Item) -> int:
    found = (number for number, name in enumerate(LONGEST_FIRST) if name in item.nodeid)
    return next(found, len(LONGEST_FIRST))


def _units(items: Sequence[pytest.Item]) -> Iterator[Unit]:
    """Modules, and single tests of :data:`ONE_BY_ONE`."""

    def scope(place: int) -> str:
        name = items[place].nodeid
        return name if name.startswith(ONE_BY_ONE) else name.split("::")[0]

    for _, places in groupby(range(len(items)), scope):
        yield list(places)


@dataclass
class Hand:
    """One of the processes, as the foreman knows it."""

    pid: int
    folder: str
    given: list[int] = field(default_factory=list)
    """What it has not ended yet, in order."""
    failure: str = ""
    """Why it could not go on, where it could say so."""


class Foreman:
    """Hands out units, and tells pytest what became of the tests."""

    def __init__(self, session: pytest.Session) -> None:
        self._session = session
        self._waiting = deque(_units(session.items))
        self._hands: dict[Connection, Hand] = {}

    def run(self, count: int) -> None:
        try:
            base = self._session.config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]
            for number in range(count):
                self._fork(f"{base}/process{number}")
            while self._hands:
                for connection in wait(list(self._hands)):
                    assert isinstance(connection, Connection)
                    self._hear(connection)
        finally:
            for connection, hand in self._hands.items():
                connection.close()
                os.waitpid(hand.pid, 0)
        if self._session.shouldfail:
            raise self._session.Failed(self._session.shouldfail)
        if self._session.shouldstop:
            raise self._session.Interrupted(self._session.shouldstop)

    def _fork(self, folder: str) -> None:
        ours, theirs = Pipe()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # numpy's idle threads are not missed in a fork
            pid = os.fork()
        if pid == 0:
            for connection in (ours, *self._hands):
                connection.close()  # or nobody would hear that another one has ended
            work(self._session, theirs, folder)
        theirs.close()
        self._hands[ours] = Hand(pid, folder)

    def _hear(self, connection: Connection) -> None:
        hand = self._hands[connection]
        try:
            kind, told = connection.recv()
        except (EOFError, ConnectionResetError):
            self._ended(connection, hand)
            return
        if kind == "wants more":
            unit = self._next()
            hand.given += unit
            connection.send(unit)
        elif kind == "ended":
            hand.given.pop(0)
        elif kind == "failed":
            hand.failure = told
        else:
            self._report(told)

    def _next(self) -> Unit:
        if self._session.shouldfail or self._session.shouldstop or not self._waiting:
            return ()
        return self._waiting.popleft()

    def _report(self, told: dict[str, Any]) -> None:
        config = self._session.config
        config.hook.pytest_runtest_logreport(
            report=config.hook.pytest_report_from_serializable(config=config, data=told)
        )

    def _ended(self, connection: Connection, hand: Hand) -> None:
        """As it should; or in the middle of a test, which has failed then, and another one takes what it leaves."""
        connection.close()
        del self._hands[connection]
        code = os.waitstatus_to_exitcode(os.waitpid(hand.pid, 0)[1])
        if code == 0:
            return
        why = hand.failure or f"the process of this test ended with {code}"
        if not hand.given:
            self._session.shouldfail = why
            return
        item = self._session.items[hand.given.pop(0)]
        self._session.config.hook.pytest_runtest_logreport(
            report=pytest.TestReport(item.nodeid, item.location, {}, "failed", why, "call")
        )
        if hand.given:
            self._waiting.appendleft(hand.given)
            self._fork(f"{hand.folder}-again")


def work(session: pytest.Session, foreman: Connection, folder: str) -> NoReturn:
    """What a fork does: run the units that it is given, in a network of its own, until there are no more."""
    code = 1
    try:
        enter_own_network()
        _settle(session.config, foreman, folder)
        try:
            _run(session, foreman)
        finally:
            session._setupstate.teardown_exact(None)  # also where somebody pressed Ctrl+C
        code = 0
    except BaseException:  # noqa: BLE001 - the fork ends here, whatever it was
        foreman.send(("failed", traceback.format_exc()))
    finally:
        os._exit(code)


def _settle(config: pytest.Config, foreman: Connection, folder: str) -> None:
    """Has this process say nothing itself, catch what its own tests print, and write into a folder of its own."""
    config.workerinput = {"workerid": Path(folder).name}  # type: ignore[attr-defined]  # as those of xdist have
    capture = config.pluginmanager.getplugin("capturemanager")
    capture.stop_global_capturing()
    capture.start_global_capturing()
    config.pluginmanager.unregister(name="terminalreporter")
    config.pluginmanager.register(Messenger(config, foreman))
    config.option.basetemp = folder
    config._tmp_path_factory = pytest.TempPathFactory.from_config(config, _ispytest=True)  # type: ignore[attr-defined]


def _run(session: pytest.Session, foreman: Connection) -> None:
    waiting = deque(_asked(foreman))
    while waiting:
        item = session.items[waiting.popleft()]
        if not waiting:
            waiting += _asked(foreman)  # what fixtures end after this test hangs on which one comes next
        following = session.items[waiting[0]] if waiting else None
        session.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        foreman.send(("ended", None))


def _asked(foreman: Connection) -> Unit:
    foreman.send(("wants more", None))
    unit: Unit = foreman.recv()
    return unit


class Messenger:
    """The pytest plugin of a fork: brings what is reported to the foreman."""

    def __init__(self, config: pytest.Config, foreman: Connection) -> None:
        self._config = config
        self._foreman = foreman

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        told = self._config.hook.pytest_report_to_serializable(config=self._config, report=report)
        self._foreman.send(("report", told))
