"""What `mosaic doctor` says of a server's data: read only, and nothing is made where nothing was."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from mosaic_core.words.finding import Finding
from mosaic_server.doctor import dashboard_finding, data_finding, examine
from mosaic_server.storage.database import Database


def found() -> list[Finding]:
    async def collect() -> list[Finding]:
        return [finding async for finding in examine(None)]

    return asyncio.run(collect())


def test_a_machine_without_a_server_is_no_failure_and_gets_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path / "none"))
    assert [one.status for one in found()] == ["skipped"]
    assert not (tmp_path / "none").exists()


def test_data_is_whole_or_damaged_or_without_a_relay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    database = Database(tmp_path)
    database.migrate()
    database.close()
    assert database.file is not None
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path))
    assert found()[0].code == "ice.no_servers"
    database.file.write_bytes(b"this is no database, and never was one" * 100)
    assert data_finding(database.file).status == "fail"


def test_a_dashboard_that_is_not_built_is_said(tmp_path: Path) -> None:
    assert dashboard_finding(tmp_path).status == "warn"
    (tmp_path / "index.html").touch()
    assert dashboard_finding(tmp_path).status == "ok"
