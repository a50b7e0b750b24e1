"""Rules of the whole suite: in CI nothing real is skipped, and no test leaves its log handlers to the next."""

from __future__ import annotations

import logging
import os
from collections.abc import Generator, Iterator

import pytest

REAL = ("webrtc", "e2e", "netlab", "postgresql")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """With `CI=true` a skipped test of real peers fails: a missing browser must not look like a pass."""
    report = yield
    if report.skipped and os.environ.get("CI") == "true" and any(item.get_closest_marker(name) for name in REAL):
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
