"""A program that hears a robot and talks to it, all in memory."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, ClassVar

import numpy as np
import pytest
from support.connectors import Camera

from mosaic_core import (
    AudioReceivable,
    AudioTrackHandler,
    MediaTrackConfigurer,
    NoParams,
    Sender,
    Sound,
)
from mosaic_core.operator import MediaStreamStore, SoundStore, VoiceStore
from mosaic_core.operator.stores.media_store import QUEUED_SOUNDS
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.testing import connector, joined, until
from mosaic_core.words.data_type import Direction, Kind, MosaicDataType
from mosaic_core.words.errors import ConnectionFailed


def piece(level: int = 1000) -> Sound:
    return Sound(np.full((960, 2), level, np.int16), 48_000, time.monotonic())


class Microphone(AudioTrackHandler):
    runs_now: ClassVar[int] = 0

    async def sounds(self) -> AsyncIterator[Sound]:
        Microphone.runs_now += 1
        try:
            async for _ in self.every(0.01):
                yield piece()
        finally:
            Microphone.runs_now -= 1


class Loudspeaker(AudioReceivable):
    heard: ClassVar[list[Any]] = []

    def handle_sound(self, sound: Sound, sender: Sender) -> None:
        self.heard.append((int(sound.samples[0, 0]), sender.name))

    def talk_ended(self) -> None:
        self.heard.append("end")


class MicrophoneConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "mic"

    def configure(self) -> Microphone:
        return Microphone(self.label)


class LoudspeakerConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "horn"

    def configure(self) -> Loudspeaker:
        return Loudspeaker(self.label)


class CameraConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "cam"

    def configure(self) -> Camera:
        return Camera(self.label)


ROBOT = (
    connector(MicrophoneConfigurer, label="cabin"),
    connector(CameraConfigurer, label="front"),
    connector(LoudspeakerConfigurer, label="horn"),
)


@asynccontextmanager
async def with_robot() -> AsyncIterator[Any]:
    Loudspeaker.heard.clear()
    async with joined(*ROBOT) as link:
        yield link


async def test_the_catalogue_says_sound_and_which_way() -> None:
    async with with_robot() as link:
        entries = {one.label: one for one in link.connection.catalogue.entries}
        assert (entries["cabin"].kind, entries["cabin"].direction) == (Kind.AUDIO, Direction.TO_OPERATOR)
        assert (entries["horn"].kind, entries["horn"].direction) == (Kind.AUDIO, Direction.TO_ROBOT)
        assert {one.data_type for one in entries.values()} == {MosaicDataType.MEDIA}
        assert entries["cabin"].channels == entries["horn"].channels == ()


async def test_the_microphone_runs_while_its_store_exists() -> None:
    async with with_robot() as link:
        assert Microphone.runs_now == 0
        store = link.connection.microphone("cabin")
        heard = [sound async for sound in take(store, 3)]
        assert heard[0].samples[0, 0] == 1000
        assert store.received_sounds >= 3
        link.operator.stores.release_store(store.robot_connector)
        await until(lambda: Microphone.runs_now == 0)


async def take(store: SoundStore, count: int) -> AsyncIterator[Sound]:
    async for sound in store.sounds():
        yield sound
        count -= 1
        if count == 0:
            return


async def test_what_is_said_comes_out_and_everybody_hears_who_talks() -> None:
    async with with_robot() as link:
        store = link.connection.speaker("horn")
        await store.wait_open()
        for _ in range(5):
            assert store.send_sound(piece(2000))
            await asyncio.sleep(0.02)
        await until(lambda: store.talker is not None)
        name = store.talker
        await until(lambda: Loudspeaker.heard and Loudspeaker.heard[-1] == "end")
        played = [one for one in Loudspeaker.heard if one != "end" and one[0]]
        assert set(played) == {(2000, name)}
        await until(lambda: store.talker is None)


async def test_the_stores_of_sound_are_of_their_own_kind() -> None:
    async with with_robot() as link:
        with pytest.raises(ConnectionFailed, match="'cabin' has a SoundStore, not a MediaStreamStore"):
            link.connection.media("cabin")
        with pytest.raises(ConnectionFailed, match="'horn' has a VoiceStore, not a SoundStore"):
            link.connection.microphone("horn")
        with pytest.raises(ConnectionFailed, match="'front' has a MediaStreamStore, not a VoiceStore"):
            link.connection.speaker("front")


async def test_a_picture_store_made_blindly_for_sound_says_what_to_do() -> None:
    async with with_robot() as link:
        connector = RobotConnector(link.connection.robot_id, "cabin", MosaicDataType.MEDIA)
        store = link.operator.stores.get_or_create_store(connector, MediaStreamStore)
        assert store.state.phase == "mismatch"
        assert "sound" in store.state.message


async def test_a_voice_without_a_connection_is_told_that_it_is_not_heard() -> None:
    store = VoiceStore(RobotConnector("robot", "horn"))
    assert not store.send_sound(piece())


async def test_who_listens_too_slowly_loses_the_oldest() -> None:
    store = SoundStore(RobotConnector("robot", "cabin"))
    sounds = store.sounds()
    first = asyncio.ensure_future(anext(sounds))
    await asyncio.sleep(0)
    store.sound_arrived(piece(0))
    await first
    for level in range(1, 3 * QUEUED_SOUNDS):
        store.sound_arrived(piece(level))
    assert int((await anext(sounds)).samples[0, 0]) == 2 * QUEUED_SOUNDS
    await sounds.aclose()  # type: ignore[attr-defined]


async def test_a_connection_that_ends_in_the_middle_of_a_word_is_silent_at_once() -> None:
    async with with_robot() as link:
        store = link.connection.speaker("horn")
        await store.wait_open()
        for _ in range(8):
            store.send_sound(piece(3000))
        await until(lambda: any(one != "end" and one[0] == 3000 for one in Loudspeaker.heard))
        await link.connection.close()
        await until(lambda: Loudspeaker.heard[-1] == "end")
        assert Loudspeaker.heard.count("end") == 1
        assert (
            len(Loudspeaker.heard) < 8 + 1
        )  # the rest of what was said, and the half second of silence, are not played
        assert store.talker is None
        assert not store.send_sound(piece())
