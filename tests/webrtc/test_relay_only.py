"""`ice_transport_policy: relay`: without a TURN server that answers there is no path, and both sides say so at once."""

from __future__ import annotations

import asyncio
import re
from typing import Any

import pytest

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer

pytestmark = pytest.mark.webrtc


class Nobody:
    """A listener that hears nothing."""

    congestion = PeerCongestion()

    def __getattr__(self, name: str) -> Any:
        return lambda *_args, **_options: None


@pytest.mark.parametrize("servers", [(), (IceServer(urls=("turn:127.0.0.1:9?transport=tcp",)),)])
async def test_an_offer_without_a_relay_is_refused_with_a_code(servers: tuple[IceServer, ...]) -> None:
    offerer = AiortcOfferer(Nobody(), servers, relay_only=True)
    offerer.create_channel("x")
    try:
        with pytest.raises(ConnectionFailed) as failed:
            await offerer.offer()
        assert failed.value.code == "ice.no_relay"
    finally:
        await offerer.close()


async def test_an_answer_without_a_relay_is_refused_with_a_code() -> None:
    offerer = AiortcOfferer(Nobody(), ())
    answerer = AiortcAnswerer(Nobody(), (), relay_only=True)
    offerer.create_channel("x")
    try:
        sdp, _ = await offerer.offer()
        assert re.search("typ host", sdp)
        with pytest.raises(ConnectionFailed) as failed:
            await answerer.answer(sdp, [], None)
        assert failed.value.code == "ice.no_relay"
    finally:
        await asyncio.gather(offerer.close(), answerer.close())
