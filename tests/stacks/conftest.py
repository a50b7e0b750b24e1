"""Peers that know the original documents and nothing of ours, see `independent/`; every test here proves a pair."""

from __future__ import annotations

import asyncio
import shutil
import sys
import threading
from collections.abc import Callable, Coroutine, Iterator
from pathlib import Path
from typing import Any, TypeVar

import pytest

HERE = Path(__file__).parent
if str(HERE) not in sys.path:
    sys.path.append(str(HERE))

from independent.aiortc_operator import Page  # noqa: E402
from independent.aiortc_robot import C1Robot, C2Robot  # noqa: E402
from independent.javascript import ChromiumHost, NodeHost  # noqa: E402
from independent.wire import Rest, until  # noqa: E402

T = TypeVar("T")
PACKAGES = HERE.parents[1] / "dashboard"
OUR_CONNECTORS = """\
  - { type: test-pattern, label: front, params: { width: 320, height: 240, fps: 15 } }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } }, safety: { timeout_s: 0.5 } }
  - { type: connection-check, label: link }
  - { type: sim-point-cloud, label: cloud, params: { rate_hz: 2, columns: 240 } }
"""


@pytest.fixture(scope="module")
def our_robot(start_robot: Any) -> Any:
    return start_robot(OUR_CONNECTORS)


@pytest.fixture
def page(server: Any, seed: Any) -> Callable[[], Page]:
    """`async with page() as tab`: the original page on aiortc, signed in to our server."""
    return lambda: Page(server.url, seed.email, seed.password)


@pytest.fixture
def rest_of(server: Any, seed: Any) -> Callable[[Callable[[Rest], Coroutine[Any, Any, T]]], T]:
    """`rest_of(calls)` → what `calls(rest)` gives, with the REST routes as the original page uses them."""

    async def signed_in(calls: Callable[[Rest], Coroutine[Any, Any, T]]) -> T:
        rest = Rest(server.url)
        try:
            await rest.log_in(seed.email, seed.password)
            return await calls(rest)
        finally:
            await rest.close()

    return lambda calls: in_thread(signed_in(calls))


@pytest.fixture
def new_robot(rest_of: Any) -> Callable[..., tuple[str, str]]:
    """`new_robot(name)`: id and token of a further robot, made as the original page makes it."""
    return lambda name, *, with_token=True: rest_of(lambda rest: rest.add_robot(name, with_token=with_token))


@pytest.fixture
def c2_robot(server: Any, new_robot: Any, request: pytest.FixtureRequest) -> Callable[..., C2Robot]:
    """`async with c2_robot(cameras=…) as robot`: an original robot on our server."""

    def make(*, with_token: bool = True, cameras: tuple[str, ...] = ()) -> C2Robot:
        robot_id, token = new_robot(f"C2 of {request.node.name}", with_token=with_token)
        return C2Robot(server.url, robot_id, token, cameras)

    return make


@pytest.fixture
def c1_robot(server: Any, new_robot: Any) -> Callable[[], C1Robot]:
    return lambda: C1Robot(server.url, *new_robot("C1"))


@pytest.fixture(scope="module")
def libdatachannel() -> Iterator[NodeHost]:
    """Skipped (in CI: fails) where Node or its package is missing; `./dev setup` brings both."""
    node = shutil.which("node", path=str(Path(sys.executable).parent)) or shutil.which("node")
    if node is None or not (PACKAGES / "node_modules" / "node-datachannel").exists():
        pytest.skip("no Node with node-datachannel: ./dev setup")
    host = NodeHost(node, PACKAGES)
    yield host
    host.close()


@pytest.fixture(scope="session")
def chromium_host() -> type[ChromiumHost]:
    """`chromium_host(page, url)`: a browser's page in which peers can be made."""
    return ChromiumHost


def in_thread(scene: Coroutine[Any, Any, T]) -> T:
    """Runs `scene` on a loop of its own, also where Playwright has one in this thread."""
    found: list[T] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            found.append(asyncio.run(scene))
        except BaseException as error:  # noqa: BLE001 (raised below, where the test is)
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    if errors:
        raise errors[0]
    return found[0]


@pytest.fixture(name="in_thread", scope="session")
def in_thread_fixture() -> Any:
    return in_thread


@pytest.fixture(name="until", scope="session")
def until_fixture() -> Any:
    return until


@pytest.fixture
def pair(record_property: Callable[[str, object], None]) -> Callable[[str, str, str], None]:
    """`pair(ours, theirs, what)`: what this test proves goes into `docs/reference/compatibility.md`."""
    return lambda ours, theirs, what: record_property("pair", f"{ours} | {theirs} | {what}")
