"""Opens the database, brings it to the newest schema and runs work on it outside the event loop.

A SQLite file belongs to one running server at a time: the lock file beside it says so. Command-line tools may
work on the file meanwhile (write-ahead log).
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

from sqlalchemy import Engine, create_engine, event
from sqlalchemy.engine import make_url
from sqlalchemy.orm import Session

from mosaic_server.data_dir import FILE_NAME, lock_file

P = ParamSpec("P")
T = TypeVar("T")

_BUSY_TIMEOUT_S = 10
"""How long a writer waits for another process, e.g. `mosaic server user add` beside a running server."""


_WORKERS = 8
"""As many transactions at a time; SQLAlchemy's pool holds five connections and ten more under load."""


class DatabaseInUse(Exception):
    """Another server runs on the same SQLite file."""


class Database:
    """Opens the server's SQL database, with the newest schema.

    ``url`` is any SQLAlchemy URL; without it the SQLite file in ``data_dir`` is used (made with mode 0600).
    All methods but :meth:`run` block; call them from a thread or a command-line tool.
    """

    def __init__(self, data_dir: Path, url: str | None = None) -> None:
        self.file: Path | None = None if url else data_dir / FILE_NAME
        if self.file is not None:
            _make_private(self.file)
            url = f"sqlite:///{self.file}"
        assert url is not None
        self.engine = _engine(url)
        self._lock_fd: int | None = None
        self._workers = ThreadPoolExecutor(max_workers=_WORKERS, thread_name_prefix="mosaic-database")

    def migrate(self) -> None:
        """Bring the schema to the newest revision; a no-op when it is there already."""
        from mosaic_server.storage.migrations import upgrade

        with _one_at_a_time(self.file), self.engine.begin() as connection:
            upgrade(connection)

    def lock(self) -> None:
        """Claim the SQLite file for this server; raises :class:`DatabaseInUse`. Other databases need no claim."""
        if self.file is None or self._lock_fd is not None:
            return
        path = lock_file(self.file)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(descriptor)
            raise DatabaseInUse(
                f"another MOSAIC server is running on {self.file}; stop it, or give this one its own --data-dir"
            ) from error
        self._lock_fd = descriptor

    @contextmanager
    def session(self) -> Iterator[Session]:
        """One transaction: committed at the end, rolled back by an exception."""
        with Session(self.engine, expire_on_commit=False) as session, session.begin():
            yield session

    def work(self, task: Callable[Concatenate[Session, P], T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run ``task(session, …)`` in one transaction on the calling thread."""
        with self.session() as session:
            return task(session, *args, **kwargs)

    async def run(self, task: Callable[Concatenate[Session, P], T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run ``task(session, …)`` in one transaction on a worker thread; the event loop goes on."""
        return await asyncio.get_running_loop().run_in_executor(self._workers, lambda: self.work(task, *args, **kwargs))

    def close(self) -> None:
        """Wait for running work, whoever has stopped waiting for it, then close every connection."""
        self._workers.shutdown()
        self.engine.dispose()
        if self._lock_fd is not None:
            os.close(self._lock_fd)
            self._lock_fd = None


@contextmanager
def _one_at_a_time(file: Path | None) -> Iterator[None]:
    """Of two processes that find no tables, a server and a command, both would make them."""
    if file is None:
        yield
        return
    descriptor = os.open(file.with_suffix(".migration"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _make_private(file: Path) -> None:
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    # Never open a file that is there: closing it again would drop every lock that this process holds on it (POSIX), and
    # another process would take away the write-ahead log of the server that runs here.
    with contextlib.suppress(FileExistsError):
        os.close(os.open(file, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600))
    file.chmod(0o600)


def _engine(url: str) -> Engine:
    if make_url(url).get_backend_name() != "sqlite":
        return create_engine(url, pool_pre_ping=True, hide_parameters=True)
    engine = create_engine(url, connect_args={"timeout": _BUSY_TIMEOUT_S}, hide_parameters=True)

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _record: Any) -> None:
        for pragma in ("journal_mode=WAL", "foreign_keys=ON", "synchronous=NORMAL"):
            connection.execute(f"PRAGMA {pragma}")

    return engine
