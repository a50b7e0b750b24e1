"""Rules of the whole suite: in CI nothing real is skipped."""

from __future__ import annotations

import os
from collections.abc import Generator

import pytest

REAL = ("webrtc", "e2e")


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
