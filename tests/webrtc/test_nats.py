"""Robot and operator behind NATs in user space: ICE has to find the way, or fail with the right code."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message, NoParams
from mosaic_core.machines.laboratory.nat import NatKind
from mosaic_core.testing import connector, joined
from mosaic_core.words.errors import ConnectionFailed

pytestmark = pytest.mark.webrtc


class Tick(Message):
    number: int


class Ticking(DataChannelSendable[Tick]):
    def messages(self) -> Iterator[Tick]:
        for number, _ in enumerate(self.every(0.02)):
            yield Tick(number=number)


class TickingConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "ticking"

    def configure(self) -> Ticking:
        return Ticking(self.label)


async def way(network: Any) -> str:
    """Connects, waits for data, and tells by which kinds of candidates."""
    async with asyncio.timeout(30), joined(connector(TickingConfigurer, label="tick"), network=network) as link:
        await link.connection.receivable("tick").next_message()
        path = link.connection._peer.offerer.path()
        assert path is not None
        return f"{path.local_type} {path.remote_type}"


@pytest.mark.parametrize(
    ("robot", "operator"),
    [
        ("full-cone", "port-restricted"),
        ("port-restricted", "full-cone"),
        ("address-restricted", "port-restricted"),
        ("symmetric", "address-restricted"),
        ("full-cone", "symmetric"),
    ],
)
async def test_they_meet_through_stun_where_the_nats_allow_it(
    impaired_network: Any, robot: NatKind, operator: NatKind
) -> None:
    assert "relay" not in await way(impaired_network(nat=(robot, operator), with_relay=False))


async def test_behind_symmetric_nats_they_meet_at_the_relay(impaired_network: Any) -> None:
    assert await way(impaired_network("starlink", nat="symmetric")) == "relay relay"


@pytest.mark.parametrize("robot", ["symmetric", "port-restricted"])
async def test_without_a_relay_they_cannot_meet_and_the_code_says_so(
    impaired_network: Any, robot: NatKind, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mosaic_core.laboratory import joining

    monkeypatch.setattr(joining, "PATIENCE_S", 3.0)
    with pytest.raises(ConnectionFailed) as failed:
        await way(impaired_network(nat=(robot, "symmetric"), with_relay=False))
    assert failed.value.code in ("ice.timeout", "ice.failed")
