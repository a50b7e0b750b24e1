"""What is kept of the audit log, and for how long."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import update
from sqlalchemy.orm import Session

from mosaic_server.storage import audit
from mosaic_server.storage.audit import AuditAction, AuditEntry, audit_page, note, prune_audit
from mosaic_server.storage.database import Database
from mosaic_server.storage.tables import AuditEntryRow, now_ms

DAY_MS = 24 * 3600 * 1000


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(tmp_path)
    database.migrate()
    yield database
    database.close()


def add(session: Session, action: AuditAction, count: int = 1) -> None:
    for number in range(count):
        note(session, AuditEntry(action, "org", detail=str(number)))


def grow_older(session: Session, days: int) -> None:
    session.execute(update(AuditEntryRow).values(at_ms=now_ms() - days * DAY_MS))


def actions(database: Database) -> list[AuditAction]:
    return [entry.action for entry in database.work(audit_page, None, limit=100)]


def test_old_entries_are_dropped_and_others_stay(database: Database) -> None:
    database.work(add, AuditAction.ROLE_GRANTED)
    database.work(grow_older, 31)
    database.work(add, AuditAction.ROLE_REVOKED)
    assert database.work(prune_audit, 32) == 0
    assert database.work(prune_audit, 30) == 1
    assert actions(database) == [AuditAction.ROLE_REVOKED]


def test_noise_is_bounded_and_washes_no_grant_away(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "MOST_KEPT", {AuditAction.LOGIN_FAILED: 3})
    database.work(add, AuditAction.ROLE_GRANTED)
    database.work(add, AuditAction.LOGIN_FAILED, 10)
    assert database.work(prune_audit, 30) == 7
    assert database.work(prune_audit, 30) == 0
    assert [entry.detail for entry in database.work(audit_page, None, limit=10)] == ["9", "8", "7", "0"]


def test_what_strangers_write_is_cut_to_size(database: Database) -> None:
    database.work(note, AuditEntry(AuditAction.LOGIN_FAILED, None, address="a" * 500, detail="d" * 500))
    (entry,) = database.work(audit_page, None, limit=1)
    assert (len(entry.address), len(entry.detail)) == (64, 200)


def test_the_server_prunes_when_it_starts(settings: Any, start_server: Callable[..., Any]) -> None:
    with start_server(settings) as server:
        server.work(add, AuditAction.LOGIN_FAILED, 5)
        server.work(grow_older, 3)
    with start_server(replace(settings, audit_days=2.0)) as server:
        assert server.work(audit_page, None, limit=1) == []
