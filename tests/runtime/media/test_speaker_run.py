"""A loudspeaker's thread: it plays whoever has the floor, falls silent at once, and rests after an error."""

from __future__ import annotations

import threading
import time
from collections.abc import AsyncIterator

import numpy as np
import pytest

from mosaic_core import AudioReceivable, Sender
from mosaic_core.contract.sound import Sound
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.machines.timing.failure_course import FailureCourse
from mosaic_core.runtime.media.speaker_run import SpeakerRun
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.transport.media_transport import HeardSound
from mosaic_core.testing import until

ANN, BOB = Sender("ann", "ann"), Sender("bob", "bob")
STEP, RATE_HZ = 960, 48_000
REST_S = 60.0


class Speaker(AudioReceivable):
    """Notes what it is given: who spoke, and how loud; ``None``: nobody talks any more."""

    def __init__(self) -> None:
        super().__init__("speaker")
        self.heard: list[tuple[str, int] | None] = []
        self.error: BaseException | None = None
        self.thread = threading.current_thread()

    def handle_sound(self, sound: Sound, sender: Sender) -> None:
        self.thread = threading.current_thread()
        if self.error is not None:
            raise self.error
        self.heard.append((sender.peer_id, int(sound.samples[0, 0])))

    def talk_ended(self) -> None:
        self.heard.append(None)


class Studio:
    """A running loudspeaker, and the failures that were told."""

    def __init__(self) -> None:
        self.speaker = Speaker()
        self.told: list[BaseException] = []
        course = FailureCourse(BackoffPolicy(first_s=REST_S, max_s=REST_S))
        failures = Failures("speaker", lambda label, error, s: self.told.append(error), course)
        self.run = SpeakerRun(self.speaker, failures)

    def say(self, *loudness: int, sender: Sender = ANN, first: int = 0) -> list[bool]:
        return [
            self.run.put(
                HeardSound((first + place) * STEP, Sound(np.full((STEP, 2), value, np.int16), RATE_HZ, 0.0), False),
                sender,
            )
            for place, value in enumerate(loudness)
        ]


@pytest.fixture
async def studio() -> AsyncIterator[Studio]:
    made = Studio()
    made.run.start()
    yield made
    made.run.close()
    await made.run.closed()


async def test_what_is_said_is_played_in_order_on_a_thread_of_its_own_and_then_the_talk_is_over(studio: Studio) -> None:
    assert studio.say(1, 2, 3, 4, 5, 6) == [True] * 6
    await until(lambda: None in studio.speaker.heard, "the talk is over")
    played = [one for one in studio.speaker.heard if one and one[1]]
    assert played == [("ann", loudness) for loudness in (1, 2, 3, 4, 5, 6)]
    assert studio.speaker.heard.count(None) == 1
    assert studio.speaker.heard[-1] is None
    assert studio.speaker.thread is not threading.current_thread()


async def test_sound_is_played_at_its_own_pace_however_fast_it_comes(studio: Studio) -> None:
    start_s = time.monotonic()
    studio.say(*range(1, 11))
    await until(lambda: ("ann", 10) in studio.speaker.heard, "the last piece is played")
    assert time.monotonic() - start_s >= 9 * STEP / RATE_HZ - 0.01


async def test_who_loses_the_floor_is_not_heard_any_more_and_the_next_one_is(studio: Studio) -> None:
    studio.say(*range(1, 11))
    await until(lambda: studio.speaker.heard, "the talk begins")
    studio.run.silence()
    await until(lambda: None in studio.speaker.heard, "the talk is over")
    assert ("ann", 10) not in studio.speaker.heard
    studio.say(21, 22, 23, 24, 25, 26, sender=BOB)
    await until(lambda: ("bob", 26) in studio.speaker.heard, "the next one is heard")
    after = studio.speaker.heard[studio.speaker.heard.index(None) + 1 :]
    assert all(one is None or one[0] == "bob" for one in after)


async def test_silence_where_nobody_talks_ends_nothing(studio: Studio) -> None:
    studio.run.silence()
    studio.say(1, 2, 3, 4, 5, 6)
    await until(lambda: ("ann", 6) in studio.speaker.heard, "it is played")
    assert studio.speaker.heard[0] == ("ann", 1)


async def test_an_error_is_told_the_talk_is_over_and_nothing_is_taken_while_it_rests(studio: Studio) -> None:
    assert studio.run.failure is None
    studio.speaker.error = SystemExit("no device")
    studio.say(1, 2, 3, 4, 5, 6)
    await until(lambda: studio.run.failure, "it has failed")
    assert studio.run.failure == ("plugin.failed", "")
    await until(lambda: studio.speaker.heard == [None], "the device is let go")
    assert studio.told == [studio.speaker.error]
    assert studio.say(7, first=6) == [False]


async def test_closing_ends_a_talk_and_the_thread() -> None:
    studio = Studio()
    studio.run.start()
    studio.say(*range(1, 11))
    await until(lambda: studio.speaker.heard, "the talk begins")
    studio.run.close()
    await studio.run.closed()
    studio.speaker.thread.join(5)  # it has said so with its last words
    assert not studio.speaker.thread.is_alive()
    assert studio.speaker.heard[-1] is None
    assert ("ann", 10) not in studio.speaker.heard
