"""Work on the database ends before the database does."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from sqlalchemy import text
from sqlalchemy.orm import Session

from mosaic_server.storage.database import Database


def test_closing_waits_for_work_that_nobody_awaits_any_more(tmp_path: Path) -> None:
    database = Database(tmp_path / "data")
    begun, may_end = threading.Event(), threading.Event()
    answers: list[int] = []

    def work(session: Session) -> None:
        begun.set()
        assert may_end.wait(10)
        answers.append(session.execute(text("select 7")).scalar_one())

    async def abandoned() -> None:
        task = asyncio.create_task(database.run(work))
        await asyncio.to_thread(begun.wait, 10)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(abandoned())
    closing = threading.Thread(target=database.close)
    closing.start()
    may_end.set()
    closing.join(10)
    assert not closing.is_alive()
    assert answers == [7]


def test_a_server_and_commands_that_begin_at_once_make_the_tables_once(tmp_path: Path) -> None:
    databases = [Database(tmp_path) for _ in range(4)]
    with ThreadPoolExecutor(len(databases)) as pool:
        for made in [pool.submit(database.migrate) for database in databases]:
            made.result()
    for database in databases:
        with database.engine.connect() as connection:
            assert connection.execute(text("SELECT count(*) FROM organization")).scalar() == 0
        database.close()
