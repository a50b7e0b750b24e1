"""The connector channels of one peer: matched by label, gated, handed to receivers, filled from the outbox."""

from __future__ import annotations

import time

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.commands.admission import ArrivedCommand, CommandChannel
from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.commands.gates import Gate, GateRefusal
from mosaic_core.machines.commands.release_first import CommandPauses
from mosaic_core.machines.delivery.framing import Frame, FrameFlag
from mosaic_core.machines.delivery.send_scheduler import Offered, Priority
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.delivery.data_port import DataPort, PeerPartials
from mosaic_core.runtime.delivery.send_queue import SendQueue
from mosaic_core.runtime.handlers.receiver import Receiver
from mosaic_core.runtime.handlers.request_desk import RequestDesk
from mosaic_core.runtime.handlers.routes import Route
from mosaic_core.runtime.peers.peer_resume import PeerResume
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.runtime.peers.site import Site
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.errors import Refused, WireError

_TAKES_NONE = GateRefusal(Gate.MESSAGE, "channel.wrong_direction", "this connector sends and takes no messages")


class PeerChannels:
    """Opens, gates and fills the connectors' data channels of one operator. Event loop only."""

    def __init__(self, operator: RemoteOperator, site: Site, resume: PeerResume, baseline: ArrivalBaseline) -> None:
        self._operator = operator
        self._peer_id = operator.peer_id
        self._site = site
        self._resume = resume
        self.queue = self.new_queue()
        """That of the main connection."""
        self._baseline = baseline
        self._ports: dict[str, DataPort] = {}
        self._rates: dict[str, TokenBucket] = {}
        self._partials = PeerPartials(self._forgotten, site.unfinished)
        self._carriers: dict[str, SendQueue] = {}
        """The queue of every open channel: that of the main connection, or of the one for bulk."""

    def new_queue(self) -> SendQueue:
        """A queue for one peer connection of this operator."""
        return SendQueue(self._resume.has_room, self._site.outbox.left_out)

    def labels(self) -> tuple[str, ...]:
        return tuple(self._ports)

    def bulk_channel_opened(self, channel: Channel, queue: SendQueue) -> None:
        """A channel on the second peer connection, where nothing else than bulk belongs."""
        route = self._site.routes.get(channel.label)
        if route is None or (route.priority is Priority.BULK and channel.protocol == CHANNEL_PROTOCOL):
            self.channel_opened(channel, queue)
            return
        self._operator.refuse(channel.label, None, "channel.wrong_lane", gate=Gate.MESSAGE)
        channel.close()

    def channel_opened(self, channel: Channel, queue: SendQueue | None = None) -> None:
        """A channel of the operator's. One with the label of an open one takes its place."""
        route = self._site.routes.get(channel.label)
        if route is None:
            # an original dashboard's channel stays open, unread (UPSTREAM §3.1); ours is told, and wants it closed
            if channel.protocol == CHANNEL_PROTOCOL:
                self._operator.refuse(channel.label, None, "channel.unknown_label", gate=Gate.MESSAGE)
                channel.close()
            return
        self._detach(channel.label)
        port = DataPort(channel, self._baseline, partials=self._partials.shared)
        self._partials.opened(channel.label, port.reader)
        self._ports[channel.label] = port
        self._carriers[channel.label] = queue or self.queue
        self._receive(route, port)
        channel.on_close = lambda: self._channel_closed(port)
        if channel.is_open:
            self._ready(route, port)
        else:
            channel.on_open = lambda: self._ready(route, port)

    def _receive(self, route: Route, port: DataPort) -> None:
        gates, pauses = self._gates_of(route), CommandPauses(time.monotonic())
        opening = route.receiver.channel_opened(self._operator.sender) if route.receiver is not None else 0
        port.channel.on_message = lambda data: self._received(route, port, gates, pauses, opening, data)

    def _gates_of(self, route: Route) -> CommandChannel:
        """What all commands on this channel are measured by; a channel that is opened anew begins no new rate."""
        rate = self._rates.get(route.label)
        if rate is None and route.safety.max_rate_hz is not None:
            rate = self._rates[route.label] = TokenBucket.of_rate(route.safety.max_rate_hz)
        fence, legacy = self._site.desk.fence, self._site.legacy_peers
        return fence.channel(route.safety, legacy, route.max_age_s, rate)

    def _ready(self, route: Route, port: DataPort) -> None:
        self._resume.when_known(route, port.is_framed, lambda: self._join(route, port))

    def _join(self, route: Route, port: DataPort) -> None:
        if self._ports.get(route.label) is not port:
            return
        queue = self._carriers[route.label]
        queue.open(port.channel, route.priority, route.terms.limits)
        if port.is_framed and self._resume.opens(route.label):
            self._resume.attach(route.label, queue, port)
            return
        latched = self._site.outbox.join(route.label, self._peer_id, self)
        if latched is not None and port.is_framed:  # a bare payload could not say that it is old
            queue.offer(port.outgoing(latched, FrameFlag.LATCHED))

    def deliver(self, message: Outgoing) -> Offered:
        port = self._ports.get(message.channel)
        if port is None:
            return Offered.REFUSED
        return self._carriers[message.channel].offer(port.outgoing(message))

    def waiting(self, channel: str) -> tuple[int, int]:
        """``(messages, bytes)`` that wait to go out there."""
        carrier = self._carriers.get(channel)
        return carrier.waiting(channel) if carrier is not None else (0, 0)

    def _channel_closed(self, port: DataPort) -> None:
        label = port.channel.label
        if self._ports.get(label) is port:
            self._detach(label)
            self._leave(label)
            self._resume.channel_closed(label)

    def renew(self, label: str) -> None:
        """Another handler has taken over the channel: the gates are those of its limits."""
        port, route = self._ports.get(label), self._site.routes[label]
        if port is not None:
            self._receive(route, port)

    def remove(self, label: str) -> None:
        """There is no such connector any more, or one of another shape, whose channel is opened anew."""
        self._resume.removed(label)
        port = self._ports.get(label)
        if port is not None:
            self._detach(label)
            port.channel.close()
        self._rates.pop(label, None)

    def close_all(self) -> None:
        self._close(list(self._ports))

    def drop(self, queue: SendQueue) -> None:
        """The peer connection that ``queue`` fills is gone."""
        self._close([label for label, carrier in self._carriers.items() if carrier is queue])

    def _close(self, labels: list[str]) -> None:
        for label in labels:
            self._detach(label)
        for label in labels:
            self._leave(label)

    def _leave(self, label: str) -> None:
        route = self._site.routes.get(label)
        if route is not None and route.receiver is not None:
            route.receiver.channel_closed(self._operator.sender)

    def _detach(self, label: str) -> None:
        port = self._ports.pop(label, None)
        if port is None:
            return
        port.channel.on_message = port.channel.on_open = port.channel.on_close = port.channel.on_drained = None
        self._carriers.pop(label).close(label)
        self._partials.closed((label,))
        if not self._resume.keeps(label):
            self._site.outbox.leave(label, self._peer_id)
        measured = self._site.links.get(self._peer_id)
        if measured is not None:
            measured.channel_closed(label)

    def _received(
        self,
        route: Route,
        port: DataPort,
        gates: CommandChannel,
        pauses: CommandPauses,
        opening: int,
        data: bytes | str,
    ) -> None:
        try:
            frame = port.incoming(data)
        except WireError as error:
            self._reject(route, None, GateRefusal(Gate.MESSAGE, error.code, error.message))
            return
        if frame is None:
            self._partials.arrived()
            return
        if route.receiver is None:
            self._reject(route, frame.seq, _TAKES_NONE)
            return
        if port.is_framed and route.safety.is_slowed:
            measured = self._site.links.get(self._peer_id)
            if measured is not None:
                measured.command_seen(route.label, frame.seq)
        if port.is_framed and not self._resume.arrived(route, frame.seq):
            return
        item = self._incoming(route, route.receiver, port, pauses, frame, opening)
        opened = item if route.receiver.requests is None else self._opened(route, route.receiver.requests, item)
        if opened is None:
            return
        item = opened
        refusal = self._site.desk.fence.refusal_on_arrival(self._arrival(gates, port, frame, item))
        if refusal is not None:
            self._reject(route, frame.seq, refusal, item)
            return
        route.receiver.accept(item)

    def _opened(self, route: Route, requests: RequestDesk, item: Incoming) -> Incoming | None:
        """What a request connector is asked; ``None``: nothing."""
        try:
            return requests.opened(item)
        except Refused as refused:
            self._reject(route, item.seq, GateRefusal(Gate.MESSAGE, refused.code, refused.message), item)
            return None

    def _forgotten(self, label: str, seq: int) -> None:
        route = self._site.routes.get(label)
        if route is not None:
            self._reject(route, seq, GateRefusal(Gate.MESSAGE, "channel.incomplete"))

    def _incoming(
        self, route: Route, receiver: Receiver, port: DataPort, pauses: CommandPauses, frame: Frame, opening: int
    ) -> Incoming:
        now_s, seq = time.monotonic(), frame.seq if port.is_framed else None
        return Incoming(
            receiver.label,
            frame.payload,
            self._operator.sender,
            seq,
            now_s,
            frame.epoch if port.is_framed else None,
            opening,
            receiver.watch.generation,
            pauses.arrived(seq, now_s, frame.stamp_us) >= route.release_pause_s,
        )

    def _arrival(self, gates: CommandChannel, port: DataPort, frame: Frame, item: Incoming) -> ArrivedCommand:
        """What the gates are told of a message."""
        sender, now_s = item.sender, item.arrived_at_s
        is_ours = not sender.is_original and self._site.desk.knows(sender.peer_id)  # nobody is before its hello
        age_s, is_newest = port.order_of(frame, now_s)
        return ArrivedCommand(gates, sender.peer_id, sender.role, is_ours, item.epoch, now_s, age_s, is_newest)

    def _reject(self, route: Route, seq: int | None, refusal: GateRefusal, item: Incoming | None = None) -> None:
        route.counters.refuse(refusal.gate)
        if item is not None and route.receiver is not None and route.receiver.requests is not None:
            route.receiver.requests.refused(item, refusal)
        if item is not None:
            self._site.outbox.taps.commanded(item, refusal)
        self._operator.refuse(route.label, seq, refusal.code, refusal.message, refusal.gate)
        self._site.listener.command_refused(route.label, self._operator.sender, refusal)
