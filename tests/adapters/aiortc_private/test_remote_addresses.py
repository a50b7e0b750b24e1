"""No remote candidate makes ICE send to this machine's own loopback, given as an address or as a name, and nobody makes
it keep ever more of them."""

from __future__ import annotations

import inspect
from typing import Any

import aioice.ice
import pytest
from aioice import Candidate, Connection
from aioice.ice import StunProtocol
from aioice.stun import Class, Message, Method

from mosaic_core.adapters.aiortc_private.ice.paths import MAX_PATHS, bound_learned_paths, keep_off_loopback


class Transport:
    def __init__(self) -> None:
        self._connection = Connection(ice_controlling=False)


def candidate(host: str) -> Candidate:
    return Candidate(foundation="1", component=1, transport="udp", priority=1, host=host, port=22, type="host")


@pytest.mark.parametrize("host", ["127.0.0.1", "127.4.5.6", "0.0.0.0", "::1", "::", "::ffff:127.0.0.1"])  # noqa: S104 (nothing is bound)
async def test_an_address_of_the_loopback_is_left_out(host: str) -> None:
    transport: Any = Transport()
    keep_off_loopback(transport)
    await transport._connection.add_remote_candidate(candidate(host))
    assert transport._connection._remote_candidates == []


async def test_any_other_address_is_taken() -> None:
    transport: Any = Transport()
    keep_off_loopback(transport)
    await transport._connection.add_remote_candidate(candidate("192.168.1.5"))
    assert [one.host for one in transport._connection._remote_candidates] == ["192.168.1.5"]


@pytest.mark.parametrize(("address", "count"), [("127.0.0.1", 0), ("192.168.1.5", 1)])
async def test_what_a_name_turns_out_to_be_counts(monkeypatch: pytest.MonkeyPatch, address: str, count: int) -> None:
    class Resolver:
        async def resolve(self, name: str) -> str:
            return address

    async def resolver(subscriber: object) -> Resolver:
        return Resolver()

    monkeypatch.setattr(aioice.ice, "get_or_create_mdns_protocol", resolver)
    transport: Any = Transport()
    keep_off_loopback(transport)
    await transport._connection.add_remote_candidate(candidate("5c3a.local"))
    assert len(transport._connection._remote_candidates) == count


def test_all_candidates_of_the_other_side_pass_one_place() -> None:
    assert list(inspect.signature(Connection._add_remote_candidate).parameters) == [
        "self",
        "remote_candidate",
        "network_host",
    ]
    assert inspect.getsource(aioice.ice).count("._remote_candidates.append(") == 2, "this place, and what is learned"
    assert "._network_host == addr[0]" in inspect.getsource(Connection.check_incoming)


async def test_whoever_asks_from_ever_more_ports_is_a_path_so_often_and_no_more() -> None:
    transport: Any = Transport()
    connection = transport._connection
    connection.check_start_task = lambda pair: None
    bound_learned_paths(transport)
    ours = StunProtocol(connection)
    ours.local_candidate = candidate("192.0.2.1")
    for port in range(1, 3 * MAX_PATHS):
        connection.check_incoming(question(), ("192.0.2.2", port), ours)
    assert len(connection._remote_candidates) == len(connection._check_list) == MAX_PATHS
    connection.check_incoming(question(nominates=True), ("192.0.2.2", 1), ours)
    assert [one.remote_candidate.port for one in connection._check_list if one.remote_nominated] == [1], (
        "known ones go on"
    )


def question(*, nominates: bool = False) -> Message:
    message = Message(message_method=Method.BINDING, message_class=Class.REQUEST)
    message.attributes["PRIORITY"] = 1
    if nominates:
        message.attributes["USE-CANDIDATE"] = None
    return message
