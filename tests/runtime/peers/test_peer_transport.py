"""An offer is answered through the server that brought it, or it is said why not; candidates follow the answer."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.contract.host import Sender
from mosaic_core.machines.peers.peer_of_robot import AnswerFailed, AnswerMade
from mosaic_core.machines.signaling.peer_admission import PeerIdentity, StartPeer
from mosaic_core.runtime.peers.peer_timeline import PeerTimeline
from mosaic_core.runtime.peers.peer_transport import PeerTransport
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.runtime.signaling.server_link import Introduction
from mosaic_core.runtime.transport.transport import OfferRefused
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import IceCandidate

OURS = IceCandidate(candidate="candidate:1 1 udp 1 10.0.0.1 5000 typ host", sdp_mid="0")
THEIRS = IceCandidate(candidate="candidate:1 1 udp 1 10.0.0.2 5000 typ host", sdp_mid="0")
ANSWER = {"rtcConnectionId": "p1", "sdpAnswer": "answer"}


@dataclass
class Answerer:
    """Finds a candidate while it answers."""

    transport: PeerTransport
    error: Exception | None = None
    meanwhile: Callable[[], None] = lambda: None
    got: list[IceCandidate] = field(default_factory=list)

    async def answer(self, *_: Any) -> str:
        self.transport.candidate_found(OURS)
        self.meanwhile()
        if self.error is not None:
            raise self.error
        return "answer"

    async def add_candidate(self, candidate: IceCandidate) -> None:
        self.got.append(candidate)

    async def close(self) -> None:
        raise RuntimeError("from somewhere deep inside")


class Scene:
    def __init__(self, error: Exception | None = None) -> None:
        self.told: list[dict[str, Any]] = []
        server: Any = SimpleNamespace(signal=lambda message: self.told.append(json.loads(message.to_text())))
        start = StartPeer("p1", PeerIdentity("s"), "offer", None, (), (THEIRS,))
        introduction = Introduction(start, Sender("lan:p1", "lan:s"), server)
        media = SimpleNamespace(microphones=tuple, cameras=tuple)
        site: Any = SimpleNamespace(media=media, talk=SimpleNamespace(labels=tuple))
        self.timeline = PeerTimeline(RemoteOperator(introduction.sender))
        self.transport = PeerTransport(introduction, site, self.timeline)
        self.answerer = Answerer(self.transport, error)

    async def answered(self) -> AnswerMade | AnswerFailed:
        make: Any = lambda listener, ice_servers: self.answerer  # noqa: E731
        listener: Any = None
        return await self.transport.answer(make, listener)

    @property
    def kinds(self) -> list[str]:
        return [message["type"].partition(".")[2] for message in self.told]


async def test_the_answer_comes_first_under_the_servers_own_id_and_then_the_candidates() -> None:
    scene = Scene()
    assert await scene.answered() == AnswerMade()
    assert scene.told[0]["data"] == ANSWER
    assert scene.kinds == ["send_sdp_answer"], "an original dashboard rejects candidates before the answer"
    assert scene.answerer.got == []
    await scene.transport.exchange_candidates()
    assert scene.kinds == ["send_sdp_answer", "exchange_ice_candidate"]
    assert scene.answerer.got == [THEIRS]
    scene.transport.candidate_found(OURS)
    assert scene.kinds[2:] == ["exchange_ice_candidate"]
    assert [mark.moment for mark in scene.timeline.record.marks] == ["offered", "answered", "candidate"]


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (ConnectionFailed("no", code="ice.no_address"), "ice.no_address", []),
        (OfferRefused("none shared", "refused lines"), "sdp.no_common_codec", ["send_sdp_answer"]),
        (RuntimeError("from somewhere deep inside"), "sdp.invalid", []),
    ],
)
async def test_an_offer_that_can_not_be_answered_has_a_code(error: Exception, code: str, told: list[str]) -> None:
    scene = Scene(error)
    outcome = await scene.answered()
    assert isinstance(outcome, AnswerFailed)
    assert outcome.code == code
    assert scene.kinds == told


async def test_nobody_hears_the_answer_of_a_peer_that_ended_meanwhile() -> None:
    scene = Scene()
    scene.answerer.meanwhile = scene.transport.give_up
    await scene.answered()
    await scene.transport.exchange_candidates()
    assert scene.told == []
    assert scene.answerer.got == []
    assert [mark.moment for mark in scene.timeline.record.marks] == ["offered"]


async def test_a_further_offer_waits_for_the_first_answer() -> None:
    scene = Scene()
    with pytest.raises(ConnectionFailed) as caught:
        await scene.transport.answer_again("offer", None)
    assert caught.value.code == "signal.too_slow"
    await scene.answered()
    await scene.transport.exchange_candidates()
    assert await scene.transport.answer_again("offer", None) == "answer"


async def test_an_end_that_fails_is_logged_and_over(caplog: pytest.LogCaptureFixture) -> None:
    scene = Scene()
    await scene.transport.close()
    await scene.answered()
    await scene.transport.close()
    assert "the transport of peer lan:p1 did not close cleanly" in caplog.text
