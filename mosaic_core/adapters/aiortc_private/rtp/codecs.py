"""The codecs of media lines: their order, which aiortc fixes before an answerer may speak, and what was agreed on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from aiortc import RTCPeerConnection, RTCRtpTransceiver
from aiortc.codecs import CODECS
from aiortc.rtcpeerconnection import find_common_codecs


def has_common_codec(kind: str, offered: Iterable[Any]) -> bool:
    """Whether aiortc would find a codec for a media line with these ``offered`` codecs."""
    return bool(find_common_codecs(CODECS[kind], list(offered)))


def prefer_codecs(transceiver: RTCRtpTransceiver, order: Sequence[str]) -> None:
    """Sort the negotiated codecs by MIME type, retransmission right behind its codec; the first one is sent."""
    rank = {mime_type.lower(): position for position, mime_type in enumerate(order)}
    codecs = transceiver._codecs
    plain = sorted(
        (codec for codec in codecs if codec.name.lower() != "rtx"),
        key=lambda codec: rank.get(codec.mimeType.lower(), len(rank)),
    )
    repeats = [codec for codec in codecs if codec.name.lower() == "rtx"]
    transceiver._codecs = [
        codec for base in plain for codec in (base, *(r for r in repeats if r.parameters["apt"] == base.payloadType))
    ]


def sent_codec(transceiver: RTCRtpTransceiver) -> str:
    """MIME type of the codec that the sender will send, once the codecs are negotiated and sorted."""
    return str(transceiver._codecs[0].mimeType)


class KeptLines:
    """aiortc negotiates every line anew with each offer, though its senders and receivers run: codecs come back in the
    order of the offer, and extensions that it does not know itself are gone. :meth:`restore` before the answer."""

    def __init__(self, pc: RTCPeerConnection) -> None:
        self._agreed: list[tuple[Any, list[Any], list[Any]]] = [
            (transceiver, transceiver._codecs, transceiver._headerExtensions) for transceiver in pc.getTransceivers()
        ]

    def restore(self) -> None:
        """After the remote description is set. Raises :class:`ValueError` for a line that can't go on as it is."""
        for transceiver, codecs, extensions in self._agreed:
            if codecs and codecs[0].payloadType not in {codec.payloadType for codec in transceiver._codecs}:
                raise ValueError(f"line {transceiver.mid} no longer offers what is being sent")
            transceiver._codecs, transceiver._headerExtensions = codecs, extensions
