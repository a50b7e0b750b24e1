"""A subscriber that fails at every message is heard of, but does not fill the log."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

import pytest

from mosaic_core.operator.delivery.data_port import MessageInfo
from mosaic_core.operator.stores import stores
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.stores import ReceivableStore


@pytest.fixture
def tell(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Give a failing subscriber a message at this time."""
    now_s = 0.0
    monkeypatch.setattr(stores.time, "monotonic", lambda: now_s)
    store = ReceivableStore(RobotConnector("robot", "scan"))

    def fail(data: bytes) -> Awaitable[None] | None:
        raise ZeroDivisionError(data)

    store.subscribe(fail)

    def told(at_s: float) -> None:
        nonlocal now_s
        now_s = at_s
        store.notify_subscribers(b"x", MessageInfo(at_s))

    return told


def test_one_failure_in_five_seconds_is_logged_and_all_are_counted(
    tell: Callable[[float], None], caplog: pytest.LogCaptureFixture
) -> None:
    for at_s in (0.0, 0.1, 4.9, 5.0, 5.1):
        tell(at_s)
    assert [record.getMessage() for record in caplog.records] == [
        "scan: a subscriber failed (1 so far)",
        "scan: a subscriber failed (4 so far)",
    ]
    assert all(record.exc_info is not None for record in caplog.records)
