"""What an offer must have, and which camera goes on which of its lines."""

from __future__ import annotations

import asyncio
import re

import pytest
from aiortc import RTCConfiguration, RTCPeerConnection

from mosaic_core.adapters.peers.offer_vetting import (
    OfferedLine,
    lines_for_labels,
    mids_of,
    refuse_unless_bundled,
    separated_candidates,
    vetted_offer,
    with_fragments,
    without_end_of_candidates,
)
from mosaic_core.words.errors import ConnectionFailed

LINES = (
    OfferedLine("0", "video", True),
    OfferedLine("1", "audio", True),
    OfferedLine("2", "video", False),
    OfferedLine("3", "video", True),
)


@pytest.fixture(scope="module")
def offer() -> str:
    async def make() -> str:
        pc = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        pc.addTransceiver("video", direction="recvonly")
        pc.createDataChannel("x")
        await pc.setLocalDescription()
        sdp = pc.localDescription.sdp
        await pc.close()
        return sdp

    return asyncio.run(make())


def code_of(sdp: str) -> str:
    with pytest.raises(ConnectionFailed) as refused:
        vetted_offer(sdp)
    return refused.value.code


def test_a_good_offer_is_taken_apart(offer: str) -> None:
    vetted = vetted_offer(offer)
    assert [line.kind for line in vetted.lines] == ["video", "application"]
    assert vetted.lines[0].is_wanted
    assert vetted.candidates
    assert vetted.candidates[0].candidate.startswith("candidate:")
    assert vetted.has_all_candidates
    assert vetted.is_bundled
    assert "a=candidate" not in vetted.sdp
    assert "end-of-candidates" not in vetted.sdp
    assert vetted_offer(vetted.sdp).candidates == ()


@pytest.mark.parametrize(
    ("line", "replacement"),
    [
        ("a=ice-ufrag:", "a=x-ice:"), ("a=ice-pwd:", "a=x-ice:"), ("a=fingerprint:", "a=x-print:"),
        ("a=rtcp-mux", "a=x-mux"), ("a=mid:", "a=x-mid:"), ("m=video", "m=smell"),
    ],
)  # fmt: skip
def test_an_offer_that_lacks_something_is_invalid(offer: str, line: str, replacement: str) -> None:
    assert line in offer
    assert code_of(offer.replace(line, replacement)) == "sdp.invalid"


def test_a_line_that_appears_twice_is_invalid(offer: str) -> None:
    assert code_of(offer.replace("a=mid:1", "a=mid:0")) == "sdp.invalid"


def test_a_line_without_a_common_codec_is_refused_alone_and_says_what_was_offered(offer: str) -> None:
    vetted = vetted_offer(offer.replace("VP8/", "VP9/").replace("H264/", "AV1/"))
    [line] = vetted.refused
    assert (line.mid, line.kind, line.offered) == ("0", "video", "VP9, AV1")
    assert not vetted.is_refused
    assert vetted.is_bundled
    assert [it.is_wanted for it in vetted.lines] == [True, False], "its camera is known all the same"
    assert not vetted_offer(vetted.sdp).refused, "aiortc is shown one that it takes"


def test_an_offer_of_which_no_line_is_left_is_refused_as_a_whole(offer: str) -> None:
    pictures_alone = offer[: offer.index("m=application")].replace("BUNDLE 0 1", "BUNDLE 0")
    vetted = vetted_offer(pictures_alone.replace("VP8/", "AV1/").replace("H264/", "AV1/"))
    assert vetted.is_refused


@pytest.mark.parametrize("fmtp", ["", "a=fmtp:97 profile-level-id=42e01f\r\n"])
def test_h264_that_leaves_its_packetization_mode_out_is_taken_for_mode_1(offer: str, fmtp: str) -> None:
    plain = re.sub(r"a=(rtpmap|fmtp|rtcp-fb):.*\r\n", "", offer)
    plain = plain.replace("a=ice-ufrag", f"a=rtpmap:97 H264/90000\r\n{fmtp}a=ice-ufrag", 1)
    completed = vetted_offer(plain).sdp
    assert completed.count("packetization-mode=1") == 1
    assert with_fragments(completed) == completed


def test_h264_of_another_mode_or_profile_is_refused_by_name(offer: str) -> None:
    for said, other in (("packetization-mode=1", "packetization-mode=0"), ("42(00|e0)1f", "640028")):
        text = re.sub(said, other, offer.replace("VP8/", "AV1/"))
        [line] = vetted_offer(text).refused
        assert re.search(rf"H264 \(.*{other.split('=')[-1]}.*; the robot sends VP8", line.cause)


def test_an_answer_that_does_not_bundle_is_refused_with_its_cure(offer: str) -> None:
    refuse_unless_bundled(offer)
    with pytest.raises(ConnectionFailed, match="BUNDLE") as refused:
        refuse_unless_bundled(offer.replace("a=group:BUNDLE 0 1\r\n", ""))
    assert "max-bundle" in refused.value.cure
    refuse_unless_bundled(re.sub(r"m=application \d+", "m=application 0", offer.replace("BUNDLE 0 1", "BUNDLE 0")))


def test_without_a_wish_the_labels_take_the_wanted_lines_in_order() -> None:
    assert lines_for_labels(LINES, ["a", "b", "c"], None) == {"0": "a", "3": "b"}
    assert lines_for_labels(LINES, ["a"], None) == {"0": "a"}


def test_the_operators_wish_counts_where_it_can_be_met() -> None:
    assert lines_for_labels(LINES, ["a", "b"], {"0": "b", "3": "a"}) == {"0": "b", "3": "a"}
    assert lines_for_labels(LINES, ["a", "b"], {"0": "b", "3": "b"}) == {"0": "b"}
    assert lines_for_labels(LINES, ["a"], {"0": "zzz", "1": "a", "2": "a"}) == {}
    assert lines_for_labels(LINES, ["a"], {}) == {}


def test_candidates_keep_the_name_of_their_line() -> None:
    sdp = "v=0\r\nm=audio 9\r\na=candidate:1 x\r\na=mid:zero\r\nm=video 9\r\na=mid:one\r\na=candidate:2 y\r\n"
    text, candidates, has_all = separated_candidates(sdp)
    assert [(c.candidate, c.sdp_mid, c.sdp_m_line_index) for c in candidates] == [
        ("candidate:1 x", "zero", 0),
        ("candidate:2 y", "one", 1),
    ]
    assert not has_all
    assert text == "v=0\r\nm=audio 9\r\na=mid:zero\r\nm=video 9\r\na=mid:one\r\n"
    assert mids_of(sdp) == ["zero", "one"]


def test_our_own_description_can_promise_more_candidates() -> None:
    assert without_end_of_candidates("a=x\r\na=end-of-candidates\r\na=y\r\n") == "a=x\r\na=y\r\n"
