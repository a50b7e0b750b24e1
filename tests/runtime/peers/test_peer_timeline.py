"""The robot's side of a set-up: one line of the log when it failed, one for a camera that gives nothing."""

from __future__ import annotations

import logging

import pytest

from mosaic_core.contract.host import Sender
from mosaic_core.laboratory.joining import until
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.peers import peer_timeline
from mosaic_core.runtime.peers.peer_timeline import PeerTimeline
from mosaic_core.runtime.peers.remote_operator import RemoteOperator

PATH = ChosenPath("host", "srflx", "udp", "10.0.0.2:5000", "198.51.100.7:6000")


def timeline() -> PeerTimeline:
    return PeerTimeline(RemoteOperator(Sender("p1", "s1", name="Ann")))


def test_a_connection_that_never_came_up_is_told_in_one_line_without_addresses(
    caplog: pytest.LogCaptureFixture,
) -> None:
    it = timeline()
    it.mark("answered")
    it.transport_changed("connecting", None)
    it.transport_changed("securing", PATH)
    with caplog.at_level(logging.WARNING):
        it.ended("dtls.timeout", was_connected=False)
    [line] = caplog.messages
    assert "Ann" in line
    assert "dtls.timeout" in line
    assert "answered" in line
    assert "198.51.100.7" not in line
    assert it.record.marks[-1].detail == PATH.summary()


def test_a_connection_that_was_up_needs_no_such_line(caplog: pytest.LogCaptureFixture) -> None:
    it = timeline()
    it.transport_changed("connected", None)
    assert [one.moment for one in it.record.marks] == ["offered", "ice", "dtls"]
    it.ended("peer.lost", was_connected=True)
    assert caplog.messages == []


async def test_a_camera_that_gives_nothing_is_told_once_and_one_that_does_is_not(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(peer_timeline, "FIRST_FRAME_TIMEOUT_S", 0.01)

    with caplog.at_level(logging.WARNING):
        it = timeline()
        for label in ("front", "rear", "side"):
            it.watched(label, True)
        it.frame_sent("front")
        it.watched("front", True)
        it.watched("side", False)
        await until(lambda: bool(caplog.messages))
        it.watched("rear", False)
        it.ended("peer.closed", was_connected=True)
    [line] = caplog.messages
    assert "rear" in line
    assert "media.not_sent" in line
