"""Runs the MOSAIC server as a process, with accounts and robots made straight in its database."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from support.processes import QUICK_MOSAIC, Process

PASSWORD = "correct horse battery"  # noqa: S105 (of throw-away accounts)


@dataclass
class Seed:
    """An account and its robot in a throw-away database."""

    email: str
    password: str
    robot_id: str
    robot_token: str


class ServerProcess(Process):
    """`mosaic server run` on a free port with a data directory of its own; it may be stopped and started again."""

    def __init__(self, data_dir: Path) -> None:
        super().__init__([])
        self.data_dir = data_dir
        self.port = 0
        self._seeds = 0

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def plain_url(self) -> str:
        """A page of the server's own without any script."""
        return f"{self.url}/healthz"

    def seed(self, robot_name: str = "Test robot") -> Seed:
        """A new account in an organization of its own, which has one robot; also while the server runs."""
        from mosaic_server.security.passwords import hash_at
        from mosaic_server.storage.accounts import add_account
        from mosaic_server.storage.database import Database
        from mosaic_server.storage.robots import add_robot, renew_token
        from support.quick_server import CHEAP

        hash_at(CHEAP)
        self._seeds += 1
        email = f"person{self._seeds}@example.org"
        database = Database(self.data_dir)
        try:
            database.migrate()
            person = database.work(add_account, email, PASSWORD)
            robot = database.work(add_robot, person.organization_id, robot_name)
            return Seed(email, PASSWORD, robot.id, database.work(renew_token, robot.id))
        finally:
            database.close()

    def start(self) -> None:
        ready = self.data_dir / "ready.json"
        ready.unlink(missing_ok=True)
        where = ["--data-dir", str(self.data_dir), "--port", str(self.port), "--ready-file", str(ready)]
        self.words = [*QUICK_MOSAIC, "server", "run", *where]
        super().start()
        self.expect(lambda: ready.exists() and ready.read_text(), "the server listens")
        self.port = json.loads(ready.read_text())["port"]
