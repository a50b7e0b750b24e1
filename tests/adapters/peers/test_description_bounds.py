"""What a stranger's session description may have at most, so that reading it never holds up the event loop."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from unittest.mock import Mock

import pytest

from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.adapters.peers.description_bounds import (
    MAX_CODECS,
    MAX_FEEDBACK_OF_ALL,
    MAX_LINES,
    MAX_SECTION_LINES,
    refuse_beyond_bounds,
)
from mosaic_core.adapters.peers.offer_vetting import vetted_offer
from mosaic_core.words.errors import ConnectionFailed

SESSION = ("v=0", "o=- 1 1 IN IP4 127.0.0.1", "s=-", "t=0 0")
MEDIA = (
    "m=video 9 UDP/TLS/RTP/SAVPF 97", "c=IN IP4 0.0.0.0", "a=rtcp-mux", "a=ice-ufrag:u", "a=ice-pwd:p",
    "a=fingerprint:sha-256 00", "a=setup:actpass", "a=rtpmap:97 VP8/90000",
)  # fmt: skip


def described(said: Iterable[str] = (), count: int = 1, session: Iterable[str] = ()) -> str:
    """``count`` media lines, of which the first one says more."""
    first, *others = ((*MEDIA, f"a=mid:{number}") for number in range(count))
    return "".join(f"{line}\r\n" for section in ((*SESSION, *session), (*first, *said), *others) for line in section)


def lines(count: int, line: str) -> list[str]:
    return [line.format(number) for number in range(count)]


def why_not(text: str) -> str:
    with pytest.raises(ConnectionFailed) as refused:
        vetted_offer(text)
    assert refused.value.code == "sdp.invalid"
    return refused.value.message


SAID = "The session description says too much: "
CODECS = lines(MAX_CODECS, "a=rtpmap:{} H264/90000")
ALL = lines(MAX_FEEDBACK_OF_ALL + 1, "a=rtcp-fb:* {}")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (described(CODECS), "media line 0 may have 128 codecs, here are 129"),
        (described(lines(MAX_SECTION_LINES, "a=ssrc:{} cname:x")), "may be described in 512 lines, here are 521"),
        (described(session=lines(MAX_SECTION_LINES, "a=x:{}")), "the session may be described in 512 lines"),
        (described(ALL), "media line 0 may have 16 lines a=rtcp-fb:*, here are 17"),
        (described(count=MAX_LINES + 1), "a connection has 128 media lines at most, this one 129"),
    ],
)
def test_an_offer_that_would_hold_up_everybody_is_refused_before_it_is_read(text: str, why: str) -> None:
    message = why_not(text)
    assert message.startswith(SAID)
    assert why in message


def test_what_a_browser_says_is_within_the_bounds() -> None:
    """Four times a line of Chromium 156."""
    said = [*CODECS[1:], *lines(308, "a=rtcp-fb:97 {}"), *ALL[1:], *lines(50, "a=fmtp:97 x={}")]
    assert len(vetted_offer(described(said, MAX_LINES)).lines) == MAX_LINES


def test_candidates_are_no_fault_however_many_they_are() -> None:
    many = lines(2 * MAX_SECTION_LINES, "a=candidate:1 1 udp 1 192.0.2.1 {} typ host")
    refuse_beyond_bounds(described(many))


async def test_an_operator_is_as_careful_with_a_robots_answer() -> None:
    listener: Any = Mock()
    offerer = AiortcOfferer(listener, ())
    with pytest.raises(ConnectionFailed, match=SAID):
        await offerer.accept_answer(described(CODECS))
    await offerer.close()
