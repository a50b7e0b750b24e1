"""Writes announced catalogues to the database, one after another and only the newest of each robot."""

from __future__ import annotations

import asyncio
import logging

from sqlalchemy.exc import SQLAlchemyError

from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.wire_model import to_json
from mosaic_server.storage.database import Database
from mosaic_server.storage.robots import keep_catalogue

_log = logging.getLogger(__name__)


class CatalogueKeeper:
    """Keeps the newest catalogue of each robot. Event-loop thread; the database work happens on a worker thread."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._waiting: dict[str, Catalogue] = {}
        self._task: asyncio.Task[None] | None = None

    def keep(self, robot_id: str, catalogue: Catalogue) -> None:
        self._waiting[robot_id] = catalogue
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._write())

    async def drain(self) -> None:
        """Wait until everything is written."""
        if self._task is not None:
            await self._task

    async def _write(self) -> None:
        while self._waiting:
            robot_id, catalogue = self._waiting.popitem()
            try:
                await self._database.run(keep_catalogue, robot_id, to_json(catalogue.wire()))
            except SQLAlchemyError as error:
                _log.warning("the catalogue of robot %s could not be kept: %s", robot_id, error)
