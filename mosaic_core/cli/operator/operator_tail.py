"""``mosaic operator tail``: what a connector sends, on the terminal."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import typer

from mosaic_core.cli.operator.operator_session import connected, store_of, until_closed, wrong_way
from mosaic_core.cli.terminal.error_report import FINE
from mosaic_core.contract.sound import Sound
from mosaic_core.operator import MediaStreamStore, MosaicOperator, ReceivableStore, Received, SoundStore
from mosaic_core.operator.delivery.delivery_watcher import DeliveryWatcher
from mosaic_core.operator.stores.channel_plan import naming
from mosaic_core.words.codes import reason
from mosaic_core.words.control import DeliveryRow
from mosaic_core.words.data_type import MosaicDataType

SILENCE_S = 5.0
"""Most connectors say something every second or two."""


@dataclass(frozen=True, slots=True)
class Tail:
    """The work of ``mosaic operator tail``: prints the messages of one connector."""

    robot: str
    label: str
    count: int | None
    as_json: bool
    data_type: str | None = None

    async def __call__(self, operator: MosaicOperator) -> int:
        with naming(MosaicDataType.JSON_R2U):
            connection = await connected(operator, self.robot, self.label, self.data_type)
            store = store_of(operator, connection, self.label, self.data_type)
        with failures_told(connection.delivery, self.label):
            if isinstance(store, MediaStreamStore):
                if connection.is_original:
                    await store.wait_open()  # one that it does not have never comes, and is said at once
                return await until_closed(connection, self._watch(store))
            if isinstance(store, ReceivableStore):
                with _doubt(store) if connection.is_original else nullcontext():
                    return await until_closed(connection, self._listen(store))
            if isinstance(store, SoundStore):
                return await until_closed(connection, self._hear(store))
        raise wrong_way(self.label, "sends nothing; use `mosaic operator send`")

    async def _listen(self, store: ReceivableStore) -> int:
        left = self.count
        async for received in store.messages():
            if received.info.is_latched and not self.as_json:
                _hint(f"the robot has kept this one for {received.info.age_s or 0.0:.0f} s:")
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

    async def _hear(self, store: SoundStore) -> int:
        lines, loudness = 0, Loudness()
        async for sound in store.sounds():
            if not loudness.took_a_second(sound):
                continue
            level_db = loudness.level_db()
            if self.as_json:
                typer.echo(json.dumps({"label": self.label, "levelDb": level_db}))
            else:
                bar = "▮" * max(0, round((level_db + 60) / 2))
                typer.echo(f"{level_db:6.1f} dB {bar}")
            lines += 1
            if lines == self.count:
                break
        return FINE


@contextmanager
def failures_told(delivery: DeliveryWatcher, label: str) -> Iterator[None]:
    """Says on stderr when the connector fails on its robot, why, and when it is back."""
    told: str | None = None

    def reported(rows: Mapping[str, DeliveryRow]) -> None:
        nonlocal told
        row = rows.get(label)
        code = None if row is None else row.failure_code
        if code == told:
            return
        if code is not None and row is not None:
            why = reason(code)
            again = f"; tried again in {row.tries_again_in_s:.0f} s" if row.tries_again_in_s is not None else ""
            _hint(f"{label!r} has failed: {why.sentence} ({code}){again}. {why.cure}")
        else:
            _hint(f"{label!r} is back")
        told = code

    end = delivery.watch(reported)
    try:
        yield
    finally:
        end()


def _hint(text: str) -> None:
    typer.secho(text, err=True, fg=typer.colors.YELLOW)


@contextmanager
def _doubt(store: ReceivableStore) -> Iterator[None]:
    """An original robot says nothing of a label that it does not have: its silence is mentioned once."""

    def mention() -> None:
        if store.latest is None:
            label = store.robot_connector.connector_id
            hint = "an original robot leaves a label that it does not have unread; compare it with its YAML file"
            _hint(f"nothing came on {label!r} in {SILENCE_S:.0f} s: {hint}")

    timer = asyncio.get_running_loop().call_later(SILENCE_S, mention)
    try:
        yield
    finally:
        timer.cancel()


class Loudness:
    """The level of a second of sound, in dB below full scale; -96 is silence."""

    def __init__(self) -> None:
        self._squares = 0.0
        self._samples = 0

    def took_a_second(self, sound: Sound) -> bool:
        self._squares += float((sound.samples.astype("float64") ** 2).sum())
        self._samples += sound.samples.size
        return self._samples >= sound.rate_hz * int(sound.samples.shape[1])

    def level_db(self) -> float:
        """Of what was taken since the last call."""
        mean = self._squares / max(1, self._samples) / 32768**2
        self._squares, self._samples = 0.0, 0
        return round(10 * math.log10(mean), 1) if mean > 10**-9.6 else -96.0


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
