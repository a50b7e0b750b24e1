"""The one place that touches names which aiortc and aioice keep to themselves; one contract test holds each.

Those tests fail loudly when a new version changes one of them. Most are in
``tests/adapters/aiortc_private/test_aiortc_private_names.py``; those of ``dtls``, ``fair_turns``,
``quick_sctp``, ``receivers`` and ``reporting`` stand in their own files there.
``tests/architecture/test_aiortc_private_use.py`` sees that no other module uses such a name, and that each used here
has its test.
"""

from aiortc.sdp import MediaDescription, SessionDescription, candidate_from_sdp, candidate_to_sdp

from mosaic_core.adapters.aiortc_private.dtls import speak_dtls_with_everyone
from mosaic_core.adapters.aiortc_private.ice.fair_turns import take_turns
from mosaic_core.adapters.aiortc_private.ice.gathering import (
    EarlyGathering,
    ice_transports,
    transports_by_mid,
    widen_udp_buffer,
)
from mosaic_core.adapters.aiortc_private.ice.liveness import watch_liveness
from mosaic_core.adapters.aiortc_private.ice.paths import bound_learned_paths, chosen_path, keep_off_loopback
from mosaic_core.adapters.aiortc_private.rtp.codecs import KeptLines, has_common_codec, prefer_codecs, sent_codec
from mosaic_core.adapters.aiortc_private.rtp.paced_transport import PacedTransport, WatchedTransport
from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import (
    PacketNumbers,
    agree_on_arrivals,
    never_repeat,
    sequence_number_of,
)
from mosaic_core.adapters.aiortc_private.rtp.receivers import bound_sources
from mosaic_core.adapters.aiortc_private.rtp.senders import RtpOriginLearner, SenderFeedback, name_stream, ssrc_of
from mosaic_core.adapters.aiortc_private.sctp.quick_sctp import quicken
from mosaic_core.adapters.aiortc_private.sctp.sctp import SctpQueue

__all__ = [
    "EarlyGathering",
    "KeptLines",
    "MediaDescription",
    "PacedTransport",
    "PacketNumbers",
    "RtpOriginLearner",
    "SctpQueue",
    "SenderFeedback",
    "SessionDescription",
    "WatchedTransport",
    "agree_on_arrivals",
    "bound_learned_paths",
    "bound_sources",
    "candidate_from_sdp",
    "candidate_to_sdp",
    "chosen_path",
    "has_common_codec",
    "ice_transports",
    "keep_off_loopback",
    "name_stream",
    "never_repeat",
    "prefer_codecs",
    "quicken",
    "sent_codec",
    "sequence_number_of",
    "speak_dtls_with_everyone",
    "ssrc_of",
    "take_turns",
    "transports_by_mid",
    "watch_liveness",
    "widen_udp_buffer",
]
