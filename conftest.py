"""Rules of the whole suite: in CI nothing real is skipped, no test leaves its log handlers to the next, and what the
tests of pairs found becomes the table of `docs/reference/compatibility.md`."""

from __future__ import annotations

import gc
import logging
import os
import signal
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

STACKS = str(Path(__file__).parent / "tests" / "stacks")
if STACKS not in sys.path:
    sys.path.append(STACKS)

from pair_report import PairReport, is_ci  # noqa: E402
from support.own_network import enter_own_network  # noqa: E402
from support.side_by_side import RealPeersScheduling, longest_first  # noqa: E402

os.environ.setdefault("SSL_CERT_FILE", str(Path(__file__).parent / "tests" / "support" / "authority.pem"))
"""An authority whose key nobody has and whose days are over: nothing is vouched for. To read all that a system trusts,
each of some thousand HTTP clients would take 17 ms of a processor, also to talk without TLS."""
REAL = ("webrtc", "e2e", "netlab", "postgresql")

# A busy machine is no failure of pure logic. `MOSAIC_THOROUGH=1`: a night's run, which looks at ten times as much.
settings.register_profile("mosaic", deadline=None)
settings.register_profile("thorough", deadline=None, max_examples=1000)
settings.load_profile("thorough" if os.environ.get("MOSAIC_THOROUGH") else "mosaic")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--pairs", action="store_true", help="bring the table of pairs up to date; with CI=true: fail if it is stale"
    )
    parser.addoption(
        "--own-networks", action="store_true", help="with -n: each of the processes has a network of its own; as root"
    )


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--own-networks") and hasattr(config, "workerinput"):
        enter_own_network()
    config.pluginmanager.register(PairReport(updates=config.getoption("--pairs"), is_ci=is_ci()), "mosaic-pairs")


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> RealPeersScheduling | None:
    return RealPeersScheduling(config, log) if config.getoption("--own-networks") else None


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is collected stays: the garbage collector looks through half a million objects neither meanwhile nor
    afterwards, which takes a third of a second each time that a test asks for it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if hasattr(config, "workerinput"):
        longest_first(items)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """With `CI=true` a skipped test of real peers fails: a missing browser must not look like a pass."""
    report = yield
    is_known = hasattr(report, "wasxfail")  # a pair that does not work, and the table says why
    if report.skipped and not is_known and is_ci() and any(item.get_closest_marker(name) for name in REAL):
        report.outcome = "failed"
        report.longrepr = f"skipped in CI: {report.longrepr}"
    return report


@pytest.fixture(autouse=True)
def own_logging() -> Iterator[None]:
    """A command run in-process configures logging; its handler writes to a stream that is gone after the test."""
    root = logging.getLogger()
    before, level = list(root.handlers), root.level
    yield
    for handler in list(root.handlers):
        if handler not in before and not type(handler).__module__.startswith("_pytest"):
            root.removeHandler(handler)
    root.setLevel(level)


@pytest.fixture(autouse=True)
def own_signals() -> Iterator[None]:
    """A command run in-process takes over what ends a program, and would keep it."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        if handler is not None and signal.getsignal(number) is not handler:
            signal.signal(number, handler)


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    """`async def test_…` runs on asyncio's own loop."""
    return "asyncio"
