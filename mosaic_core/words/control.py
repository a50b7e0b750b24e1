"""Every message of the control channel ``_mosaic`` and of the stop channel ``_stop``, once.

The operator creates the channel in its first offer (ordered, reliable, protocol ``mosaic.1``); both sides start
with :class:`Hello`. An original peer knows neither.
Times are microseconds of the sender's own monotonic clock, which ``boot_id`` names.
"""

from __future__ import annotations

import json
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, ValidationError

from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import WireError
from mosaic_core.words.signaling import IceCandidate
from mosaic_core.words.wire_model import PlainText, WireModel, to_json, wrong_fields

CONTROL_LABEL = "_mosaic"
"""The channel of the control messages, but for the stop."""
STOP_LABEL = "_stop"
"""A channel of its own for :class:`Stop` and :class:`StopAck`: unordered, nothing retransmitted, so that a lost packet
of anything else delays no stop. The operator creates it in its first offer and repeats the stop until it is
answered."""
LANE_LABEL = "_lane"
"""The first channel of a second peer connection: pings, so that a dead one is noticed before ICE does."""
CHANNEL_PROTOCOL = "mosaic.1"
"""The DCEP protocol of our own data channels: every message carries the frame header of
``machines.delivery.framing``."""
CONTROL_PROTOCOL_VERSION = 1
"""What a hello says of itself; what else a side can is among its extensions."""
HELLO_TIMEOUT_S = 2.0
"""Who has said no hello for this long after the channel opened is an original MOSAIC, which knows none."""
PING_PERIOD_S = 0.5
"""Both sides say a ping this often; it also compares their clocks."""
PEER_LOST_AFTER_S = 2.0
"""Without a word on the control channel for this long a peer counts as lost (ICE itself needs 29 s)."""

LEASE_KEEP_PERIOD_S = 0.5
"""How often an operator says that it still wants its leases."""
STOP_REPEAT_S = 0.03
"""How often a stop is said until it is answered."""
MEDIA_SEEN_PERIOD_S = 0.1
"""How often at most the robot is told how old the picture on the screen is."""
MOST_SHOWN_PX = 1_000_000_000
"""More than any screen has."""

CONTROL_EXTENSIONS: dict[str, int] = {
    "catalogue": 1, "mediaWatch": 1, "mediaOrigin": 1, "refusals": 1,
    "lease": 1, "stop": 1, "safetyLimit": 1, "journal": 1, "bulkLane": 1, "renegotiate": 1, "resume": 1,
    "delivery": 1, "near": 1, "stopRight": 1,
}  # fmt: skip
"""What we can do on the control channel: name and version, told in the hello. The lower version of the two counts."""
Role = Literal["observer", "operator", "supervisor"]
ResourceName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$")]


class ControlMessage(WireModel):
    """A message on ``_mosaic``: ``{"type": …, "data": {…}}``."""

    type: ClassVar[str]

    def to_text(self) -> str:
        return to_json({"type": self.type, "data": self.wire()})


class Hello(ControlMessage):
    """First message both ways."""

    type = "hello"
    protocol: int = CONTROL_PROTOCOL_VERSION
    extensions: dict[str, int] = Field(default_factory=dict)
    software: PlainText
    boot_id: PlainText
    is_person: bool = Field(default=False, description="A person decides here; a program gives way to persons.")


class CatalogueFull(ControlMessage):
    """Robot → operator after its hello: every connector with its message schema."""

    type = "catalogue"
    catalogue: Catalogue


class Ping(ControlMessage):
    """Four-stamp ping (RFC 5905 §8): ``t0`` is when it left. Both sides ping: the operator for the clock offset, the
    robot (on the stop channel, where nothing waits for a lost packet) to learn how old a command is when it acts. The
    answer takes the channel of the ping."""

    type = "ping"
    t0: int


class Pong(ControlMessage):
    """The answer to a ping. ``t1``: when the ping arrived, ``t2``: when this answer left, both on the
    answerer's clock.
    """

    type = "pong"
    t0: int
    t1: int
    t2: int


class Bye(ControlMessage):
    """I am closing, on purpose."""

    type = "bye"
    code: PlainText = "peer.closed"
    message: PlainText | None = None


class MediaWatch(ControlMessage):
    """Operator → robot: send (or stop sending) this picture. Nobody watching = neither captured nor encoded. Said again
    when it is shown at another size: ``shown_px`` is width x height on the screen, and ``leads`` says that somebody
    drives by it. A narrow link serves what leads first, and the rest by size."""

    type = "media.watch"
    label: str
    on: bool
    shown_px: Annotated[int, Field(ge=0, le=MOST_SHOWN_PX)] | None = None
    leads: bool | None = None


class MediaOrigin(ControlMessage):
    """Robot → operator: RTP timestamp = robot monotonic time x 90 kHz + ``rtp_origin`` (mod 2^32)."""

    type = "media.origin"
    label: str
    ssrc: int
    rtp_origin: int
    boot_id: PlainText


class MediaUnavailable(ControlMessage):
    """Robot → operator: no picture under this label, and why."""

    type = "media.unavailable"
    label: str
    code: PlainText
    message: PlainText | None = None


class MediaTalking(ControlMessage):
    """Robot → operator: whose voice the loudspeaker ``label`` plays; without ``peer_id`` nobody talks any more."""

    type = "media.talking"
    label: str
    peer_id: str | None = None
    name: PlainText = ""


class Refusal(ControlMessage):
    """Robot → operator: a message on a connector was not accepted. ``seq`` is that of its frame; ``gate``: what on the
    way of a command refused it. ``count``: how many of this label and code it speaks for, ``seq`` being the last one's;
    one where it says nothing."""

    type = "refusal"
    label: str
    seq: int | None = None
    code: PlainText
    gate: PlainText | None = None
    count: Annotated[int, Field(ge=1)] | None = None
    message: PlainText | None = None


# -- what outlives a connection ----------------------------------------------------------------------------------


Seq = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]
Seqs = Annotated[dict[str, Seq], Field(max_length=1024)]


class Resume(ControlMessage):
    """Both ways, once per peer connection, the operator right after its hello, the robot in answer to it: how far the
    reliable channels of this session are. No data goes over them before.

    ``received`` is the highest number that has arrived from the other side, ``upcoming`` the number that one's own next
    message will have, both by label. The robot names every channel that takes part, the operator those that it has
    open and those on which it has sent. ``is_new``: the robot remembers nothing of the session. ``boot_id`` of the
    operator's message is that of the robot whose numbers it remembers."""

    type = "resume"
    boot_id: PlainText = ""
    is_new: bool = False
    received: Seqs = Field(default_factory=dict)
    upcoming: Seqs = Field(default_factory=dict)


class Delivered(ControlMessage):
    """Both ways, where something has arrived since the last one, every 250 ms or after many messages: the highest
    number by label. The sender keeps what is not told here, and repeats it on the next connection."""

    type = "delivered"
    seqs: Seqs = Field(default_factory=dict)


# -- the lease: who commands -------------------------------------------------------------------------------------


class PeerInfo(WireModel):
    """One operator as the others see it. ``is_original``: it knows no control channel and can't be asked."""

    peer_id: str
    account: PlainText | None = Field(default=None, description="The id of its account, as its ticket says.")
    name: PlainText = ""
    role: Role = "operator"
    is_person: bool = False
    is_original: bool = False
    may_stop: bool | None = Field(
        default=None, description="False: a supervisor has taken from this observer the right to say stop."
    )
    stop_right_by: PlainText | None = Field(
        default=None, description="Name of the supervisor who took that right last, or gave it back."
    )


class Peers(ControlMessage):
    """Robot → operator, at first and on every change: everybody who is connected. ``you`` is the reader's peer id."""

    type = "peers"
    you: str
    peers: tuple[PeerInfo, ...] = ()


class LeaseRequest(ControlMessage):
    """Operator → robot: I want to command ``resource``. ``force`` (supervisors only) takes it over, with a reason."""

    type = "lease.request"
    resource: ResourceName = "motion"
    reason: Annotated[PlainText, Field(max_length=200)] = ""
    force: bool = False


class LeaseReply(ControlMessage):
    """Robot → the operator who asked. ``code`` says why it was not granted at once (``lease.queued``: it may still be)
    or why a lease ended (``lease.expired``, ``lease.taken_over``, ...); ``epoch`` goes into every command."""

    type = "lease.reply"
    resource: ResourceName
    outcome: Literal["granted", "queued", "denied", "ended"]
    epoch: Annotated[int, Field(ge=0, le=0xFFFFFFFF)] = 0
    code: PlainText = ""
    message: PlainText | None = None


class LeaseKeep(ControlMessage):
    """Holder → robot, every 0.5 s for all it holds: I am still here. Without it a lease expires."""

    type = "lease.keep"
    epochs: dict[str, int] = Field(default_factory=dict, max_length=32)


class LeaseRelease(ControlMessage):
    """Operator → robot: I give ``resource`` back, or no longer wait for it."""

    type = "lease.release"
    resource: ResourceName = "motion"


class LeaseAnswer(ControlMessage):
    """Holder → robot: what I say to ``peer_id``, who asked for ``resource``. Granting hands it over at once."""

    type = "lease.answer"
    resource: ResourceName = "motion"
    peer_id: str
    grant: bool
    message: Annotated[PlainText, Field(max_length=200)] = ""


class LeaseWaiting(WireModel):
    """Somebody in the queue for a lease."""

    peer_id: str
    name: PlainText = ""
    reason: PlainText = ""
    is_person: bool = False


class LeaseState(ControlMessage):
    """Robot → every operator, at first and on every change: who commands ``resource``."""

    type = "lease.state"
    resource: ResourceName
    epoch: int
    holder: PeerInfo | None = None
    queue: tuple[LeaseWaiting, ...] = ()
    expiry_s: float


# -- the stop ----------------------------------------------------------------------------------------------------


class Stop(ControlMessage):
    """Any operator → robot, on the stop channel: stand still and take no command until cleared. Repeated, with the same
    ``id``, until it is acknowledged."""

    type = "stop"
    id: Annotated[str, Field(min_length=1, max_length=64)]
    reason: Annotated[PlainText, Field(max_length=200)] = ""


class StopAck(ControlMessage):
    """Robot → whoever said stop. Times are of the robot's clock: ``received_us`` when the first copy arrived,
    ``safe_us`` when the last safe action had returned (``None``: one is still running)."""

    type = "stop.ack"
    id: str
    received_us: int
    safe_us: int | None = None


class StopState(ControlMessage):
    """Robot → every operator, at first and on every change."""

    type = "stop.state"
    is_stopped: bool
    by: PlainText = Field(default="", description="Name of the operator, or what stopped it.")
    by_account: PlainText | None = Field(
        default=None, description="The id of that operator's account, as its ticket says."
    )
    reason: PlainText = ""
    since_us: int | None = None


class StopClear(ControlMessage):
    """The holder of a lease, or a supervisor → robot: commands may act again. A deliberate act of a person."""

    type = "stop.clear"


class StopRight(ControlMessage):
    """Supervisor → robot (extension ``stopRight``): take from this observer the right to say stop, or give it back.
    Everybody is told by ``peers``. It holds for the account, until a supervisor gives it back."""

    type = "stop.right"
    peer_id: str
    may_stop: bool


# -- what limits the speed ---------------------------------------------------------------------------------------


class MediaSeen(ControlMessage):
    """Operator → robot, ten times a second while it watches: the picture on the screen was captured at ``capture_us``
    of the robot's clock. ``None``: watching, but no picture has been shown yet."""

    type = "media.seen"
    label: str
    capture_us: int | None = None


class SafetyCause(WireModel):
    """One thing that limits the speed. ``value``: milliseconds for ``rtt`` and ``picture``, a share for ``loss``."""

    cause: Literal["rtt", "loss", "picture"]
    value: float | None = None
    factor: Annotated[float, Field(ge=0, le=1)]


class SafetyLimit(ControlMessage):
    """Robot → the operator who commands ``label``, on change: what is left of the speed, and why, worst first."""

    type = "safety.limit"
    label: str
    factor: Annotated[float, Field(ge=0, le=1)]
    causes: tuple[SafetyCause, ...] = ()


# -- who did what ------------------------------------------------------------------------------------------------


class JournalRead(ControlMessage):
    """Supervisor → robot: the newest ``limit`` entries before ``before`` (a number of an entry)."""

    type = "journal.read"
    limit: Annotated[int, Field(ge=1, le=200)] = 100
    before: int | None = None


class JournalEntry(WireModel):
    """One thing that happened. ``at`` is the robot's wall clock in ISO 8601 UTC, for people to read."""

    number: int
    at: PlainText
    what: PlainText
    who: PlainText = ""
    account: PlainText | None = Field(
        default=None, description="The id of that operator's account, as its ticket says."
    )
    subject: PlainText = ""
    code: PlainText = ""
    gate: PlainText | None = Field(default=None, description="What on the way of a command refused it.")
    message: PlainText = ""


class Journal(ControlMessage):
    """Robot → supervisor, newest first."""

    type = "journal"
    entries: tuple[JournalEntry, ...] = ()


# -- more than the first offer: the second connection, and more media lines ---------------------------------------


LaneName = Literal["bulk"]
AttemptNumber = Annotated[int, Field(ge=1, le=0xFFFFFFFF)]
"""Counts the offers of one peer: what still comes of an abandoned one is recognized by it."""
MAX_LANE_SDP_BYTES = 16 * 1024
"""Its only line is that of the data channels: about 1 KB, and the candidates."""


class LaneOffer(ControlMessage):
    """Operator → robot: a second peer connection of the same session, which carries data channels only."""

    type = "lane.offer"
    lane: LaneName = "bulk"
    attempt: AttemptNumber
    sdp: Annotated[str, Field(max_length=MAX_LANE_SDP_BYTES)]


class LaneAnswer(ControlMessage):
    """Robot → operator: the answer to that offer."""

    type = "lane.answer"
    lane: LaneName = "bulk"
    attempt: AttemptNumber
    sdp: Annotated[str, Field(max_length=MAX_LANE_SDP_BYTES)]


class LaneCandidate(ControlMessage):
    """Both ways: an ICE candidate of the bulk connection."""

    type = "lane.candidate"
    lane: LaneName = "bulk"
    attempt: AttemptNumber
    candidate: Annotated[str, Field(max_length=1024)]
    sdp_mid: Annotated[str, Field(max_length=64)] = "0"
    sdp_m_line_index: Annotated[int, Field(alias="sdpMLineIndex", ge=0, le=0xFFFF)] = 0

    @staticmethod
    def of(attempt: int, found: IceCandidate) -> LaneCandidate:
        return LaneCandidate(
            attempt=attempt,
            candidate=found.candidate,
            sdp_mid=found.sdp_mid,
            sdp_m_line_index=found.sdp_m_line_index,
        )

    @property
    def ice_candidate(self) -> IceCandidate:
        return IceCandidate(candidate=self.candidate, sdp_mid=self.sdp_mid, sdp_m_line_index=self.sdp_m_line_index)


class LaneClose(ControlMessage):
    """Both ways: the bulk connection is not made, or ends; bulk goes on over the main connection."""

    type = "lane.close"
    lane: LaneName = "bulk"
    attempt: AttemptNumber
    code: PlainText = "peer.closed"
    message: Annotated[PlainText, Field(max_length=500)] | None = None


MAX_OFFER_BYTES = 200 * 1024
"""Chromium needs 80 KB for 16 media lines."""


class RenegotiateOffer(ControlMessage):
    """Operator → robot: the main connection once more, with media lines for labels that it was made without."""

    type = "renegotiate.offer"
    attempt: AttemptNumber
    sdp: Annotated[str, Field(max_length=MAX_OFFER_BYTES)]
    tracks: dict[str, str] = Field(default_factory=dict, max_length=256)


class RenegotiateAnswer(ControlMessage):
    """Robot → operator. With a ``code`` instead of an ``sdp`` nothing has changed."""

    type = "renegotiate.answer"
    attempt: AttemptNumber
    sdp: Annotated[str, Field(max_length=MAX_OFFER_BYTES)] | None = None
    code: PlainText = ""
    message: Annotated[PlainText, Field(max_length=500)] | None = None


# -- how data travels now ----------------------------------------------------------------------------------------


DELIVERY_REPORT_PERIOD_S = 1.0


class DeliveryWatch(ControlMessage):
    """Operator → robot (extension ``delivery``): tell once a second how the data travels, or no longer."""

    type = "delivery.watch"
    on: bool


class DeliveryRow(WireModel):
    """One connector. Counts are sums over all operators since the robot started; the queue is the longest of any."""

    label: str
    delivery: Delivery = Delivery.RELIABLE
    messages: int = 0
    rate_hz: float = 0.0
    bytes_per_s: float = 0.0
    queue_messages: int = 0
    queue_bytes: int = 0
    replaced: int = 0
    dropped: int = 0
    too_large: int = 0
    thinned: int = 0
    refused: int = 0
    lost: int = 0
    resent: int = 0
    age_ms: float | None = Field(default=None, description="Since the last message; null: there was none.")
    failure_code: PlainText | None = Field(default=None, description="Why it fails now; null: it does not.")
    tries_again_in_s: float | None = Field(default=None, description="Seconds until the robot tries it again.")


class DeliveryReport(ControlMessage):
    """Robot → operators that watch, once a second: every connector, in the order of the catalogue."""

    type = "delivery.report"
    connectors: tuple[DeliveryRow, ...]


# -- the near path -----------------------------------------------------------------------------------------------


class Near(ControlMessage):
    """Robot → operators that another server introduced (extension ``near``), at first and on every change: where the
    robot serves the same page itself on its own network. It works without the internet."""

    type = "near"
    urls: tuple[Annotated[str, Field(max_length=200, pattern=r"^https?://[^\s/?#@]+$")], ...] = Field(max_length=16)


CONTROL_MESSAGES: dict[str, type[ControlMessage]] = {
    message.type: message for message in ControlMessage.__subclasses__()
}


def parse_control(text: str) -> ControlMessage | None:
    """Read one control message; ``None`` for an unknown type. Raises :class:`WireError`."""
    try:
        envelope: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise WireError("control channel: not JSON") from error
    if not isinstance(envelope, dict) or not isinstance(envelope.get("type"), str):
        raise WireError("control channel: no envelope with a type")
    message = CONTROL_MESSAGES.get(envelope["type"])
    if message is None:
        return None
    data = envelope.get("data")
    try:
        return message.model_validate({} if data is None else data)
    except ValidationError as error:
        raise WireError(f"control channel: {message.type}: wrong or missing {wrong_fields(error)}") from error
