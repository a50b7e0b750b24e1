"""The very path of a connection is measured, by an echo where the robot has one, else by what it acknowledges."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core.doctor import path_trials
from mosaic_core.doctor.path_trials import measured_path
from mosaic_core.doctor.peer_checks import WANTED_PATH_BPS, Speed, speed_finding
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.runtime.handlers.connection_check import ConnectionCheckConfigurer
from mosaic_core.testing import connector, joined

SLOW = LinkProfile("slow", delay_ms=20, rate_mbps=1)


async def measured(network: Any) -> Speed:
    link_check = connector(ConnectionCheckConfigurer, label="link")
    async with asyncio.timeout(30), joined(link_check, network=network) as link:
        path = await measured_path(link.connection)
        assert link.connection.state == "connected"
        return path


async def test_an_echo_tells_of_both_directions(impaired_network: Any) -> None:
    path = await measured(impaired_network(SLOW))
    assert path.way == "there and back"
    assert 0.2e6 < path.throughput_bps < 1.1e6
    assert path.round_trip_ms >= 40


async def test_without_an_echo_acknowledgements_tell_of_the_way_there(
    impaired_network: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(path_trials, "_way_of", path_trials._Unread)
    path = await measured(impaired_network(SLOW))
    assert path.way == "operator to robot"
    assert 0.2e6 < path.throughput_bps < 1.1e6
    assert path.round_trip_ms >= 40


async def test_a_path_on_which_nothing_comes_back_is_a_time_out(
    impaired_network: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(path_trials, "OPEN_TIMEOUT_S", 0.2)

    network = impaired_network(in_memory=True)
    async with joined(connector(ConnectionCheckConfigurer, label="link"), network=network) as link:
        link.cut()
        with pytest.raises((TimeoutError, path_trials.MosaicError)):
            await measured_path(link.connection)


@pytest.mark.parametrize(
    ("speed", "status", "words"),
    [
        (Speed(12.4e6, 31.26), "ok", "The way: 12 Mbit/s, round trip 31.3 ms."),
        (Speed(0.84e6, 31.0), "warn", "The way: 0.8 Mbit/s, round trip 31.0 ms."),
        (Speed(0.84e6, 600.0, is_least=True), "ok", "The way: at least 0.8 Mbit/s, round trip 600.0 ms."),
    ],
)
def test_the_finding_says_how_fast_and_what_to_do(speed: Speed, status: str, words: str) -> None:
    finding = speed_finding("x.y", "The way", speed, WANTED_PATH_BPS, "Look at the radio.")
    assert (finding.status, finding.sentence) == (status, words)
    assert finding.cure == ("Look at the radio." if status == "warn" else "")
    assert finding.facts == {"bps": round(speed.throughput_bps), "roundTripMs": round(speed.round_trip_ms, 2)}
