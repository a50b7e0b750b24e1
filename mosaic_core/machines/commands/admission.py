"""Admits commands: the way of a command is the tuple :data:`WAY`, every gate that it passes, in the order in which they
are asked.

Twice it is asked: when it arrives, so that what is refused costs no place in a queue, and when its turn has come, for
meanwhile everything may have changed. What is refused is refused by one gate, which the refusal names; whoever sent the
command is told it, and so are the log, the journal and the metrics. Nothing else decides whether a command acts. What
is decided elsewhere (bytes that make no message, a full queue, the connector itself) stands in its place here, and
refuses with a :class:`GateRefusal` of its gate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal, Protocol

from mosaic_core.machines.commands.gates import Gate, GateRefusal, GateRule, T, WrongShape
from mosaic_core.machines.commands.slow_down import Measures, link_factor, picture_factor
from mosaic_core.machines.control.lease_events import LegacyPeers
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.words.errors import Refused
from mosaic_core.words.limits import SlowDownCurves

OVERTAKEN = "overtaken"
"""Says a command that begins to act: a safe action has run since it was shaped, so it must be shaped anew, from a
standstill."""
COMMANDING = ("operator", "supervisor")
"""The roles that may command."""


class CommandTerms(Protocol):
    """The terms that hold for all commands of one receiver."""

    @property
    def takes_observers(self) -> bool: ...
    @property
    def is_motion(self) -> bool:
        """It moves something: a stop concerns it."""

    @property
    def resource(self) -> str | None:
        """Whose lease its commands need."""

    @property
    def curves(self) -> SlowDownCurves: ...


class Leases(Protocol):
    """Answers who may command which resource now."""

    def refusal(self, peer_id: str, resource: str, epoch: int | None, now_s: float) -> str | None: ...


class Latch(Protocol):
    """Whether somebody said stop."""

    @property
    def is_stopped(self) -> bool: ...


# -- when it arrives ---------------------------------------------------------------------------------------------


@dataclass(slots=True)
class CommandChannel:
    """The terms by which all commands on one channel of one sender are judged. ``max_age_s`` ``None``: they do not
    age."""

    terms: CommandTerms
    leases: Leases
    latch: Latch
    legacy: LegacyPeers = "allow"
    max_age_s: float | None = None
    rate: TokenBucket | None = None


@dataclass(slots=True)
class ArrivedCommand:
    """One command that has arrived. ``is_ours``: its sender has said hello, so it knows leases; ``epoch`` ``None``: it
    came without a frame; ``age_s`` and ``is_newest``: see :class:`~.command_order.CommandOrder`."""

    channel: CommandChannel
    peer_id: str
    role: str
    is_ours: bool
    epoch: int | None
    now_s: float
    age_s: float = 0.0
    is_newest: bool = True


def _role(it: ArrivedCommand) -> str | None:
    return None if it.role in COMMANDING or it.channel.terms.takes_observers else "lease.forbidden"


def _origin(it: ArrivedCommand) -> str | None:
    may = it.is_ours or it.channel.legacy == "allow" or it.channel.terms.takes_observers
    return None if may else "lease.original_observes"


def _lease(it: ArrivedCommand) -> str | None:
    return lease_code(it.channel.terms, it.channel.leases, it.peer_id, it.epoch, it.now_s)


def _age(it: ArrivedCommand) -> str | None:
    most_s = it.channel.max_age_s
    return "safety.stale" if most_s is not None and it.age_s > most_s else None


def _sequence(it: ArrivedCommand) -> str | None:
    return None if it.is_newest else "safety.out_of_order"


def _rate(it: ArrivedCommand) -> str | None:
    rate = it.channel.rate
    return None if rate is None or rate.admits(it.now_s) else "safety.too_fast"


def _stop(it: ArrivedCommand) -> str | None:
    return stop_code(it.channel.terms, it.channel.latch)


# -- when its turn has come --------------------------------------------------------------------------------------


class Acting(Protocol):
    """A command whose turn has come, on its receiver's thread. Each step works on what the one before has left."""

    terms: CommandTerms
    max_age_s: float | None
    waited_s: float
    """Since it arrived."""
    factor: float
    """What the gates of link and picture leave of its speed; 1 in the beginning."""
    measured: Measures
    rest_code: str | None
    """Why the connector takes nothing of its sender for a while: what his last command came to, or that the device is
    away."""

    def measure(self) -> Measures:
        """How good its sender's link is now."""

    def parse(self) -> None:
        """Read its bytes; raises :class:`Refused`."""

    def limit(self) -> None:
        """Scale by :attr:`factor`, hold within the limits, and make the connector's own type of it; raises
        :class:`Refused`."""

    def is_let_go(self) -> bool:
        """It moves nothing, or its sender has let go since the last stop; otherwise it is undone."""

    def begin(self) -> str | None:
        """Let it act, unless its lease or a stop forbids it by now, in one step with asking them; the code why not, or
        :data:`OVERTAKEN`."""


def _rest(it: Acting) -> str | None:
    return it.rest_code


def _waited(it: Acting) -> str | None:
    if it.max_age_s is not None and it.waited_s > it.max_age_s:
        raise Refused("safety.stale", "it waited behind a slow handle_data")
    return None


def _link(it: Acting) -> None:
    it.measured = it.measure()
    it.factor = link_factor(it.terms.curves, it.measured)


def _picture(it: Acting) -> None:
    it.factor = min(it.factor, picture_factor(it.terms.curves, it.measured))


def _shape(it: Acting) -> None:
    it.parse()


def _envelope(it: Acting) -> None:
    it.limit()


def _let_go(it: Acting) -> str | None:
    return None if it.is_let_go() else "safety.release_first"


def _act(it: Acting) -> str | None:
    return it.begin()


# -- the order ---------------------------------------------------------------------------------------------------


LEASE_CODES = (
    "lease.required", "lease.not_holder", "lease.old_epoch", "lease.expired", "lease.unknown_resource",
    "lease.forbidden", "lease.original_observes",
)  # fmt: skip
ON_ARRIVAL: tuple[GateRule[ArrivedCommand], ...] = (
    GateRule(
        Gate.MESSAGE,
        "Is it a whole message, not too large, on a channel that takes messages?",
        (
            "channel.unknown_label", "channel.wrong_lane", "channel.too_large", "channel.incomplete",
            "channel.wrong_direction", "signal.bad_message", "request.too_large", "request.bad_id",
        ),
        where="the reader of the channel, before there is a command",
    ),
    GateRule(Gate.ROLE, "May this account command at all?", ("lease.forbidden",), _role),
    GateRule(
        Gate.ORIGIN,
        "Is its sender one of ours, or may original dashboards command here?",
        ("lease.original_observes",),
        _origin,
    ),
    GateRule(Gate.LEASE, "Does its sender hold the lease, and is it of the present grant?", LEASE_CODES, _lease),
    GateRule(Gate.AGE, "Has it come quickly enough?", ("safety.stale",), _age),
    GateRule(Gate.SEQUENCE, "Is it newer than all that came before?", ("safety.out_of_order",), _sequence),
    GateRule(Gate.RATE, "Do commands come no faster than `max_rate_hz`?", ("safety.too_fast",), _rate),
    GateRule(Gate.STOP, "Has nobody said stop?", ("safety.stopped",), _stop),
    GateRule(
        Gate.QUEUE,
        "Is there room for it to wait?",
        ("channel.queue_full", "request.too_many", "request.duplicate_id"),
        where="the receiver's inbox",
    ),
)  # fmt: skip
ON_ACTING: tuple[GateRule[Acting], ...] = (
    GateRule(
        Gate.REST,
        "Is the connector's device there, and has its sender's last command not just failed?",
        ("plugin.failed", "plugin.no_device"),
        _rest,
    ),
    GateRule(Gate.AGE, "Has it not waited too long for its turn?", ("safety.stale",), _waited),
    GateRule(Gate.LINK, "What do round trip and loss leave of the speed?", (), _link),
    GateRule(Gate.PICTURE, "What does the age of the driver's picture leave of it?", (), _picture),
    GateRule(Gate.SHAPE, "Is it what the connector takes?", ("channel.invalid", "safety.not_finite"), _shape),
    GateRule(
        Gate.ENVELOPE,
        "Within its limits, is it still what the connector takes?",
        ("safety.out_of_range", "safety.position_unknown", "channel.invalid"),
        _envelope,
    ),
    GateRule(
        Gate.STOP,
        "After a stop: has its sender let go since, by a zero or a pause as long as the time-out?",
        ("safety.release_first",),
        _let_go,
    ),
    GateRule(
        Gate.ACT,
        "Lease and stop once more, in one step with the beginning of the act",
        (*LEASE_CODES, "safety.stopped"),
        _act,
    ),
    GateRule(
        Gate.HANDLER,
        "Does the connector carry it out?",
        ("plugin.failed", "plugin.no_device", "safety.stop", "safety.lease_lost", "safety.timeout", "safety.peer_left"),
        where="`handle_data`, which may refuse with any code; and what overtook it",
    ),
)
GateMoment = Literal["arrives", "acts"]
WAY: tuple[tuple[GateMoment, GateRule[ArrivedCommand] | GateRule[Acting]], ...] = (
    *(("arrives", rule) for rule in ON_ARRIVAL),
    *(("acts", rule) for rule in ON_ACTING),
)
"""Every gate in its place, and when it is asked."""


def refusal_on_arrival(arrival: ArrivedCommand) -> GateRefusal | None:
    """The first gate that refuses a command that has arrived; ``None``: it may wait for its turn."""
    return _first(_ARRIVAL_ASKS, arrival)


def refusal_on_acting(acting: Acting) -> GateRefusal | None:
    """The first gate that refuses a command whose turn has come; ``None``: it acts. Whatever else than
    :class:`Refused` a model of the plugin raises comes out."""
    while (refusal := _first(_ACTING_ASKS, acting)) is not None and refusal.code == OVERTAKEN:
        pass
    return refusal


def lease_code(terms: CommandTerms, leases: Leases, peer_id: str, epoch: int | None, now_s: float) -> str | None:
    """Why the leases forbid a command; asked when it arrives and when it acts."""
    return None if terms.resource is None else leases.refusal(peer_id, terms.resource, epoch, now_s)


def stop_code(terms: CommandTerms, latch: Latch) -> str | None:
    """Why a stop forbids a command; asked when it arrives and when it acts."""
    return "safety.stopped" if terms.is_motion and latch.is_stopped else None


def _asks(rules: Iterable[GateRule[T]]) -> tuple[tuple[Gate, Callable[[T], str | None]], ...]:
    return tuple((rule.gate, rule.asks) for rule in rules if rule.asks is not None)


_ARRIVAL_ASKS, _ACTING_ASKS = _asks(ON_ARRIVAL), _asks(ON_ACTING)
"""Made once: this is asked for every command."""


def _first(asks: tuple[tuple[Gate, Callable[[T], str | None]], ...], it: T) -> GateRefusal | None:
    for gate, ask in asks:
        try:
            code = ask(it)
        except WrongShape as refused:
            return GateRefusal(Gate.SHAPE, refused.code, refused.message)
        except Refused as refused:
            return GateRefusal(gate, refused.code, refused.message)
        if code is not None:
            return GateRefusal(gate, code)
    return None
