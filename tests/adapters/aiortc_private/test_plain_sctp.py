"""The switch that leaves data channels to aiortc's own SCTP."""

from __future__ import annotations

import asyncio

import pytest
from aiortc import RTCBundlePolicy
from aiortc.rtcsctptransport import RTCSctpTransport

from mosaic_core.adapters.aiortc_private.sctp.quick_sctp import QuickSctp
from mosaic_core.adapters.peers.aiortc_peer import PLAIN_SCTP_VARIABLE, AiortcPeer


@pytest.mark.parametrize(
    ("value", "kind"), [("1", RTCSctpTransport), ("0", QuickSctp), ("", QuickSctp), (None, QuickSctp)]
)
def test_only_a_one_leaves_the_transport_what_aiortc_made_it(
    value: str | None, kind: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    if value is None:
        monkeypatch.delenv(PLAIN_SCTP_VARIABLE, raising=False)
    else:
        monkeypatch.setenv(PLAIN_SCTP_VARIABLE, value)

    async def described() -> type:
        peer = AiortcPeer((), RTCBundlePolicy.MAX_BUNDLE, lambda candidate: None, lambda state: None, lambda why: None)
        try:
            peer.pc.createDataChannel("events")
            await peer.describe_locally()
            return type(peer.pc.sctp)
        finally:
            await peer.close()

    assert asyncio.run(asyncio.wait_for(described(), 20)) is kind
