"""The same server on a real PostgreSQL: migrations, accounts, robots, roles, and a restart."""

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
from uuid import UUID

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import create_engine, func, select, text
from sqlalchemy.orm import Session

from mosaic_server.roles import Role
from mosaic_server.settings import Settings
from mosaic_server.storage.database import Database
from mosaic_server.storage.grants import Actor, set_role
from mosaic_server.storage.tables import Base, RobotGrant

ROBOT = str(UUID(int=1))
TEST = Actor("test")
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


def test_an_old_database_is_upgraded_and_roles_work_there_too(
    settings: Settings,
    database_url: str,
    start_server: Callable[..., Any],
    old_database: Callable[[Database], None],
    demote_each_other: Callable[[Database], None],
) -> None:
    engine = create_engine(database_url, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.execute(text("CREATE DATABASE old"))
    engine.dispose()
    url = database_url.replace("/postgres?", "/old?")
    database = Database(settings.data_dir, url)
    old_database(database)
    database.migrate()
    with database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    demote_each_other(database)
    database.work(set_role, ROBOT, "ada", Role.SUPERVISOR, TEST)
    database.work(set_role, ROBOT, "bob", Role.OPERATOR, TEST)
    database.close()
    with start_server(replace(settings, database_url=url)) as server:
        _a_role_is_granted_and_the_robot_hears_of_it(server)


def _a_role_is_granted_and_the_robot_hears_of_it(server: Any) -> None:
    extensions = {"multiPeer": 1, "tickets": 1, "closeReasons": 1}
    robot = server.connect_robot(ROBOT, None, extensions)
    bob = server.log_in("bob@example.org")
    server.connect_operator(bob, extensions)
    made = server.post("/api/v1/webrtc/connection", bob, {"robotIds": [ROBOT]}).json()["resultData"]["sessions"][0]
    assert robot.expect("signaling.prepare_connection")["operator"]["role"] == "operator"
    server.work(set_role, ROBOT, "bob", Role.OBSERVER, TEST)
    told = robot.expect("signaling.close_peer_connection")
    assert (told["rtcConnectionId"], told["code"]) == (made["rtcSessionId"], "auth.role_changed")
    ada = server.log_in("ada@example.org")
    actions = [one["action"] for one in server.get("/api/v1/audit?limit=3", ada).json()["resultData"]["data"]]
    assert actions == ["role.granted", "connection.made", "role.granted"]
    assert server.delete(f"/api/v1/robots/{ROBOT}", ada).status_code == 200
    assert server.work(_count_grants) == 0


def _count_grants(session: Session) -> int:
    return session.scalar(select(func.count()).select_from(RobotGrant)) or 0
