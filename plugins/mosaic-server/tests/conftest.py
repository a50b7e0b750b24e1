"""A real server on 127.0.0.1 with a throw-away database, and scripted robots and operators that speak to it."""

from __future__ import annotations

import contextlib
import datetime
import json
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import UUID

import httpx
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from sqlalchemy import text
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from mosaic_server.data_dir import FILE_NAME
from mosaic_server.roles import Role
from mosaic_server.security.passwords import HashingCost, hash_at, hash_password
from mosaic_server.serving import Listening, Server, make_server
from mosaic_server.settings import Settings
from mosaic_server.sockets.keep_alive import KeepAlivePeriods
from mosaic_server.storage.accounts import Membership, Person, add_account
from mosaic_server.storage.database import Database
from mosaic_server.storage.grants import Actor, LastSupervisor, set_role
from mosaic_server.storage.migrations import upgrade
from mosaic_server.storage.robots import RobotAuthType, add_robot, renew_token

PASSWORD = "correct horse battery"  # noqa: S105 - of throw-away accounts
WAIT_S = 20.0
"""Longer than anything takes on a busy machine; who waits in vain waits once."""
CHEAP = HashingCost(passes=1, memory_kib=8, lanes=1)
"""A hash of 0.1 ms: nobody's password is kept here, and hundreds of accounts are made."""


class Party:
    """One end of a WebSocket: a robot or an operator that does exactly what the test says."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def send(self, kind: str, data: Any = None) -> None:
        self.connection.send(json.dumps({"type": kind, "data": data}))

    def receive(self, timeout_s: float = WAIT_S) -> dict[str, Any]:
        return json.loads(self.connection.recv(timeout=timeout_s))

    def expect(self, kind: str, timeout_s: float = WAIT_S) -> Any:
        """The data of the next message that is no ping; it must be of this kind."""
        deadline_s = time.monotonic() + timeout_s
        while (message := self.receive(timeout_s))["type"] == "ping.ping":
            assert time.monotonic() < deadline_s, f"waited {timeout_s} s for {kind}"
        assert message["type"] == kind, message
        return message["data"]

    def expect_silence(self, for_s: float = 0.3) -> None:
        deadline_s = time.monotonic() + for_s
        with contextlib.suppress(TimeoutError):
            while (message := self.receive(max(0, deadline_s - time.monotonic())))["type"] == "ping.ping":
                pass
            pytest.fail(f"unexpected {message}")

    def close_code(self, timeout_s: float = WAIT_S) -> int:
        """Read until the server closes; returns its code."""
        deadline_s = time.monotonic() + timeout_s
        try:
            while True:
                self.connection.recv(timeout=max(0, deadline_s - time.monotonic()))
        except ConnectionClosed as closed:
            return closed.rcvd.code if closed.rcvd else 1006

    def status(self, status: int) -> None:
        self.send("status.update", {"status": status})


@dataclass
class Running:
    """A running server and what a test needs to know of it."""

    settings: Settings
    listening: Listening
    server: Server
    http: httpx.Client
    _stack: ExitStack = field(default_factory=ExitStack)
    _database: Database | None = None

    @property
    def ws_url(self) -> str:
        return f"ws://127.0.0.1:{self.listening.port}"

    def database(self) -> Database:
        return Database(self.settings.data_dir, self.settings.database_url)

    def work(self, task: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """Straight in its database; while the server runs by one and the same, which remembers what it compiled."""
        if self.server.should_exit:
            with closing(self.database()) as database:
                return database.work(task, *args, **kwargs)
        if self._database is None:
            self._database = self._stack.enter_context(closing(self.database()))
        return self._database.work(task, *args, **kwargs)

    def account(self, email: str = "ada@example.org") -> Person:
        return self.work(add_account, email, PASSWORD, "Ada")

    def member(self, admin: Person, email: str, *, is_admin: bool = False, is_program: bool = False) -> Person:
        """Another account of the admin's organization."""
        membership = Membership(admin.organization_id, is_admin)
        return self.work(add_account, email, PASSWORD, email[:3], membership=membership, is_program=is_program)

    def robot(self, person: Person, name: str = "rover", auth: RobotAuthType = RobotAuthType.SIMPLE_TOKEN) -> Any:
        """(id, token)"""
        robot = self.work(add_robot, person.organization_id, name, "", auth)
        return robot.id, self.work(renew_token, robot.id)

    def log_in(self, email: str = "ada@example.org") -> str:
        answer = self.http.post("/api/v1/account/login/access-token", json={"username": email, "password": PASSWORD})
        assert answer.status_code == 200, answer.text
        return answer.json()["resultData"]["accessToken"]

    def get(self, path: str, token: str) -> httpx.Response:
        return self.http.get(path, headers={"Authorization": f"Bearer {token}"})

    def post(self, path: str, token: str, body: Any = None) -> httpx.Response:
        return self.http.post(path, headers={"Authorization": f"Bearer {token}"}, json=body)

    def put(self, path: str, token: str, body: Any = None) -> httpx.Response:
        return self.http.put(path, headers={"Authorization": f"Bearer {token}"}, json=body)

    def delete(self, path: str, token: str) -> httpx.Response:
        return self.http.delete(path, headers={"Authorization": f"Bearer {token}"})

    def open(self, path: str, **options: Any) -> Party:
        connecting = connect(f"{self.ws_url}{path}", compression=None, close_timeout=1, **options)
        connection = self._stack.enter_context(connecting)
        return Party(connection)

    def connect_robot(self, robot_id: str, token: str | None, extensions: dict[str, int] | None = None) -> Party:
        party = self.open("/ws/robot")
        party.expect("authorize.req")
        data: dict[str, Any] = {"robotId": robot_id}
        if token is not None:
            data["data"] = token
        if extensions is not None:
            data["extensions"] = extensions
        party.send("authorize", data)
        assert party.expect("authorize.res") == 100
        if extensions:
            party.expect("session.welcome")
        return party

    def connect_operator(self, token: str, extensions: dict[str, int] | None = None) -> Party:
        party = self.open("/ws/user")
        party.expect("authorize.req")
        party.send("authorize", {"accessToken": token, **({"extensions": extensions} if extensions else {})})
        assert party.expect("authorize.res") == 100
        if extensions:
            party.expect("session.welcome")
        return party


@cache
def empty_database() -> bytes:
    """An SQLite file with the newest schema and nothing in it: a copy is made sooner than the migrations are run."""
    with TemporaryDirectory() as folder:
        database = Database(Path(folder))
        database.migrate()
        database.close()
        return (Path(folder) / FILE_NAME).read_bytes()


@contextmanager
def running_server(settings: Settings, port: int = 0, **tls: Path) -> Iterator[Running]:
    if settings.database_url is None and not settings.data_dir.exists():
        settings.data_dir.mkdir(mode=0o700, parents=True)
        (settings.data_dir / FILE_NAME).write_bytes(empty_database())
    listening: list[Listening] = []
    heard = threading.Event()

    def on_listening(found: Listening) -> None:
        listening.append(found)
        heard.set()

    server = make_server(settings, port=port, on_listening=on_listening, **tls)
    thread = threading.Thread(target=server.run, name="server")
    thread.start()
    try:
        assert heard.wait(15), "the server did not start"
        base_url = f"http://127.0.0.1:{listening[0].port}"
        with httpx.Client(base_url=base_url, timeout=10) as http, ExitStack() as stack:
            yield Running(settings, listening[0], server, http, stack)
    finally:
        server.should_exit = True
        thread.join(10)
        assert not thread.is_alive(), "the server did not stop"


@pytest.fixture(scope="session", autouse=True)
def _cheap_hashes() -> Iterator[None]:
    """Also for the command line, which runs in this process."""
    hash_at(CHEAP)
    yield
    hash_at(HashingCost())


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """Pings a hundred times more often than in earnest, so that tests needn't wait; the limits of those who are silent
    are as in earnest, because on a busy machine everybody is now and then."""
    return Settings(
        data_dir=tmp_path / "data",
        hashing=CHEAP,
        keep_alive=KeepAlivePeriods(ping_s=0.3, check_s=0.1),
        revocation_check_s=0.2,
        allow_signup=True,
    )


@pytest.fixture
def server(settings: Settings) -> Iterator[Running]:
    with running_server(settings) as running:
        yield running


def _old_database(database: Database) -> None:
    """The first schema, with an admin, a plain account and a robot in it."""
    rows = {
        "organization": ({"id": "org", "name": "lab"},),
        "account": tuple(
            {
                "id": email[:3],
                "organization_id": "org",
                "email": email,
                "full_name": "",
                "password_hash": hash_password(PASSWORD),
                "is_active": True,
                "is_organization_admin": email.startswith("ada"),
                "login_version": 1,
            }
            for email in ("ada@example.org", "bob@example.org")
        ),
        "robot": (
            {"id": str(UUID(int=1)), "organization_id": "org", "name": "rover", "description": "", "auth_type": 0},
        ),
    }
    with database.engine.begin() as connection:
        upgrade(connection, "0001")
        for table, records in rows.items():
            for record in records:
                values = record | {"created_at_ms": 1, "updated_at_ms": 1}
                names, marks = ", ".join(values), ", ".join(f":{name}" for name in values)
                connection.execute(text(f"INSERT INTO {table} ({names}) VALUES ({marks})"), values)


@pytest.fixture
def old_database() -> Callable[[Database], None]:
    """Fills an empty database as the first version of the server would have left it."""
    return _old_database


def _demote_each_other(database: Database) -> None:
    robot, test = str(UUID(int=1)), Actor("test")

    def demoted(account_id: str) -> bool:
        try:
            database.work(set_role, robot, account_id, Role.OBSERVER, test)
        except LastSupervisor:
            return False
        return True

    with ThreadPoolExecutor(2) as administrators:
        for _ in range(10):
            for account_id in ("ada", "bob"):
                database.work(set_role, robot, account_id, Role.SUPERVISOR, test)
            assert sorted(administrators.map(demoted, ("ada", "bob"))) == [False, True]


@pytest.fixture
def demote_each_other() -> Callable[[Database], None]:
    """Two supervisors of the `old_database`, migrated, demote each other at once, ten times: one stays each time."""
    return _demote_each_other


@pytest.fixture(scope="session")
def start_server() -> Callable[..., Any]:
    """For tests that start a server with settings of their own, or twice."""
    return running_server


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Self-signed, for rover.example.org."""
    key, now = ec.generate_private_key(ec.SECP256R1()), datetime.datetime.now(datetime.UTC)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "rover")])
    names = [x509.DNSName("Rover.example.org"), x509.DNSName("*.example.org")]
    signed = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .sign(key, hashes.SHA256())
    )
    encoding = serialization.Encoding.PEM
    form = serialization.PrivateFormat.PKCS8
    folder = tmp_path_factory.mktemp("certificate")
    files = folder / "cert.pem", folder / "key.pem"
    files[0].write_bytes(signed.public_bytes(encoding))
    files[1].write_bytes(key.private_bytes(encoding, form, serialization.NoEncryption()))
    return files
