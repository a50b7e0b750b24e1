"""A simulated robot, the people who drive it in Chromium, and an observer that knows where it really is."""

from __future__ import annotations

import asyncio
import json
import math
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import pytest
from playwright.sync_api import Page
from support.people import Driver, Tabs
from support.robot_process import running_robot
from support.waiting import wait_for

from mosaic_core.operator import MessageInfo, MosaicOperator, RobotConnection

CONNECTORS = """\
  - { type: sim-camera, label: front, params: { width: 160, height: 120, fps: 5 } }
  - { type: sim-pose, label: pose, params: { period_s: 0.02 } }
  - { type: sim-battery, label: battery }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } }, safety: { timeout_s: 0.3 } }
  - { type: connection-check, label: link }
"""
REST_M = 0.002
"""Less way than this between two looks counts as standing."""
PAUSE_S = 0.04
"""Poses come every 0.02 s; what is longer than this is the time that a busy machine did not give to the robot."""
TIMEOUT_S = 0.3
"""`safety.timeout_s`."""
BRAKING_S = 0.5
"""The simulated base needs this long from full speed to rest."""
LATENESS_S = 0.4
"""Of the way from the browser to the robot, and of our own looking."""
STOPPED_WITHIN_S = TIMEOUT_S + BRAKING_S + LATENESS_S
"""While the robot has its processor; what it was kept waiting for one is measured, and comes on top."""


@pytest.fixture(scope="package")
def seed(server: Any) -> Any:
    """One for all tests of this folder: they share the robot."""
    return server.seed()


@pytest.fixture(scope="package")
def robot(server: Any, seed: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with running_robot(tmp_path_factory.mktemp("robot"), server, seed, CONNECTORS) as running:
        yield running


@dataclass
class PoseObserver:
    """An operator on a thread of its own that watches the pose; it keeps where the robot was and when."""

    url: str
    email: str
    password: str
    robot_id: str
    poses: list[tuple[float, float, float, float]] = field(default_factory=list)
    """(monotonic s when the robot said so, x m, y m, yaw rad): arrivals bunch on a busy machine."""
    _loop: asyncio.AbstractEventLoop = field(default_factory=asyncio.new_event_loop)
    _done: asyncio.Event = field(default_factory=asyncio.Event)
    _thread: threading.Thread | None = None
    _connection: RobotConnection | None = None
    _failure: BaseException | None = None

    def start(self) -> None:
        self._thread = threading.Thread(target=self._run, name="pose-observer", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        if self._loop.is_running():
            self._loop.call_soon_threadsafe(self._done.set)
        if self._thread is not None:
            self._thread.join(timeout=10)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._watch())
        except BaseException as error:  # noqa: BLE001 (shown by the test that waits)
            self._failure = error
        finally:
            self._loop.close()

    async def _watch(self) -> None:
        async with await MosaicOperator.login(self.url, self.email, self.password, is_person=True) as operator:
            self._connection = connection = await operator.connect(self.robot_id, reconnect=True)
            connection.receivable("pose").subscribe(self._take)
            await self._done.wait()

    def _take(self, data: bytes, info: MessageInfo) -> None:
        pose = json.loads(data)
        z, w = pose["orientation"]["z"], pose["orientation"]["w"]
        self.poses.append((info.stamp_us / 1e6, pose["position"]["x"], pose["position"]["y"], 2 * math.atan2(z, w)))

    def clear_stop(self) -> None:
        """Let the robot move again where it was stopped: the account is a supervisor, and no program may."""
        assert self._connection is not None
        asyncio.run_coroutine_threadsafe(self._connection.control.clear_stop(), self._loop).result(timeout=10)

    @property
    def is_watching(self) -> bool:
        assert self._failure is None, self._failure
        return bool(self.poses)

    @property
    def now(self) -> tuple[float, float, float, float]:
        return self.poses[-1]

    def since(self, since_s: float) -> list[tuple[float, float, float, float]]:
        return self.poses[bisect_left(self.poses, (since_s,)) :]

    def way_m(self, since_s: float) -> float:
        """Length of the path since then."""
        points = self.since(since_s)
        return sum(math.dist(a[1:3], b[1:3]) for a, b in pairwise(points))

    def rests(self) -> bool:
        """The last 0.2 s brought no way."""
        newest_s = self.now[0]
        is_fresh = time.monotonic() - newest_s < 0.15
        return is_fresh and self.poses[0][0] < newest_s - 0.2 and self.way_m(newest_s - 0.2) < REST_M

    def stays(self) -> bool:
        """For 0.8 s: enough for a command to act if it did."""
        start_s = time.monotonic()
        wait_for(lambda: self.now[0] > start_s + 0.8, "time passes")
        return self.way_m(start_s) < 2 * REST_M

    def expect_rest(self, since_s: float) -> None:
        """The robot comes to rest, and was quick about it."""
        wait_for(self.rests, "the robot rests")
        points = self.since(since_s)
        moved_s = [b[0] for a, b in pairwise(points) if math.dist(a[1:3], b[1:3]) > 0.0005]
        assert max(moved_s, default=since_s) - since_s < STOPPED_WITHIN_S + self.kept_waiting_s(since_s)

    def kept_waiting_s(self, since_s: float) -> float:
        """For how long the robot's process wanted to run since then and could not."""
        return sum(max(0.0, b[0] - a[0] - PAUSE_S) for a, b in pairwise(self.since(since_s)))


@pytest.fixture(scope="package")
def observer(server: Any, seed: Any, robot: Any) -> Iterator[PoseObserver]:
    watching = PoseObserver(server.url, seed.email, seed.password, seed.robot_id)
    watching.start()
    wait_for(lambda: watching.is_watching, "the observer sees the pose")
    yield watching
    watching.stop()


@pytest.fixture
def driver_of(server: Any, seed: Any, robot: Any, sign_in: Callable[[Page], None]) -> Callable[[Page], Driver]:
    """`driver_of(page)`: a signed-in person on the robot's page."""

    def signed_in(page: Page) -> Driver:
        sign_in(page)
        person = Driver(page, server.url, seed)
        person.open_robot()
        return person

    return signed_in


@dataclass
class Seats:
    """Places at the robot's page. Whoever rises lets go and leaves the page to the next one as it is: connecting takes
    a second. After a test that failed, and where the page was closed, the next one opens it anew."""

    tabs: Tabs
    _free: list[tuple[Driver, ExitStack]] = field(default_factory=list)

    @contextmanager
    def taken(self, driver_of: Callable[[Page], Driver], failures: Callable[[], int]) -> Iterator[Driver]:
        person, tab = self._free.pop() if self._free else self._new(driver_of)
        before = failures()
        yield person
        if person.page.is_closed() or failures() > before:
            tab.close()
            return
        self._free.append((person, tab))
        person.let_go()

    def close(self) -> None:
        for _, tab in self._free:
            tab.close()

    def _new(self, driver_of: Callable[[Page], Driver]) -> tuple[Driver, ExitStack]:
        tab = ExitStack()
        return driver_of(tab.enter_context(self.tabs.lent())), tab


@pytest.fixture(scope="package")
def seats(tabs: Tabs, robot: Any) -> Iterator[Seats]:
    kept = Seats(tabs)
    yield kept
    kept.close()


@pytest.fixture
def seated(seats: Seats, driver_of: Any, request: pytest.FixtureRequest) -> Callable[[], Any]:
    """`with seated() as person`: signed in, on the robot's page."""
    return lambda: seats.taken(driver_of, lambda: request.session.testsfailed)


@pytest.fixture
def driver(seated: Any, observer: PoseObserver) -> Iterator[Driver]:
    """A signed-in person on the robot's page; the robot stands still."""
    wait_for(observer.rests, "the robot rests before the test")
    observer.clear_stop()
    with seated() as person:
        yield person


@pytest.fixture
def ann(driver: Driver) -> Driver:
    """Who takes control first."""
    driver.take_control()
    return driver


@pytest.fixture
def bob(ann: Driver, seated: Any) -> Iterator[Driver]:
    """Who comes second."""
    with seated() as person:
        yield person
