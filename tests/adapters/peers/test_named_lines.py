"""Which label a robot gave to which line is read from its answer, and from nothing that only looks like it."""

from __future__ import annotations

import pytest

from mosaic_core.adapters.peers.aiortc_offerer import named_lines

HEAD = "v=0\r\no=- 1 2 IN IP4 0.0.0.0\r\ns=-\r\nt=0 0\r\na=msid-semantic: WMS\r\n"


def section(*lines: str, kind: str = "video") -> str:
    return "\r\n".join([f"m={kind} 9 UDP/TLS/RTP/SAVPF 96", *lines]) + "\r\n"


def test_each_line_has_the_label_that_the_robot_wrote_there() -> None:
    sdp = HEAD + section("a=mid:0", "a=msid:front front") + section("a=msid:rear rear", "a=mid:1")
    assert named_lines(sdp) == {"0": "front", "1": "rear"}


@pytest.mark.parametrize(
    "lines",
    [
        ("a=mid:0",),
        ("a=mid:0", "a=msid:-"),
        ("a=mid:0", "a=msid:user123@host webrtctransceiver0"),
        ("a=msid:front front",),
        ("a=mid:0", "a=msid:"),
    ],
)
def test_who_names_no_label_gets_none(lines: tuple[str, ...]) -> None:
    assert named_lines(HEAD + section(*lines)) == {}


def test_a_line_of_the_session_names_nothing() -> None:
    assert named_lines(HEAD + "a=mid:0\r\na=msid:front front\r\n" + section("a=mid:0", kind="application")) == {}
