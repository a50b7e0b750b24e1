"""The same server on a real PostgreSQL: migrations, accounts, robots, and a restart."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mosaic_server.settings import Settings

pytestmark = pytest.mark.postgresql


def _programs() -> Path | None:
    """The folder of `initdb` and `pg_ctl`; Debian keeps it off the PATH."""
    found = shutil.which("initdb")
    folders = [Path(found).parent] if found else sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    return next((folder for folder in folders if (folder / "initdb").exists()), None)


@pytest.fixture(scope="module")
def database_url() -> Iterator[str]:
    """A cluster of its own that listens on a socket file only; it runs as `postgres` when the tests run as root."""
    pytest.importorskip("psycopg", reason="no psycopg: pip install mosaic-server[postgresql]")
    programs = _programs()
    if programs is None:
        pytest.skip("no PostgreSQL: apt install postgresql")
    with tempfile.TemporaryDirectory(prefix="mosaic-postgresql-") as folder:
        yield from _cluster(programs, Path(folder))


def _cluster(programs: Path, home: Path) -> Iterator[str]:
    person: dict[str, Any] = {}
    if os.geteuid() == 0:
        account = pwd.getpwnam("postgres")
        person = {"user": account.pw_uid, "group": account.pw_gid}
        os.chown(home, account.pw_uid, account.pw_gid)

    def run(program: str, *words: str) -> None:
        command = [str(programs / program), "-D", str(home / "data"), *words]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=home, **person)
        assert done.returncode == 0, done.stderr

    run("initdb", "--auth=trust", "--username=mosaic", "--no-sync")
    options = f"-c listen_addresses='' -c unix_socket_directories='{home}' -c fsync=off"
    run("pg_ctl", "start", "--wait", "--log", str(home / "log"), "--options", options)
    yield f"postgresql+psycopg://mosaic@/postgres?host={home}"
    run("pg_ctl", "stop", "--mode=immediate")


def test_the_server_works_on_postgresql_and_survives_a_restart(
    settings: Settings, database_url: str, start_server: Callable[..., Any]
) -> None:
    on_postgresql = replace(settings, database_url=database_url)
    with start_server(on_postgresql) as running:
        person = running.account("ada@example.org")
        robot_id, token = running.robot(person, "rover")
        access = running.log_in()
        running.connect_robot(robot_id, token)
        (robot,) = running.get("/api/v1/robots", access).json()["resultData"]["data"]
        assert robot["name"] == "rover"
        assert robot["isOnline"]
    with start_server(on_postgresql) as running:
        assert running.get("/api/v1/users/me", access).json()["resultData"]["email"] == "ada@example.org"
        running.connect_robot(robot_id, token)
    assert not list(settings.data_dir.glob("*.sqlite3"))
