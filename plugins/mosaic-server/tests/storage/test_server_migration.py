"""A database that an older version left behind goes on with everything in it, and downgrades lose only what is new."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import inspect

from mosaic_server.roles import Role
from mosaic_server.storage import migrations
from mosaic_server.storage.accounts import person_by_email
from mosaic_server.storage.database import Database
from mosaic_server.storage.grants import Actor, roles_on_robot, set_role
from mosaic_server.storage.tables import Base
from mosaic_server.storage.tabs import tabs_of

ROBOT = str(UUID(int=1))
TEST = Actor("test")


def roles(database: Database) -> dict[str, Role]:
    found, _ = database.work(roles_on_robot, ROBOT, 0, 100)
    return {one.email: one.standing.role_if_active for one in found}


def test_an_old_sqlite_file_is_upgraded_with_everything_in_it(
    tmp_path: Path, old_database: Callable[[Database], None]
) -> None:
    database = Database(tmp_path)
    old_database(database)
    database.migrate()
    with database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    assert roles(database) == {"ada@example.org": Role.SUPERVISOR, "bob@example.org": Role.OPERATOR}
    bob = database.work(person_by_email, "bob@example.org")
    assert bob is not None
    assert not bob.is_program
    database.work(set_role, ROBOT, "bob", Role.OBSERVER, TEST)
    assert roles(database)["bob@example.org"] is Role.OBSERVER
    assert [name for _, name in database.work(tabs_of, "org")] == ["Default"], "as if it had been made today"
    database.close()


def test_a_downgrade_leaves_the_first_schema(tmp_path: Path, old_database: Callable[[Database], None]) -> None:
    database = Database(tmp_path)
    old_database(database)
    before = {name: _columns(database, name) for name in inspect(database.engine).get_table_names()}
    database.migrate()
    config = Config()
    config.set_main_option("script_location", str(Path(migrations.__file__).parent))
    with database.engine.begin() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0001")
    assert {name: _columns(database, name) for name in inspect(database.engine).get_table_names()} == before
    database.close()


def _columns(database: Database, table: str) -> set[str]:
    return {column["name"] for column in inspect(database.engine).get_columns(table)}


def test_an_upgraded_server_goes_on(settings: Any, start_server: Any, old_database: Callable[[Database], None]) -> None:
    database = Database(settings.data_dir)
    old_database(database)
    database.close()
    with start_server(settings) as server:
        token = server.log_in("bob@example.org")
        (robot,) = server.get("/api/v1/robots", token).json()["resultData"]["data"]
        assert (robot["name"], robot["myRole"]) == ("rover", "operator")


def test_of_two_supervisors_who_demote_each_other_at_once_one_stays(
    tmp_path: Path, old_database: Callable[[Database], None], demote_each_other: Callable[[Database], None]
) -> None:
    database = Database(tmp_path)
    old_database(database)
    database.migrate()
    demote_each_other(database)
    database.close()
