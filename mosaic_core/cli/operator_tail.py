"""``mosaic operator tail``: what a connector sends, on the terminal."""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass
from typing import Any

import typer

from mosaic_core.cli.error_report import FINE
from mosaic_core.cli.operator_session import connected, store_of, until_closed, wrong_way
from mosaic_core.operator import MediaStreamStore, MosaicOperator, ReceivableStore, Received


@dataclass(frozen=True, slots=True)
class Tail:
    """``mosaic operator tail``."""

    robot: str
    label: str
    count: int | None
    as_json: bool

    async def __call__(self, operator: MosaicOperator) -> int:
        connection = await connected(operator, self.robot)
        store = store_of(operator, connection, self.label)
        if isinstance(store, MediaStreamStore):
            return await until_closed(connection, self._watch(store))
        if isinstance(store, ReceivableStore):
            return await until_closed(connection, self._listen(store))
        raise wrong_way(self.label, "sends nothing; use `mosaic operator send`")

    async def _listen(self, store: ReceivableStore) -> int:
        left = self.count
        async for received in store.messages():
            typer.echo(_as_json(self.label, received) if self.as_json else _as_text(received.data))
            left = None if left is None else left - 1
            if left == 0:
                break
        return FINE

    async def _watch(self, store: MediaStreamStore) -> int:
        lines, seen = 0, store.received_frames
        while self.count is None or lines < self.count:
            await asyncio.sleep(1.0)
            frame, frames = store.latest_frame, store.received_frames - seen
            seen += frames
            size = (frame.width, frame.height) if frame is not None else (0, 0)
            if self.as_json:
                typer.echo(json.dumps({"label": self.label, "width": size[0], "height": size[1], "fps": frames}))
            else:
                typer.echo(f"{size[0]}×{size[1]}, {frames} frames/s" if frame is not None else "no picture yet")
            lines += 1
        return FINE


def _as_text(data: bytes) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError:
        shown = data[:32].hex(" ")
        return f"{len(data)} bytes: {shown}{' …' if len(data) > 32 else ''}"


def _as_json(label: str, received: Received) -> str:
    info = received.info
    try:
        value: Any = received.json()
    except ValueError:
        value = _as_text(received.data)
    line = {"label": label, "seq": info.seq, "stampUs": info.stamp_us, "ageS": info.age_s, "latched": info.is_latched}
    return json.dumps({**line, "data": value}, ensure_ascii=False)
