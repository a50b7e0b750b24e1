"""Looks at an offer before aiortc does: aiortc answers a bad one with an exception from somewhere deep inside.

A line without a common codec is refused, and the others live. Candidates are taken out, to be added like trickled ones:
a name that must be resolved may not delay the answer, and an end of candidates may not fail the connection while our
own relay is still on its way.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from aiortc import RTCRtpCodecParameters
from aiortc.sdp import MediaDescription, SessionDescription

from mosaic_core.adapters.aiortc_private.rtp.codecs import has_common_codec
from mosaic_core.adapters.peers.description_bounds import refuse_beyond_bounds
from mosaic_core.adapters.peers.refused_lines import RefusedLine, is_given_up, refused_line, sections, with_idle_lines
from mosaic_core.runtime.transport.media_transport import SoundLabels
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import IceCandidate

_MEDIA_KINDS = ("audio", "video")
_REPAIRS = ("rtx", "red", "ulpfec", "flexfec-03")
"""What stands among the codecs and shows no picture."""
_END_OF_CANDIDATES = "a=end-of-candidates"


@dataclass(frozen=True, slots=True)
class OfferedLine:
    """A media line of an offer. ``is_wanted``: the operator is ready to receive on it, ``is_sending``: it will send."""

    mid: str
    kind: str
    is_wanted: bool
    is_sending: bool = False


@dataclass(frozen=True, slots=True)
class VettedOffer:
    """An offer that aiortc will take: ``sdp`` shows it its ``refused`` lines as idle ones."""

    sdp: str
    lines: tuple[OfferedLine, ...]
    refused: tuple[RefusedLine, ...]
    candidates: tuple[IceCandidate, ...]
    has_all_candidates: bool
    is_bundled: bool
    ice_users: frozenset[str]

    @property
    def is_refused(self) -> bool:
        """Nothing of it is left."""
        return len(self.refused) == len(self.lines)

    @property
    def refused_mids(self) -> frozenset[str]:
        return frozenset(line.mid for line in self.refused)

    def refuse_unless_it_adds_to(self, first: VettedOffer) -> None:
        """A further offer may add lines. Raises :class:`ConnectionFailed` (``sdp.invalid``) for anything else."""
        if [line.mid for line in self.lines[: len(first.lines)]] != [line.mid for line in first.lines]:
            raise _invalid("lines of the first offer are gone")
        if self.ice_users != first.ice_users or not self.is_bundled or not first.is_bundled:
            raise _invalid("only lines on the same transport can be added")


def vetted_offer(text: str) -> VettedOffer:
    """Check ``text``; raises :class:`ConnectionFailed` with ``sdp.invalid``."""
    refuse_beyond_bounds(text)
    text = with_fragments(text)
    description = _parsed(text)
    mids = [media.rtp.muxId or "" for media in description.media]
    if not mids or "" in mids or len(set(mids)) != len(mids):
        raise _invalid("its media lines have no names (a=mid)")
    named = dict(zip(mids, description.media, strict=True))
    refused = tuple(
        line
        for (mid, media), section in zip(named.items(), sections(text)[1:], strict=True)
        if (line := _vetted_line(mid, media, section)) is not None
    )
    live = [media for mid, media in named.items() if mid not in {line.mid for line in refused}]
    bundle = next((list(group.items) for group in description.group if group.semantic == "BUNDLE"), [])
    sdp, candidates, has_all = separated_candidates(text)
    return VettedOffer(
        sdp=with_idle_lines(sdp, refused) if live else sdp,
        lines=tuple(_offered_line(mid, media) for mid, media in named.items()),
        refused=refused,
        candidates=candidates,
        has_all_candidates=has_all,
        is_bundled={media.rtp.muxId for media in live} <= set(bundle),
        ice_users=frozenset(media.ice.usernameFragment or "" for media in live if media.ice is not None),
    )


def _offered_line(mid: str, media: MediaDescription) -> OfferedLine:
    direction = media.direction
    is_wanted, is_sending = direction in ("recvonly", "sendrecv"), direction in ("sendonly", "sendrecv")
    return OfferedLine(mid, media.kind, is_wanted, is_sending)


def lines_for_labels(
    lines: Sequence[OfferedLine], labels: Sequence[str], tracks: Mapping[str, str] | None
) -> dict[str, str]:
    """Which label goes on which line, as mid → label: by the operator's wish, else in order."""
    wanted = [line.mid for line in lines if line.kind == "video" and line.is_wanted]
    if tracks is None:
        return dict(zip(wanted, labels, strict=False))
    return _named(wanted, labels, tracks)


def sound_lines(
    lines: Sequence[OfferedLine], sound: SoundLabels, tracks: Mapping[str, str] | None
) -> tuple[dict[str, str], dict[str, str]]:
    """The same for microphones and loudspeakers, which must be asked for by name."""
    audio = [line for line in lines if line.kind == "audio"]
    heard = _named([line.mid for line in audio if line.is_wanted], sound.microphones, tracks or {})
    talking = [line.mid for line in audio if line.is_sending and line.mid not in heard]
    return heard, _named(talking, sound.speakers, tracks or {})


def _named(mids: Sequence[str], labels: Sequence[str], tracks: Mapping[str, str]) -> dict[str, str]:
    bound: dict[str, str] = {}
    for mid in mids:
        label = tracks.get(mid)
        if label is not None and label in labels and label not in bound.values():
            bound[mid] = label
    return bound


def _parsed(text: str) -> SessionDescription:
    try:
        description = SessionDescription.parse(text)
    except (ValueError, AssertionError, LookupError, AttributeError, TypeError) as error:
        raise _invalid(f"it can't be parsed ({type(error).__name__})") from error
    description.type = "offer"
    return description


def _vetted_line(mid: str, media: MediaDescription, section: Sequence[str]) -> RefusedLine | None:
    kind = media.kind
    if kind not in (*_MEDIA_KINDS, "application"):
        raise _invalid(f"media line {mid} is of the unknown kind {kind!r}")
    if kind in _MEDIA_KINDS and is_given_up(section):
        return refused_line(section, mid, kind, "")
    ice, dtls = media.ice, media.dtls
    if ice is None or not ice.usernameFragment or not ice.password:
        raise _invalid(f"media line {mid} has no ICE credentials")
    if dtls is None or not dtls.fingerprints:
        raise _invalid(f"media line {mid} has no DTLS fingerprint")
    if kind not in _MEDIA_KINDS:
        return None
    if not media.rtcp_mux:
        raise _invalid(f"media line {mid} does not multiplex RTCP")
    codecs = media.rtp.codecs
    if has_common_codec(kind, codecs):
        return None
    own = (_named_codec(codec) for codec in codecs if codec.name.lower() not in _REPAIRS)
    return refused_line(section, mid, kind, ", ".join(dict.fromkeys(own)) or "no codec")


def _named_codec(codec: RTCRtpCodecParameters) -> str:
    if codec.name.upper() != "H264":
        return codec.name
    mode, profile = (
        codec.parameters.get(key, default)
        for key, default in (("packetization-mode", 0), ("profile-level-id", "42e01f"))
    )
    return f"H264 (packetization-mode {mode}, profile {profile})"


def with_fragments(text: str) -> str:
    """A description in which every H.264 says how it is cut into packets. Who leaves that out, as GStreamer's caps
    mostly do, says "one NAL unit in each" (RFC 6184 §8.1), which aiortc doesn't have, and takes fragments all the same;
    who writes ``packetization-mode=0`` means it."""
    return "".join(_section_with_fragments(section) for section in re.split(r"(?m)^(?=m=)", text))


def _section_with_fragments(section: str) -> str:
    for payload_type in re.findall(r"(?mi)^a=rtpmap:(\d+) H264/90000", section):
        found = re.search(rf"(?m)^a=fmtp:{payload_type} [^\r\n]*", section)
        if found is None:
            section = f"{section.rstrip()}\r\na=fmtp:{payload_type} packetization-mode=1\r\n"
        elif "packetization-mode" not in found[0]:
            section = section.replace(found[0], f"{found[0].rstrip()};packetization-mode=1", 1)
    return section


def separated_candidates(text: str) -> tuple[str, tuple[IceCandidate, ...], bool]:
    """A description without its candidates, the candidates, and whether it said that there are no more."""
    kept: list[str] = []
    mids: list[str] = []
    found: list[tuple[int, str]] = []
    has_all = False
    for line in text.splitlines():
        if line.startswith("m="):
            mids.append("")
        elif line.startswith("a=mid:") and mids:
            mids[-1] = line.removeprefix("a=mid:").strip()
        if line.startswith("a=candidate:") and mids:
            found.append((len(mids) - 1, line.removeprefix("a=")))
        elif line.startswith(_END_OF_CANDIDATES):
            has_all = True
        else:
            kept.append(line)
    candidates = tuple(
        IceCandidate(candidate=line, sdp_mid=mids[index], sdp_m_line_index=index) for index, line in found
    )
    return "\r\n".join(kept) + "\r\n", candidates, has_all


def without_end_of_candidates(sdp: str) -> str:
    """A description of ours, to which candidates will still be added."""
    return "".join(line for line in sdp.splitlines(keepends=True) if not line.startswith(_END_OF_CANDIDATES))


def mids_of(sdp: str) -> list[str]:
    """The names of the media lines, in their order."""
    return [line[6:].strip() for line in sdp.splitlines() if line.startswith("a=mid:")]


def refuse_unless_bundled(answer_sdp: str) -> None:
    """Our offers have one transport for all lines. Raises :class:`ConnectionFailed` (``sdp.invalid``) where the answer
    takes several of them and gives each its own, which would connect the first line alone."""
    description = _parsed(answer_sdp)
    taken = {media.rtp.muxId for media in description.media if media.port}
    bundles = [set(group.items) for group in description.group if group.semantic == "BUNDLE"]
    if len(taken) > 1 and not any(taken <= bundle for bundle in bundles):
        message = "The robot's answer has no a=group:BUNDLE for all its media lines, and the offer has one transport."
        cure = "Let the robot bundle them; GStreamer: webrtcbin bundle-policy=max-bundle."
        raise ConnectionFailed(f"{message} {cure}", code="sdp.invalid", cure=cure)


def _invalid(why: str) -> ConnectionFailed:
    return ConnectionFailed(f"The session description could not be understood: {why}.", code="sdp.invalid")
