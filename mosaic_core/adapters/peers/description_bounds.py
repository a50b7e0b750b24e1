"""Bounds what a session description of a stranger may have. aiortc looks for the codec of each format line, for the
source of each line about one, and for all codecs of each feedback line among all that came before: a quarter of a
megabyte of such lines, which a server passes on, would hold the event loop for minutes.
"""

from __future__ import annotations

from collections.abc import Sequence

from mosaic_core.adapters.peers.refused_lines import sections
from mosaic_core.words.errors import ConnectionFailed

MAX_LINES = 128
"""Media lines of one connection: each costs a sender and a receiver."""
MAX_SECTION_LINES = 512
"""What is said of one media line, candidates apart, of which many are no fault; a browser says 170."""
MAX_CODECS = 128
"""Of one media line: a payload type has seven bits (RFC 3550 §5.1)."""
MAX_FEEDBACK_OF_ALL = 16
"""Lines about one media line's feedback that count for all of its codecs (RFC 4585 §4.2)."""


def refuse_beyond_bounds(text: str) -> None:
    """Raises :class:`ConnectionFailed` (``sdp.invalid``), in a time that grows no faster than ``text``."""
    session, *media = sections(text)
    if len(media) > MAX_LINES:
        raise _too_much(f"a connection has {MAX_LINES} media lines at most, this one {len(media)}")
    for number, section in enumerate((session, *media)):
        _refuse_beyond_bounds(f"media line {number - 1}" if number else "the session", section)


def _refuse_beyond_bounds(what: str, section: Sequence[str]) -> None:
    count = len(section) - _counted(section, "a=candidate:")
    if count > MAX_SECTION_LINES:
        raise _too_much(f"{what} may be described in {MAX_SECTION_LINES} lines, here are {count}")
    if (count := _counted(section, "a=rtpmap:")) > MAX_CODECS:
        raise _too_much(f"{what} may have {MAX_CODECS} codecs, here are {count}")
    if (count := _counted(section, "a=rtcp-fb:*")) > MAX_FEEDBACK_OF_ALL:
        raise _too_much(f"{what} may have {MAX_FEEDBACK_OF_ALL} lines a=rtcp-fb:*, here are {count}")


def _counted(section: Sequence[str], start: str) -> int:
    return sum(line.startswith(start) for line in section)


def _too_much(why: str) -> ConnectionFailed:
    return ConnectionFailed(f"The session description says too much: {why}.", code="sdp.invalid")
