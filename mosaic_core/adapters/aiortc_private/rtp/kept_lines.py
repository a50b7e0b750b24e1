"""What was agreed for the lines of a peer connection, kept while a further offer adds more."""

from __future__ import annotations

from typing import Any

from aiortc import RTCPeerConnection


class KeptLines:
    """aiortc negotiates every line anew with each offer, though its senders and receivers run: codecs come back in the
    order of the offer, and extensions that it does not know itself are gone. :meth:`restore` before the answer."""

    def __init__(self, pc: RTCPeerConnection) -> None:
        self._agreed: list[tuple[Any, list[Any], list[Any]]] = [
            (transceiver, transceiver._codecs, transceiver._headerExtensions) for transceiver in pc.getTransceivers()
        ]

    @property
    def mids(self) -> frozenset[str]:
        """The names of these lines."""
        return frozenset(transceiver.mid or "" for transceiver, _, _ in self._agreed)

    def restore(self) -> None:
        """After the remote description is set. Raises :class:`ValueError` for a line that can't go on as it is."""
        for transceiver, codecs, extensions in self._agreed:
            if codecs and codecs[0].payloadType not in {codec.payloadType for codec in transceiver._codecs}:
                raise ValueError(f"line {transceiver.mid} no longer offers what is being sent")
            transceiver._codecs, transceiver._headerExtensions = codecs, extensions
