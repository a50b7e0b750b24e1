"""One line is refused, the others are what they were."""

from __future__ import annotations

import pytest

from mosaic_core.adapters.peers.refused_lines import (
    RefusedLine,
    is_given_up,
    nothing_but_refusals,
    refused_line,
    sections,
    with_idle_lines,
    with_refusals,
)

SESSION = ["v=0", "s=-", "a=group:BUNDLE 0 1 2"]
VP9 = [
    "m=video 9 UDP/TLS/RTP/SAVPF 98 99",
    "a=ice-ufrag:u",
    "a=mid:0",
    "a=rtpmap:98 VP9/90000",
    "a=rtpmap:99 rtx/90000",
]
VP8 = ["m=video 9 UDP/TLS/RTP/SAVPF 96", "a=ice-ufrag:u", "a=ice-pwd:p", "a=mid:1", "a=rtpmap:96 VP8/90000"]
DATA = ["m=application 9 UDP/DTLS/SCTP webrtc-datachannel", "a=ice-ufrag:u", "a=mid:2"]


def text(*parts: list[str]) -> str:
    return "\r\n".join(line for part in parts for line in part) + "\r\n"


@pytest.fixture
def refused() -> RefusedLine:
    return refused_line(VP9, "0", "video", "VP9")


def test_aiortc_is_shown_an_idle_line_on_the_transport_of_a_live_one(refused: RefusedLine) -> None:
    shown = sections(with_idle_lines(text(SESSION, VP9, VP8, DATA), [refused]))
    assert shown[0] == ["v=0", "s=-", "a=group:BUNDLE 0 1 2"], "in the order of the lines"
    assert shown[2:] == [VP8, DATA]
    assert {"a=mid:0", "a=inactive", "a=rtcp-mux", "a=rtpmap:98 VP8/90000", "a=ice-ufrag:u", "a=ice-pwd:p"} < set(
        shown[1]
    )
    assert shown[1][0] == "m=video 9 UDP/TLS/RTP/SAVPF 98"


def test_without_a_bundle_the_idle_line_shares_the_transport_of_the_first_live_one(refused: RefusedLine) -> None:
    shown = with_idle_lines(text(SESSION[:2], VP9, VP8, DATA), [refused])
    assert "a=group:BUNDLE 0 1\r\n" in shown


def test_the_answer_refuses_it_with_port_zero_and_leaves_it_out_of_the_bundle(refused: RefusedLine) -> None:
    answer = sections(with_refusals(text(SESSION, [*VP8[:1], "a=mid:0"], VP8, DATA), [refused]))
    assert answer[0] == ["v=0", "s=-", "a=group:BUNDLE 1 2"]
    assert answer[1][0] == "m=video 0 UDP/TLS/RTP/SAVPF 98 99"
    assert {"a=mid:0", "a=inactive", "a=rtpmap:98 VP9/90000"} < set(answer[1])
    assert answer[2:] == [VP8, DATA]


def test_an_offer_and_an_answer_without_refusals_stay_what_they_are() -> None:
    whole = text(SESSION, VP8, DATA)
    assert with_idle_lines(whole, []) == whole
    assert with_refusals(whole, []) == whole


def test_an_answer_of_refusals_alone_is_a_whole_description(refused: RefusedLine) -> None:
    session, line = sections(nothing_but_refusals([refused]))
    assert [it[:2] for it in session] == ["v=", "o=", "s=", "t="]
    assert line[0].startswith("m=video 0 ")


def test_a_line_with_port_zero_is_given_up_unless_it_is_bundled() -> None:
    assert is_given_up(["m=video 0 UDP/TLS/RTP/SAVPF 96", "a=mid:0"])
    assert not is_given_up(["m=video 0 UDP/TLS/RTP/SAVPF 96", "a=bundle-only"])
    assert not is_given_up(VP8)
