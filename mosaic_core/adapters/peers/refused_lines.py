"""Media lines of an offer that the robot can't serve, refused one by one, while the rest of the connection lives.

aiortc refuses the whole offer for one line without a common codec. So it is shown an offer whose refused lines are
idle ones of a codec that it has; in its answer they are then refused as RFC 8829 §5.3.1 wants it: with port 0.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

OUR_CODECS = {"video": "VP8 and H.264 (packetization-mode 1, profile 42001f or 42e01f)", "audio": "Opus"}
_IDLE_CODEC = {"video": "VP8/90000", "audio": "opus/48000/2"}
_OF_TRANSPORT = ("a=ice-ufrag:", "a=ice-pwd:", "a=ice-options:", "a=fingerprint:", "a=setup:")
_BUNDLE = "a=group:BUNDLE"


@dataclass(frozen=True, slots=True)
class RefusedLine:
    """A media line of an offer that the robot refused. ``offered``: the codecs that it names; empty where the operator
    itself has given the line up (port 0).
    """

    mid: str
    kind: str
    offered: str
    answer: tuple[str, ...]
    """Its lines in the answer."""

    @property
    def cause(self) -> str:
        return f"The operator offers {self.offered} on this {self.kind} line; the robot sends {OUR_CODECS[self.kind]}."


def sections(sdp: str) -> list[list[str]]:
    """The lines of a description: those of the session, then those of each media line."""
    found: list[list[str]] = [[]]
    for line in sdp.splitlines():
        if line.startswith("m="):
            found.append([])
        found[-1].append(line)
    return found


def is_given_up(section: Sequence[str]) -> bool:
    """Port 0 in an offer: the operator has stopped this line; ``bundle-only`` ones have it too, and are alive."""
    return section[0].split(" ")[1:2] == ["0"] and "a=bundle-only" not in section


def refused_line(section: Sequence[str], mid: str, kind: str, offered: str) -> RefusedLine:
    """Of a section of the offer."""
    _, _, profile, *formats = section[0].split(" ")
    codecs = [line for line in section if line.startswith("a=rtpmap:")]
    answer = (f"m={kind} 0 {profile} {' '.join(formats)}", "c=IN IP4 0.0.0.0", *codecs, "a=inactive", f"a=mid:{mid}")
    return RefusedLine(mid, kind, offered, answer)


def with_idle_lines(offer: str, refused: Collection[RefusedLine]) -> str:
    """What aiortc is shown instead of ``offer``, some of whose lines live."""
    if not refused:
        return offer
    by_mid = {line.mid: line for line in refused}
    session, *media = sections(offer)
    live = next(section for section in media if _mid(section) not in by_mid)
    shared = [line for line in live if line.startswith(_OF_TRANSPORT)]
    bundled = {*_bundled(session), *by_mid} if _bundled(session) else {_mid(live), *by_mid}
    # in the order of the lines: aiortc throws the transport away that it made for the first one, were it not first here
    in_order = [mid for mid in map(_mid, media) if mid in bundled]
    kept = [line for line in session if not line.startswith(_BUNDLE)]
    lines = [*kept, " ".join((_BUNDLE, *in_order))]
    for section in media:
        line = by_mid.get(_mid(section))
        lines += section if line is None else _idle(line, shared)
    return _text(lines)


def with_refusals(answer: str, refused: Collection[RefusedLine]) -> str:
    """The answer to the offer as it came, from aiortc's answer to the one that it was shown."""
    if not refused:
        return answer
    by_mid = {line.mid: line for line in refused}
    session, *media = sections(answer)
    lines = []
    for line in session:
        is_bundle = line.startswith(_BUNDLE)
        lines.append(
            " ".join((_BUNDLE, *(mid for mid in _bundled(session) if mid not in by_mid))) if is_bundle else line
        )
    for section in media:
        known = by_mid.get(_mid(section))
        lines += section if known is None else known.answer
    return _text(lines)


def nothing_but_refusals(refused: Collection[RefusedLine]) -> str:
    """The answer to an offer of which nothing is left."""
    session = ["v=0", "o=- 1 1 IN IP4 0.0.0.0", "s=-", "t=0 0"]
    return _text([*session, *(line for one in refused for line in one.answer)])


def _idle(line: RefusedLine, shared: Sequence[str]) -> list[str]:
    formats = line.answer[0].split(" ")[3:]
    payload_type = next((one for one in formats if one.isdecimal()), "96")
    return [
        f"m={line.kind} 9 UDP/TLS/RTP/SAVPF {payload_type}",
        "c=IN IP4 0.0.0.0",
        *shared,
        f"a=mid:{line.mid}",
        "a=inactive",
        "a=rtcp-mux",
        f"a=rtpmap:{payload_type} {_IDLE_CODEC[line.kind]}",
    ]


def _mid(section: Sequence[str]) -> str:
    return next((line.removeprefix("a=mid:").strip() for line in section if line.startswith("a=mid:")), "")


def _bundled(session: Sequence[str]) -> list[str]:
    return next((line.split(" ")[1:] for line in session if line.startswith(_BUNDLE)), [])


def _text(lines: Sequence[str]) -> str:
    return "\r\n".join(lines) + "\r\n"
