"""Sound between a whole robot and operators over real peer connections: heard, said, refused, cut off."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
import pytest

from mosaic_core import (
    AudioReceivable,
    Sender,
    Sound,
    SoundEncoding,
)
from mosaic_core.adapters.sound.shared_sound import MAX_WAITING, SharedSound, SoundFeed
from mosaic_core.runtime.media.talk_hub import TalkHub
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.transport.media_transport import SoundLabels
from mosaic_core.testing import until

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0
RATE_HZ = 48_000


def tone(number: int, hz: float = 440.0, level: int = 9_000) -> Sound:
    """The piece of 20 ms with this number."""
    time_s = (np.arange(960) + number * 960) / RATE_HZ
    samples = (np.sin(2 * np.pi * hz * time_s) * level).astype(np.int16).reshape(-1, 1)
    return Sound(samples, RATE_HZ, time.monotonic())


def pitch_hz(samples: Any) -> float:
    spectrum = np.abs(np.fft.rfft(samples[:, 0].astype(float)))
    return float(np.fft.rfftfreq(len(samples), 1 / RATE_HZ)[spectrum.argmax()])


class Speaking:
    """Says a tone, or what ``say`` gives, every 20 ms, on a thread of its own as a handler has one."""

    def __init__(self, post: Callable[[Sound], object], hz: float = 440.0) -> None:
        self.hz = hz
        self.posted = 0
        self._post = post
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._speak)
        self._thread.start()

    def _speak(self) -> None:
        began_s = time.monotonic()
        while not self._is_over.wait(max(0.0, began_s + self.posted * 0.02 - time.monotonic())):
            self._post(tone(self.posted, self.hz))
            self.posted += 1

    def end(self) -> None:
        self._is_over.set()
        self._thread.join()


class Loudspeaker(AudioReceivable):
    def __init__(self, label: str = "speaker") -> None:
        super().__init__(label)
        self.heard: list[tuple[Sound, str]] = []
        self.ended = 0

    def handle_sound(self, sound: Sound, sender: Sender) -> None:
        self.heard.append((sound, sender.peer_id))

    def talk_ended(self) -> None:
        self.ended += 1

    def voices(self) -> set[str]:
        return {who for _, who in self.heard}

    def said(self, who: str) -> Any:
        return np.concatenate([sound.samples for sound, said_by in self.heard if said_by == who])


class Guest:
    """One operator: its peer connection, and what the robot refuses it."""

    def __init__(self, peers: Any, name: str, role: str) -> None:
        self.peer_id = name
        self.sender = Sender(name, f"session of {name}", name=name.title(), role=role)
        self.refusals: list[tuple[str, str, str]] = []
        self.voice: Any = None
        self.peers = peers
        self._sound: Any = None

    def refuse(self, label: str, seq: int | None, code: str, message: str = "") -> None:
        self.refusals.append((label, code, message))

    async def hears(self) -> Any:
        """Half a second of what comes, from the first sound on."""
        if self._sound is None:
            label, self._sound = await asyncio.wait_for(self.peers.operator_side.tracks.get(), WAIT_S)
            assert label == "microphone"
        pieces: list[Any] = []
        async with asyncio.timeout(WAIT_S):
            while len(pieces) < 25:
                piece = (await self._sound.next()).samples
                if pieces or np.abs(piece).max() > 1000:
                    pieces.append(piece)
        return np.concatenate(pieces)

    def speak(self, hz: float = 440.0) -> None:
        """On the event loop, as an operator's program does it."""
        self._task = asyncio.create_task(self._speak(hz))

    async def _speak(self, hz: float) -> None:
        for number in range(10_000):
            self.voice.send(tone(number, hz))
            await asyncio.sleep(0.02)

    def pause(self) -> None:
        self._task.cancel()


class House:
    """A robot with a microphone and a loudspeaker, and whom it meets."""

    def __init__(self, pair: Any, stack: Any) -> None:
        self.stream = SharedSound("microphone", SoundEncoding(), ConnectorCounters())
        self.counters = ConnectorCounters()
        self.loudspeaker = Loudspeaker()
        self.talking: list[str | None] = []
        self.hub = TalkHub(lambda label, who: self.talking.append(who.name if who else None))
        self.hub.add_label(self.loudspeaker, Failures("speaker", lambda *failure: None), self.counters)
        self.hub.start_label("speaker")
        self._pair = pair
        self._stack = stack

    async def guest(self, name: str, role: str = "operator") -> Guest:
        peers = await self._stack.enter_async_context(self._pair())
        guest = Guest(peers, name, role)
        peers.robot_side.track_bound = lambda label: self.stream.bind(name, print)
        peers.robot_side.voice_bound = lambda label, sound: self.hub.bind(guest, label, sound)
        peers.operator.add_video("front")
        peers.operator.add_microphone("microphone")
        guest.voice = peers.operator.add_speaker("speaker")
        sdp, tracks = await peers.operator.offer()
        labels = SoundLabels(["microphone"], ["speaker"])
        await peers.operator.accept_answer(await peers.robot.answer(sdp, [], tracks, labels))
        await asyncio.gather(peers.robot_side.reaches("connected"), peers.operator_side.reaches("connected"))
        assert peers.robot_side.unbound == []
        return guest

    def listen(self, guest: Guest, on: bool = True) -> None:
        self.stream.watch(guest.peer_id, on)

    def record(self, hz: float = 440.0) -> Speaking:
        speaking = Speaking(self.stream.offer, hz)
        self._stack.callback(speaking.end)
        return speaking

    async def leaves(self, guest: Guest) -> None:
        """As the robot's peer does at its end."""
        self.hub.leave(guest.peer_id)
        self.stream.leave(guest.peer_id)

    async def close(self) -> None:
        self.hub.close()
        await self.hub.closed()


@pytest.fixture
def house(pair: Any) -> Any:
    from contextlib import AsyncExitStack

    @asynccontextmanager
    async def built() -> AsyncIterator[House]:
        async with AsyncExitStack() as stack:
            place = House(pair, stack)
            stack.push_async_callback(place.close)
            yield place

    return built


# -- robot → operators -----------------------------------------------------------------------------------------------


async def test_several_operators_hear_the_robot_and_it_is_encoded_once(house: Any) -> None:
    async with house() as place:
        ann, bob = await place.guest("ann"), await place.guest("bob")
        place.listen(ann)
        place.listen(bob)
        recorded = place.record(hz=1000)
        for guest in (ann, bob):
            assert pitch_hz(await guest.hears()) == pytest.approx(1000, abs=5)
        assert place.stream._counters.messages <= recorded.posted


async def test_sound_is_taken_out_of_the_budget_while_it_is_sent(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        budget = ann.peers.robot_side.congestion._budget
        assert budget.parts == {}
        place.listen(ann)
        speaking = place.record()
        await ann.hears()
        await until(lambda: budget.parts)
        (share,) = budget.parts.values()
        assert 16_000 < share < 128_000
        await until(lambda: budget._hears_arrivals)
        speaking.end()
        await until(lambda: budget.parts == {})


async def test_no_packet_of_sound_is_repeated_whoever_asks_for_it(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        place.listen(ann)
        speaking = place.record()
        await ann.hears()
        speaking.end()
        (sender,) = (one.sender for one in ann.peers.robot._peer.pc.getTransceivers() if one.mid == "1")
        again: list[bytes] = []

        async def noted(data: bytes) -> None:
            again.append(data)

        sender.transport._send_rtp = noted
        numbers = [packet.sequence_number for packet in sender._RTCRtpSender__rtp_history.values()]
        assert numbers
        for number in numbers:
            await sender._retransmit(number)
        assert again == []


async def test_who_joins_late_hears_what_is_said_now(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        place.listen(ann)
        recorded = place.record(hz=500)
        await ann.hears()
        late = await place.guest("late")
        place.listen(late)
        recorded.hz = 1500
        assert pitch_hz((await late.hears())[-9600:]) == pytest.approx(1500, abs=10)


async def test_nobody_listening_nothing_is_encoded(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        assert not place.stream.offer(tone(0))
        place.listen(ann)
        assert place.stream.offer(tone(0))
        place.listen(ann, False)
        assert not place.stream.offer(tone(0))


async def test_from_the_tone_to_the_operators_ear_it_takes_a_fraction_of_a_second(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        place.listen(ann)
        began_s = time.monotonic()
        place.record()
        await ann.hears()
        # half a second is what it listens; aiortc's receiver holds four packets back, the rest is a busy machine
        assert time.monotonic() - began_s < 0.5 + 2.0


async def test_a_listener_who_takes_nothing_keeps_the_newest_200_ms() -> None:
    feed = SoundFeed()
    packets = [object() for _ in range(3 * MAX_WAITING)]
    dropped = sum(feed.put(packet) for packet in packets)  # type: ignore[arg-type]
    assert dropped == 2 * MAX_WAITING
    assert [await feed.next() for _ in range(MAX_WAITING)] == packets[-MAX_WAITING:]


# -- operators → robot -----------------------------------------------------------------------------------------------


async def test_what_an_operator_says_comes_out_of_the_loudspeaker(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        ann.speak(hz=700)
        await until(lambda: len(place.loudspeaker.heard) > 60)
        said = place.loudspeaker.said("ann")
        assert pitch_hz(said[-RATE_HZ // 2 :]) == pytest.approx(700, abs=5)
        assert {sound.samples.shape[1] for sound, _ in place.loudspeaker.heard} == {2}
        assert place.talking == ["Ann"]


async def test_the_end_of_a_talk_is_told_and_the_device_let_go(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        ann.speak()
        await until(lambda: place.talking == ["Ann"] and place.loudspeaker.heard)
        ann.pause()
        await until(lambda: place.talking == ["Ann", None] and place.loudspeaker.ended == 1)
        ann.speak()
        await until(lambda: place.talking == ["Ann", None, "Ann"])


async def test_of_two_who_talk_the_first_is_heard_and_the_other_is_told_why(house: Any) -> None:
    async with house() as place:
        ann, bob = await place.guest("ann"), await place.guest("bob")
        ann.speak()
        await until(lambda: place.loudspeaker.heard)
        bob.speak(hz=1200)
        await until(lambda: bob.refusals)
        assert bob.refusals == [("speaker", "media.talk_busy", "Ann is talking.")]
        assert place.loudspeaker.voices() == {"ann"}
        ann.pause()
        await until(lambda: "bob" in place.loudspeaker.voices())
        assert place.talking in (["Ann", None, "Bob"], ["Ann", "Bob"])
        assert len(bob.refusals) == 1
        assert place.counters.refused == 1


async def test_observers_are_heard_nowhere(house: Any) -> None:
    async with house() as place:
        eve = await place.guest("eve", role="observer")
        eve.speak()
        await until(lambda: eve.refusals)
        assert eve.refusals[0][1] == "lease.forbidden"
        assert place.loudspeaker.heard == []
        assert place.talking == []


async def test_who_leaves_in_the_middle_of_a_word_is_silent_at_once(house: Any) -> None:
    async with house() as place:
        ann, bob = await place.guest("ann"), await place.guest("bob")
        ann.speak()
        await until(lambda: len(place.loudspeaker.heard) > 10)
        await place.leaves(ann)
        await until(lambda: place.loudspeaker.ended == 1)
        count = len(place.loudspeaker.heard)
        bob.speak()
        await until(lambda: "bob" in place.loudspeaker.voices())
        assert [who for _, who in place.loudspeaker.heard[count:]].count("ann") == 0
        assert place.talking == ["Ann", None, "Bob"]


async def test_a_loudspeaker_that_fails_rests_and_is_heard_again(house: Any) -> None:
    async with house() as place:
        ann = await place.guest("ann")
        play = place.loudspeaker.handle_sound
        failures: list[int] = []

        def broken(sound: Sound, sender: Sender) -> None:
            if not failures:
                failures.append(1)
                raise OSError("unplugged")
            play(sound, sender)

        place.loudspeaker.handle_sound = broken
        ann.speak()
        await until(lambda: place.loudspeaker.heard)
        assert failures == [1]
        assert ann.refusals == [("speaker", "plugin.failed", "")]
        assert place.loudspeaker.ended == 1


# -- lines -----------------------------------------------------------------------------------------------------------


async def test_an_offer_without_audio_lines_leaves_sound_unbound(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("front")
        sdp, _ = await peers.operator.offer()
        labels = SoundLabels(["microphone"], ["speaker"])
        await peers.operator.accept_answer(await peers.robot.answer(sdp, ["front"], None, labels))
        assert peers.robot_side.unbound == ["microphone", "speaker"]
        assert list(peers.robot_side.streams) == ["front"]


async def test_an_audio_line_without_opus_stays_empty(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_microphone("microphone")
        sdp, tracks = await peers.operator.offer()
        poor = "\r\n".join(line.replace(" opus/48000/2", " unknown/48000/2") for line in sdp.splitlines())
        answer = await peers.robot.answer(poor + "\r\n", [], tracks, SoundLabels(["microphone"]))
        assert peers.robot_side.unbound == ["microphone"]
        assert "a=inactive" in answer
