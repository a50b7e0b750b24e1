"""Hundreds of thousands of random steps over lease, stop, gates, envelope and watchdog, composed as a robot composes
them; a million in a thorough run.

The walk keeps its own account of who may command, from what it sent and what the robot told. The second half of the
proof is `test_every_guard_is_needed`: with any single rule broken the same walk fails.
"""

from __future__ import annotations

import math
import os
import random
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import pytest

from mosaic_core.machines.commands import admission
from mosaic_core.machines.commands.admission import (
    ArrivedCommand,
    CommandChannel,
    refusal_on_acting,
    refusal_on_arrival,
)
from mosaic_core.machines.commands.command_order import ArrivalBaseline, CommandOrder
from mosaic_core.machines.commands.gates import Gate, GateRefusal
from mosaic_core.machines.commands.release_first import CommandPauses, ReleaseFirst
from mosaic_core.machines.commands.safety_envelope import MAX_RISE_STEP_S, SafetyEnvelope, Shaped
from mosaic_core.machines.commands.slow_down import Measures
from mosaic_core.machines.commands.watchdog import Watchdog
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.lease_events import (
    Commanded,
    DeadlinePassed,
    Effect,
    Event,
    Kept,
    LeaseChanged,
    LegacyPeers,
    Party,
    PartyJoined,
    PartyLeft,
    QueueChanged,
    Released,
    Reply,
    RequestAnswered,
    Requested,
)
from mosaic_core.machines.control.lease_queue import LeaseQueue
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.machines.timing.pacing import BURST_S, TokenBucket
from mosaic_core.words.codes import REASONS
from mosaic_core.words.control import Role
from mosaic_core.words.limits import FieldLimit, SlowDownCurves

TIMEOUT_S = 0.3
EXPIRY_S = 2.0
MAX_AGE_S = 0.5
MAX_RATE_HZ = 15.0
TOP_SPEED, RISE, FALL = 1.0, 2.0, 4.0
RESOURCES = ("motion", "arm")
ROUNDING = 1e-9
Verdict: TypeAlias = "GateRefusal | list[Effect]"


class Broken(AssertionError):
    """What must never happen has happened."""


def demand(is_true: bool, promise: str) -> None:
    if not is_true:
        raise Broken(promise)


CURVES = SlowDownCurves(rtt_ms=((100.0, 1.0), (1100.0, 0.0)), picture_ms=((100.0, 1.0), (600.0, 0.0)))


@dataclass(frozen=True, slots=True)
class Terms:
    """What holds for the commands of a base, or an arm."""

    resource: str
    takes_observers = False
    is_motion = True
    curves = CURVES


class Turn:
    """A command whose turn has come, as a receiver makes it."""

    max_age_s: float | None = MAX_AGE_S

    def __init__(self, robot: Robot, receiver: Receiver, peer_id: str, packet: Packet, link: Measures, now_s: float):
        self.terms = receiver.terms
        self.waited_s = 0.0
        self.rest_code: str | None = None
        self.factor = 1.0
        self.measured = Measures()
        self.shaped: Shaped | None = None
        self.effects: list[Effect] = []
        self._robot, self._receiver, self._peer_id = robot, receiver, peer_id
        self._packet, self._link, self._now_s = packet, link, now_s

    def measure(self) -> Measures:
        return self._link

    def parse(self) -> None: ...

    def limit(self) -> None:
        self._before = self._receiver.envelope.state
        self.shaped = self._receiver.envelope.shaped(self._packet.message, self.factor, self._now_s)

    def is_let_go(self) -> bool:
        assert self.shaped is not None
        key = self._robot.key_of(self._peer_id)
        if not (self.shaped.wants_motion and self._receiver.release.is_holding(key)):
            return True
        self._receiver.envelope.restore(self._before)
        return False

    def begin(self) -> str | None:
        robot, resource, now_s = self._robot, self.terms.resource, self._now_s
        code = admission.lease_code(self.terms, robot.desk, self._peer_id, self._packet.epoch, now_s)
        code = code or admission.stop_code(self.terms, robot.latch)
        if code is not None:
            self._receiver.envelope.restore(self._before)
        else:
            self.effects = robot.handle(Commanded(self._peer_id, resource), now_s)
            self._receiver.watchdog.feed(self._peer_id, now_s)
            assert self.shaped is not None
            if not self.shaped.wants_motion:
                self._receiver.release.let_go(robot.key_of(self._peer_id))
        return code


class Receiver:
    """A base, or an arm: it moves with its velocity until told otherwise."""

    def __init__(self, resource: str) -> None:
        self.resource = resource
        self.terms = Terms(resource)
        self.watchdog = Watchdog(TIMEOUT_S)
        self.release = ReleaseFirst()
        self.envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), None, None, TOP_SPEED, RISE, FALL)])
        self.velocity = (0.0, 0.0)
        self.set_at_s = -math.inf
        self.by = ""

    def set_velocity(self, x: float, y: float, by: str, now_s: float) -> None:
        self.velocity, self.set_at_s, self.by = (x, y), now_s, by

    def make_safe(self) -> None:
        self.watchdog.disarm()
        self.envelope.stand_still()
        self.set_velocity(0.0, 0.0, "", -math.inf)

    @property
    def is_moving(self) -> bool:
        return self.velocity != (0.0, 0.0)


class Robot:
    """The machines of control and nothing else: what the runtime does between its sockets and its threads."""

    def __init__(self, first_epoch: int, legacy: LegacyPeers) -> None:
        self.desk = LeaseDesk(RESOURCES, expiry_s=EXPIRY_S, first_epoch=first_epoch, legacy=legacy)
        self.latch = StopLatch()
        self.receivers = {resource: Receiver(resource) for resource in RESOURCES}
        self.pauses: dict[tuple[str, str], CommandPauses] = {}
        self.keys: dict[str, str] = {}
        self.orders: dict[tuple[str, str], CommandOrder] = {}
        self.channels = {
            resource: CommandChannel(
                receiver.terms, self.desk, self.latch, legacy, MAX_AGE_S, TokenBucket.of_rate(MAX_RATE_HZ)
            )
            for resource, receiver in self.receivers.items()
        }

    def handle(self, event: Event, now_s: float) -> list[Effect]:
        effects = self.desk.handle(event, now_s)
        for effect in effects:
            if isinstance(effect, LeaseChanged) and effect.before is not None:
                receiver = self.receivers[effect.resource]
                if receiver.watchdog.peer_left(effect.before.peer_id):
                    receiver.make_safe()
        return effects

    def join(self, party: Party, now_s: float) -> list[Effect]:
        baseline = ArrivalBaseline()
        for resource in RESOURCES:
            self.orders[party.peer_id, resource] = CommandOrder(baseline)
            self.pauses[party.peer_id, resource] = CommandPauses(now_s)
            if self.latch.is_stopped:
                self.receivers[resource].release.joined(party.session_id or party.peer_id)
        self.keys[party.peer_id] = party.session_id or party.peer_id
        return self.handle(PartyJoined(party), now_s)

    def leave(self, peer_id: str, on_purpose: bool, now_s: float) -> list[Effect]:
        for resource, receiver in self.receivers.items():
            self.orders.pop((peer_id, resource), None)
            self.pauses.pop((peer_id, resource), None)
            if receiver.watchdog.peer_left(peer_id):
                receiver.make_safe()
        self.keys.pop(peer_id)
        return self.handle(PartyLeft(peer_id, on_purpose), now_s)

    def expire(self, receiver: Receiver, now_s: float) -> None:
        if receiver.watchdog.expire(now_s):
            receiver.make_safe()

    def key_of(self, peer_id: str) -> str:
        return self.keys[peer_id]

    def arrives(self, party: Party, resource: str, packet: Packet, now_s: float) -> GateRefusal | None:
        age_s, is_newest = 0.0, True
        if packet.epoch is not None:
            order = self.orders[party.peer_id, resource]
            age_s, is_newest = order.arrived(packet.seq, packet.stamp_us, now_s)
        channel, is_ours = self.channels[resource], not party.is_original
        arrival = ArrivedCommand(channel, party.peer_id, party.role, is_ours, packet.epoch, now_s, age_s, is_newest)
        seq = packet.seq if packet.epoch is not None else None
        pause_s = self.pauses[party.peer_id, resource].arrived(seq, now_s, packet.stamp_us)
        refusal = refusal_on_arrival(arrival)
        if refusal is None and pause_s >= TIMEOUT_S:
            self.receivers[resource].release.let_go(self.key_of(party.peer_id))
        return refusal

    def acts(self, party: Party, resource: str, packet: Packet, link: Measures, now_s: float) -> Verdict:
        """Why it was refused, or what follows from its acting."""
        receiver = self.receivers[resource]
        turn = Turn(self, receiver, party.peer_id, packet, link, now_s)
        refusal = refusal_on_acting(turn)
        if refusal is not None:
            return refusal
        assert turn.shaped is not None
        if turn.shaped.is_idle:
            receiver.watchdog.disarm()
        else:
            velocity = turn.shaped.message.get("v", {})
            receiver.set_velocity(velocity.get("x", 0.0), velocity.get("y", 0.0), party.peer_id, now_s)
        return turn.effects

    def stop(self, by: str, id: str, now_s: float) -> None:
        if self.latch.stop(by, "", id, now_s):
            for receiver in self.receivers.values():
                receiver.release.stopped(self.keys.values())
                receiver.make_safe()
            self.latch.made_safe(now_s)


@dataclass(slots=True)
class Packet:
    """A command on its way: it may arrive late, twice, or after its successor."""

    number: int
    seq: int
    stamp_us: int
    epoch: int | None
    message: dict[str, Any]
    sent_s: float


@dataclass(slots=True)
class Operator:
    """Somebody at the other end, with a clock of its own, honest or not."""

    party: Party
    skew_s: float
    first_seq: int
    joined_s: float
    sent: dict[str, list[Packet]] = field(default_factory=lambda: {resource: [] for resource in RESOURCES})
    count: int = 0
    heard: dict[str, int] = field(default_factory=dict)
    least_delay_s: float = math.inf


@dataclass(slots=True)
class Claim:
    """Who holds a resource, as far as the walk can tell."""

    party: Party
    epoch: int
    alive_s: float


WISHES: list[Any] = [math.nan, math.inf, -math.inf, "1", None, True, [0.5]]
ROLES: list[Role] = ["operator", "operator", "operator", "supervisor", "observer"]


class Walk:
    """One robot and its operators, step by step."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.now_s = self.rng.uniform(0.0, 1e6)
        self.legacy: LegacyPeers = "observe" if seed % 3 == 2 else "allow"
        self.last_epoch = self.rng.randrange(1, 2**31)
        self.robot = Robot(self.last_epoch + 1, self.legacy)
        self.operators: dict[str, Operator] = {}
        self.claims: dict[str, Claim] = {}
        self.believers: dict[str, set[str]] = {resource: set() for resource in RESOURCES}
        self.is_stopped = False
        self.factor = 1.0
        self.wish = (0.0, 0.0)
        self.recent = deque([Party("", "")], maxlen=8)
        self.valid_at_s = dict.fromkeys(RESOURCES, -math.inf)
        self.last_motion = dict.fromkeys(RESOURCES, (0.0, -math.inf))
        self.to_let_go: dict[str, set[str]] = {resource: set() for resource in RESOURCES}
        self.may_hold: dict[str, set[str]] = {resource: set() for resource in RESOURCES}
        self.said_at_s: dict[tuple[str, str], float] = {}
        self.rated_at_s = dict.fromkeys(RESOURCES, -math.inf)
        self.recent_s = {resource: deque([-math.inf] * int(MAX_RATE_HZ * (1 + BURST_S))) for resource in RESOURCES}
        self.accepted = self.refused = self.born = 0
        self.codes: set[str] = set()
        self.gates: set[Gate] = set()
        for _ in range(4):
            self.join()

    def run(self, steps: int) -> Walk:
        for _ in range(steps):
            self.step()
        return self

    def step(self) -> None:
        chance = self.rng.random()
        self.pass_time(chance)
        chance = self.rng.random()
        if chance < 0.72:
            self.command()
        elif chance < 0.82:
            self.keep()
        elif chance < 0.90:
            self.request()
        elif chance < 0.915:
            self.release()
        elif chance < 0.935:
            self.answer()
        elif chance < 0.94:
            self.stop()
        elif chance < 0.975:
            self.clear()
        elif chance < 0.985:
            self.factor = self.rng.choice((1.0, 1.0, 0.5, 0.1, 0.0))
        elif chance < 0.993:
            self.join()
        else:
            self.leave()
        self.check()

    # -- time

    def pass_time(self, chance: float) -> None:
        """Mostly the period of a command loop, now and then a silence. Sometimes the robot's loop is blocked, so that
        leases end late; the watchdog has a thread of its own."""
        step_s = chance * 0.04 if chance < 0.97 else self.rng.random() * 3.0
        until_s = self.now_s + step_s
        is_blocked = chance > 0.985
        while True:
            due_s, receiver = until_s, None
            for one in self.robot.receivers.values():
                dog_s = one.watchdog.due_at_s
                if dog_s is not None and dog_s <= due_s:
                    due_s, receiver = dog_s, one
            lease_s = None if is_blocked else self.robot.desk.deadline_s
            if lease_s is not None and lease_s < due_s:
                self.now_s = lease_s
                self.follow(self.robot.handle(DeadlinePassed(), lease_s), DeadlinePassed())
                if self.robot.desk.deadline_s == lease_s:
                    raise Broken("a lease ends at its deadline")
            elif receiver is not None:
                self.now_s = due_s
                self.robot.expire(receiver, due_s)
                demand(not receiver.is_moving, "a receiver stands when its commander has been silent for timeout_s")
                demand(receiver.watchdog.due_at_s is None, "the watchdog fires once")
            else:
                self.now_s = until_s
                break
        for claim in self.claims.values():
            is_over = self.now_s > claim.alive_s + EXPIRY_S
            demand(is_blocked or not is_over, "a lease that nobody keeps ends")

    # -- what operators do

    def command(self) -> None:
        resource = "motion" if self.rng.random() < 0.7 else "arm"
        claim = self.claims.get(resource)
        operator = self.operators.get(claim.party.peer_id) if claim and self.rng.random() < 0.75 else None
        operator = operator or self.somebody()
        if operator is None:
            return
        packet = self.packet(operator, resource)
        party, factor = operator.party, self.factor
        said_at_s = self.said_at_s.get((party.peer_id, resource), operator.joined_s)
        self.said_at_s[party.peer_id, resource] = self.now_s
        verdict: Verdict | None = self.robot.arrives(party, resource, packet, self.now_s)
        if verdict is None:
            if self.now_s - said_at_s >= TIMEOUT_S:
                self.to_let_go[resource].discard(party.session_id or party.peer_id)
            self.while_it_waits()
            verdict = self.robot.acts(party, resource, packet, self.link(), self.now_s)
        if isinstance(verdict, GateRefusal):
            self.refused += 1
            self.codes.add(verdict.code)
            self.gates.add(verdict.gate)
            self.judge_refusal(verdict, operator, resource, packet)
            if verdict.gate in (Gate.STOP, Gate.ENVELOPE, Gate.ACT):
                self.rated_at_s[resource] = self.now_s
        else:
            self.accepted += 1
            self.rated_at_s[resource] = self.now_s
            self.judge(operator, resource, packet, verdict)
            self.judge_release(party, resource, packet)
            self.judge_motion(resource, packet, factor)
        if packet.epoch is not None:
            operator.least_delay_s = min(operator.least_delay_s, self.now_s - packet.sent_s)
            operator.heard[resource] = max(operator.heard.get(resource, 0), packet.number)

    def while_it_waits(self) -> None:
        """Seldom something changes between a command's arrival and its turn."""
        chance = self.rng.random()
        if chance < 0.002:
            self.stop()
        elif chance < 0.01:
            self.request()
        elif chance < 0.013:
            self.release()
        else:
            return
        self.check()

    def link(self) -> Measures:
        """A link, or a picture, that leaves the share of the speed that the walk wants."""
        if self.rng.random() < 0.5:
            return Measures(rtt_ms=1100.0 - 1000.0 * self.factor)
        return Measures(rtt_ms=0.0, picture_ms=600.0 - 500.0 * self.factor)

    def packet(self, operator: Operator, resource: str) -> Packet:
        """A new command, mostly within 20 ms, or one that was overtaken, or one that was there before."""
        rng, sent = self.rng, operator.sent[resource]
        if not operator.party.is_original and sent and rng.random() < 0.15:
            return rng.choice(sent)
        sent_s = self.now_s - rng.random() * (0.02 if rng.random() < 0.97 else 1.5)
        operator.count += 1
        packet = Packet(
            number=operator.count,
            seq=(operator.first_seq + operator.count) % 2**32,
            stamp_us=int((sent_s + operator.skew_s) * 1e6),
            epoch=None if operator.party.is_original else self.epoch_of(resource),
            message=self.message(),
            sent_s=sent_s,
        )
        sent.append(packet)
        if len(sent) > 12:
            del sent[0]
        if len(sent) > 1 and rng.random() < 0.1:
            return sent[-2]  # overtaken by the newest, which is still under way
        return packet

    def epoch_of(self, resource: str) -> int:
        """The present one, which everybody knows; sometimes an older one, another resource's, or none."""
        chance = self.rng.random()
        claim = self.claims.get(resource)
        if claim is not None and chance < 0.92:
            return claim.epoch
        other = self.claims.get(self.rng.choice(RESOURCES))
        return self.rng.choice((0, max(0, self.last_epoch - 1), self.last_epoch, other.epoch if other else 1))

    def message(self) -> dict[str, Any]:
        rng = self.rng
        chance = rng.random()
        if chance < 0.80:
            if chance < 0.1:
                self.wish = (4.0 * rng.random() - 2.0, 2.0 * rng.random() - 1.0)
            return {"v": {"x": self.wish[0], "y": self.wish[1]}}
        if chance < 0.92:
            return {"v": {"x": 0.0, "y": 0.0}}
        if chance < 0.96:
            return {"v": {"x": 1e300 * (rng.random() - 0.5)}}
        return {"v": {"x": rng.choice(WISHES), "y": 0.0}}

    def keep(self) -> None:
        operator, resource = self.somebody(), self.rng.choice(RESOURCES)
        claim = self.claims.get(resource)
        if claim is not None and self.rng.random() < 0.7:
            operator = self.operators.get(claim.party.peer_id, operator)
        if operator is None:
            return
        event = Kept(operator.party.peer_id, {resource: self.epoch_of(resource)})
        is_holder = claim is not None and claim.party.peer_id == event.peer_id and claim.epoch == event.epochs[resource]
        if claim is not None and is_holder and self.now_s < claim.alive_s + EXPIRY_S:
            claim.alive_s = self.now_s
        self.follow(self.robot.handle(event, self.now_s), event)

    def request(self) -> None:
        operator = self.somebody()
        if operator is None:
            return
        resource = self.rng.choice((*RESOURCES, "motion", "nothing"))
        force = self.rng.random() < 0.25
        event = Requested(operator.party.peer_id, resource, self.rng.choice(("", "  ", "I must")), force)
        self.follow(self.robot.handle(event, self.now_s), event)
        claim = self.claims.get(resource)
        may_force = operator.party.role == "supervisor" and event.reason.strip() != ""
        may_ask = not operator.party.is_original and (may_force or not event.force)
        if claim is not None and claim.party.peer_id == event.peer_id and may_ask:
            claim.alive_s = self.now_s

    def release(self) -> None:
        operator = self.somebody()
        if operator is not None:
            event = Released(operator.party.peer_id, self.rng.choice(RESOURCES))
            self.follow(self.robot.handle(event, self.now_s), event)

    def answer(self) -> None:
        operator, other, resource = self.somebody(), self.somebody(), self.rng.choice(RESOURCES)
        waiting = self.robot.desk.queue(resource)
        claim = self.claims.get(resource)
        if claim is not None and self.rng.random() < 0.5:
            operator = self.operators.get(claim.party.peer_id, operator)
        if operator is None or other is None:
            return
        to_peer_id = self.rng.choice(waiting).party.peer_id if waiting else other.party.peer_id
        event = RequestAnswered(operator.party.peer_id, resource, to_peer_id, self.rng.random() < 0.7)
        self.follow(self.robot.handle(event, self.now_s), event)

    def stop(self) -> None:
        operator = self.somebody()
        if operator is not None:
            self.robot.stop(operator.party.name, str(self.rng.randrange(100)), self.now_s)
            self.hold_all()
            self.is_stopped = True
            demand(not any(one.is_moving for one in self.robot.receivers.values()), "everything stands after a stop")

    def hold_all(self) -> None:
        """Whoever is there when it is stopped, or comes while it is, must let go."""
        if not self.is_stopped:
            keys = {one.party.session_id or one.party.peer_id for one in self.operators.values()}
            for holding in (*self.to_let_go.values(), *self.may_hold.values()):
                holding |= keys

    def clear(self) -> None:
        operator = self.somebody()
        if operator is None:
            return
        party, latch = operator.party, self.robot.latch
        code = latch.clear(party, self.robot.desk.holds_any(party.peer_id, self.now_s))
        if code is None:
            mine = [claim for claim in self.claims.values() if claim.party.peer_id == party.peer_id]
            holds = any(self.now_s < claim.alive_s + EXPIRY_S for claim in mine)
            may = party.is_person and not party.is_original and party.role != "observer"
            demand(may and (holds or party.role == "supervisor"), "a holder or a supervisor in person clears a stop")
            self.is_stopped = False
        else:
            self.codes.add(code)

    def join(self) -> None:
        """Somebody new, or a session that comes back on another peer connection."""
        rng = self.rng
        if len(self.operators) >= 6:
            self.leave()
        self.born += 1
        old = rng.choice(self.recent) if rng.random() < 0.5 else None
        role, is_person, is_original = rng.choice(ROLES), rng.random() < 0.5, rng.random() < 0.15
        session_id = rng.choice(("", f"s{self.born}"))
        if old is not None and old.session_id:
            session_id, role, is_person, is_original = old.session_id, old.role, old.is_person, old.is_original
        party = Party(f"p{self.born}", session_id, f"n{self.born}", role, is_person and not is_original, is_original)
        self.recent.append(party)
        skew_s = rng.choice((0.0, 3600.0, -3600.0, rng.uniform(-5.0, 5.0)))
        skew_s = max(skew_s, 1.0 - self.now_s)
        self.operators[party.peer_id] = Operator(party, skew_s, rng.randrange(2**32), self.now_s)
        if self.is_stopped:
            for holding in (*self.to_let_go.values(), *self.may_hold.values()):
                holding.add(session_id or party.peer_id)
        self.follow(self.robot.join(party, self.now_s), PartyJoined(party))

    def leave(self) -> None:
        operator = self.somebody()
        if operator is not None:
            event = PartyLeft(operator.party.peer_id, self.rng.random() < 0.5)
            effects = self.robot.leave(event.peer_id, event.on_purpose, self.now_s)
            for believers in self.believers.values():
                believers.discard(event.peer_id)
            del self.operators[event.peer_id]
            self.follow(effects, event)
            left = {claim.party.peer_id for claim in self.claims.values()}
            demand(not (event.on_purpose and event.peer_id in left), "who says bye holds nothing")
            moved_by = {one.by for one in self.robot.receivers.values() if one.is_moving}
            demand(event.peer_id not in moved_by, "nothing moves for somebody who is gone")

    def somebody(self) -> Operator | None:
        return self.rng.choice(list(self.operators.values())) if self.operators else None

    # -- the account

    def follow(self, effects: list[Effect], event: Event) -> None:
        for effect in effects:
            if isinstance(effect, LeaseChanged):
                self.judge_change(effect, event)
                if effect.holder is None:
                    self.claims.pop(effect.resource, None)
                else:
                    holder = self.operators[effect.holder.peer_id].party
                    self.claims[effect.resource] = Claim(holder, effect.epoch, self.now_s)
            elif isinstance(effect, Reply):
                self.hear(effect)
            else:
                demand(isinstance(effect, QueueChanged), "no other effect")
        if not effects:
            return
        for resource, believers in self.believers.items():
            demand(len(believers) <= 1, "at most one operator believes to hold a lease")
            claim = self.claims.get(resource)
            demand(not believers or (claim is not None and claim.party.peer_id in believers), "who lost it was told")

    def hear(self, reply: Reply) -> None:
        operator = self.operators.get(reply.peer_id)
        demand(operator is not None and not operator.party.is_original, "who can hear a reply gets it")
        demand(reply.code == "" or reply.code in REASONS, f"{reply.code} is a known code")
        self.codes.add(reply.code)
        if reply.outcome == "granted":
            self.believers[reply.resource].add(reply.peer_id)
        elif reply.outcome == "ended":
            self.believers[reply.resource].discard(reply.peer_id)

    def judge_change(self, change: LeaseChanged, event: Event) -> None:
        """A lease changes hands only by the rules."""
        claim = self.claims.get(change.resource)
        before, new, cause = claim.party if claim else None, change.holder, change.cause
        self.codes.add(cause)
        if change.before is not None:
            demand(before is not None and change.before.peer_id == before.peer_id, "it says from whom")
        if new is not None:
            demand(change.epoch > self.last_epoch, "every grant has an epoch of its own")
            self.last_epoch = change.epoch
            demand(new.peer_id in self.operators, "a lease is given to somebody who is there")
            new = self.operators[new.peer_id].party
            demand(new.role != "observer", "an observer holds nothing")
            demand(not new.is_original or self.legacy == "allow", "an original peer commands only where it may")
        if claim is None or before is None:
            demand(new is not None and cause == "", "what was free is given")
            return
        if new is not None and not new.is_person and cause in ("lease.expired", "lease.released", "lease.peer_left"):
            waiting = self.robot.desk.queue(change.resource)
            demand(not any(one.party.is_person for one in waiting), "persons come before programs")
        if cause == "lease.expired":
            demand(self.now_s >= claim.alive_s + EXPIRY_S, "a lease that is kept doesn't expire")
            demand(self.now_s == claim.alive_s + EXPIRY_S or self.now_s > claim.alive_s, "it expires on time")
        elif cause == "lease.released":
            demand(isinstance(event, Released) and self.is_same(event.peer_id, before), "the holder releases")
        elif cause == "lease.peer_left":
            demand(
                isinstance(event, PartyLeft) and event.on_purpose and event.peer_id == before.peer_id, "the holder left"
            )
        elif cause == "lease.handed_over":
            demand(
                isinstance(event, RequestAnswered) and event.grant and event.peer_id == before.peer_id,
                "the holder gives",
            )
        else:
            demand(isinstance(event, Requested) and new is not None, "somebody asked")
            assert isinstance(event, Requested)
            assert new is not None
            self.judge_taking(cause, event, before, new)

    def judge_taking(self, cause: str, event: Requested, before: Party, new: Party) -> None:
        demand(new.peer_id == event.peer_id, "who asks gets it")
        if cause == "peer.replaced":
            demand(self.is_same(new.peer_id, before), "a session gets its lease back")
            return
        demand(new.is_person or not before.is_person, "a program never takes from a person")
        if cause == "lease.preempted":
            demand(new.is_person and not before.is_person, "a person takes from a program")
        else:
            demand(cause == "lease.taken_over" and event.force, "otherwise by force")
            demand(new.role == "supervisor" and event.reason.strip() != "", "a supervisor with a reason")

    def is_same(self, peer_id: str, party: Party) -> bool:
        mine = self.operators[peer_id].party.session_id if peer_id in self.operators else ""
        return peer_id == party.peer_id or (mine != "" and mine == party.session_id)

    def judge(self, operator: Operator, resource: str, packet: Packet, effects: list[Effect]) -> None:
        """A command was accepted: may it have been?"""
        party, now_s = operator.party, self.now_s
        demand(not self.is_stopped, "no command after a stop until it is cleared")
        self.follow(effects, Commanded(party.peer_id, resource))
        if party.is_original:
            demand(self.legacy == "allow", "an original peer commands only where it may")
        else:
            demand(all(one.resource != resource for one in effects), "an accepted command changes no lease")
            demand(packet.number > operator.heard.get(resource, 0), "nothing is repeated, nothing goes back")
            age_s = now_s - packet.sent_s - operator.least_delay_s
            allowed_s = MAX_AGE_S + 0.001 + 0.001 * (now_s - operator.joined_s)
            demand(age_s <= allowed_s, "nothing acts that was too old on arrival")
        claim = self.claims.get(resource)
        demand(claim is not None and claim.party.peer_id == party.peer_id, "only the holder commands")
        assert claim is not None
        demand(party.role != "observer", "an observer commands nothing")
        demand(now_s < claim.alive_s + EXPIRY_S, "nobody commands by a lease that has expired")
        demand(party.is_original or packet.epoch == claim.epoch, "no command of an old epoch")
        claim.alive_s = self.valid_at_s[resource] = now_s
        recent_s = self.recent_s[resource]
        demand(now_s - recent_s.popleft() >= 1.0 - ROUNDING, "never more commands a second than allowed")
        recent_s.append(now_s)

    def judge_release(self, party: Party, resource: str, packet: Packet) -> None:
        """After a stop nobody moves anything who has not let go since."""
        key, wish = party.session_id or party.peer_id, packet.message["v"]
        is_held = key in self.to_let_go[resource]
        demand(not (is_held and any(wish.values())), "who sends on through a stop moves nothing")
        self.to_let_go[resource].discard(key)
        self.may_hold[resource].discard(key)

    def judge_refusal(self, refusal: GateRefusal, operator: Operator, resource: str, packet: Packet) -> None:
        """A command was refused: is that the reason?"""
        code = refusal.code
        party, claim = operator.party, self.claims.get(resource)
        is_holder = claim is not None and claim.party.peer_id == party.peer_id
        is_current = claim is not None and self.now_s < claim.alive_s + EXPIRY_S
        is_true = {
            "safety.out_of_order": packet.number <= operator.heard.get(resource, 0),
            "safety.stale": self.now_s - packet.sent_s - operator.least_delay_s > MAX_AGE_S - ROUNDING,
            "safety.stopped": self.is_stopped,
            "safety.release_first": (party.session_id or party.peer_id) in self.may_hold[resource],
            "safety.too_fast": self.now_s - self.rated_at_s[resource] < 1.0,
            "safety.out_of_range": "v" in packet.message,
            "lease.forbidden": party.role == "observer",
            "lease.original_observes": party.is_original and self.legacy == "observe",
            "lease.not_holder": claim is not None and not is_holder,
            "lease.expired": is_holder and not is_current,
            "lease.old_epoch": not is_current or (is_holder and claim is not None and packet.epoch != claim.epoch),
            "lease.required": not is_current or not packet.epoch,
        }
        demand(is_true[code], f"{code} is told only where it is so")

    def judge_motion(self, resource: str, packet: Packet, factor: float) -> None:
        """What the receiver was given stays inside the envelope."""
        wish = packet.message["v"]
        wishes = (wish.get("x", 0.0), wish.get("y", 0.0))
        is_number = all(isinstance(one, float) and math.isfinite(one) for one in wishes)
        demand(is_number, "what is no number moves nothing")
        speed = math.hypot(*self.robot.receivers[resource].velocity)
        demand(speed <= TOP_SPEED + ROUNDING, "never faster than the limit")
        last_speed, last_at_s = self.last_motion[resource]
        most = max(last_speed, factor * min(TOP_SPEED, math.hypot(*wishes)))
        demand(speed <= most + ROUNDING, "never faster than the link allows, but for slowing down")
        elapsed_s = self.now_s - last_at_s
        demand(speed - last_speed <= RISE * min(elapsed_s, MAX_RISE_STEP_S) + ROUNDING, "it never rises too fast")
        demand(last_speed - speed <= FALL * elapsed_s + ROUNDING, "it never falls too fast")

    def check(self) -> None:
        """What holds after every step."""
        for resource, receiver in self.robot.receivers.items():
            self.last_motion[resource] = (math.hypot(*receiver.velocity), receiver.set_at_s)
            if not receiver.is_moving:
                continue
            demand(not self.is_stopped, "nothing moves after a stop until it is cleared")
            demand(self.now_s - self.valid_at_s[resource] <= TIMEOUT_S, "nothing moves without commands")
            claim = self.claims.get(resource)
            demand(claim is not None and claim.party.peer_id == receiver.by, "nothing moves for a non-holder")
            demand(receiver.by in self.operators, "nothing moves for somebody who is gone")


EVERYTHING = {
    "lease.expired", "lease.forbidden", "lease.force_forbidden", "lease.handed_over", "lease.not_holder",
    "lease.old_epoch", "lease.peer_left", "lease.person_commands", "lease.preempted", "lease.queued", "lease.released",
    "lease.required", "lease.taken_over", "lease.denied", "lease.unknown_resource", "peer.replaced",
    "safety.out_of_order", "safety.out_of_range", "safety.stale", "safety.stopped", "safety.too_fast",
    "safety.release_first",
}  # fmt: skip


SEEDS = range(8 if os.environ.get("MOSAIC_THOROUGH") else 3)
"""Every third robot refuses pages that know no leases."""


@pytest.mark.parametrize("seed", SEEDS)
def test_no_random_walk_breaks_a_promise(seed: int) -> None:
    walk = Walk(seed).run(125_000)
    assert walk.accepted > 5_000, "it drove"
    assert walk.refused > 10_000, "it was refused"
    missing = EVERYTHING - walk.codes
    assert not missing, "it came everywhere"
    assert walk.gates >= {Gate.ROLE, Gate.LEASE, Gate.AGE, Gate.SEQUENCE, Gate.RATE, Gate.STOP, Gate.ENVELOPE, Gate.ACT}


# -- the same walk with one rule broken ------------------------------------------------------------------------------


Patch = Callable[[pytest.MonkeyPatch], None]


def unless(owner: type, code: str) -> Patch:
    """Commands that would be refused for ``code`` pass."""

    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        right: Callable[..., str | None] = owner.__dict__["refusal"]

        def refusal(self: object, *arguments: object) -> str | None:
            verdict = right(self, *arguments)
            return None if verdict == code else verdict

        monkeypatch.setattr(owner, "refusal", refusal)

    return patch


def without(*gates: Gate) -> Patch:
    """Nobody asks at these gates."""

    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        for name in ("_ARRIVAL_ASKS", "_ACTING_ASKS"):
            asks = getattr(admission, name)
            monkeypatch.setattr(admission, name, tuple(one for one in asks if one[0] not in gates))

    return patch


def both(*patches: Patch) -> Patch:
    """What two gates see to, one behind the other."""

    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        for one in patches:
            one(monkeypatch)

    return patch


def instead(owner: type, name: str, broken: Any) -> Patch:
    """``name`` of ``owner`` is replaced."""
    return lambda monkeypatch: monkeypatch.setattr(owner, name, broken)


def in_module(name: str, broken: Any) -> Patch:
    return lambda monkeypatch: monkeypatch.setattr(name, broken)


def around(owner: type, name: str, broken: Callable[..., Any]) -> Patch:
    """``broken(right, self, …)`` is called instead of ``right(self, …)``."""

    def patch(monkeypatch: pytest.MonkeyPatch) -> None:
        right = owner.__dict__[name]
        monkeypatch.setattr(owner, name, lambda self, *arguments: broken(right, self, *arguments))

    return patch


def as_if(
    right: Callable[..., list[Effect]], self: Any, event: Requested, now_s: float, **changes: Any
) -> list[Effect]:
    """The request is judged as if the party were another one."""
    party = self._peers[event.peer_id]
    self._peers[event.peer_id] = replace(party, **changes)
    effects = right(self, event, now_s)
    self._peers[event.peer_id] = party
    return effects


def as_a_person(right: Callable[..., list[Effect]], self: Any, event: Requested, now_s: float) -> list[Effect]:
    return as_if(right, self, event, now_s, is_person=True)


def any_clear(right: Callable[..., str | None], self: StopLatch, party: Party, holds: bool) -> str | None:
    return right(self, Party("", "", role="supervisor", is_person=True), True)


def keep_without_epoch(
    right: Callable[..., None], self: Any, peer_id: str, resource: str, epoch: int, now_s: float
) -> None:
    right(self, peer_id, resource, self.epoch(resource), now_s)


def keep_of_anybody(
    right: Callable[..., None], self: Any, peer_id: str, resource: str, epoch: int, now_s: float
) -> None:
    holder = self.holder(resource)
    right(self, holder.peer_id if holder else "", resource, epoch, now_s)


def same_epoch_again(right: Callable[..., list[Effect]], self: Any, *arguments: Any) -> list[Effect]:
    before = self._next_epoch
    effects = right(self, *arguments)
    self._next_epoch = before
    return effects


def fleeting_stop(right: Callable[..., bool], self: StopLatch, *arguments: Any) -> bool:
    is_new = right(self, *arguments)
    self.is_stopped = False
    return is_new


def forgiving_force(right: Callable[..., list[Effect]], self: Any, event: Requested, now_s: float) -> list[Effect]:
    return as_if(right, self, replace(event, reason="because"), now_s, role="supervisor")


def groundless_force(right: Callable[..., list[Effect]], self: Any, event: Requested, now_s: float) -> list[Effect]:
    return right(self, replace(event, reason="because"), now_s)


def without_numbers(message: Any, path: tuple[str, ...], field: str) -> float | None:
    """Whatever is there."""
    value: Any = message
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return None if value is None else value if isinstance(value, float) else 1.0


def begin_unasked(right: Callable[..., str | None], self: Turn) -> str | None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(admission, "lease_code", lambda *_: None)
        patch.setattr(admission, "stop_code", lambda *_: None)
        return right(self)


def far_too_far(last: Any, target: Any, limit: FieldLimit, places: Any, elapsed_s: float) -> float:
    return 1.0


GUARDS: dict[str, Patch] = {
    "only the holder commands": unless(LeaseDesk, "lease.not_holder"),
    "an old epoch is refused": unless(LeaseDesk, "lease.old_epoch"),
    "an epoch is required": unless(LeaseDesk, "lease.required"),
    "an expired lease is refused before its end is noticed": unless(LeaseDesk, "lease.expired"),
    "an observer may not command": instead(
        LeaseDesk, "_may_command", lambda self, party: not party.is_original or self._legacy == "allow"
    ),
    "an original peer may not command where it only observes": both(
        without(Gate.ORIGIN), instead(LeaseDesk, "_may_command", lambda self, party: party.role != "observer")
    ),
    "a lease expires": instead(LeaseDesk, "_expired", lambda self, now_s: []),
    "a keep-alive names the epoch": around(LeaseDesk, "_kept", keep_without_epoch),
    "a keep-alive is the holder's": around(LeaseDesk, "_kept", keep_of_anybody),
    "a holder that leaves has left": instead(LeaseDesk, "_left", lambda self, peer_id, now_s: []),
    "a queue forgets those who left": instead(LeaseQueue, "drop_peer", lambda self, peer_id: False),
    "persons come before programs": instead(LeaseQueue, "_insert", lambda self, waiting: self._waiting.append(waiting)),
    "every grant has a new epoch": around(LeaseDesk, "_give", same_epoch_again),
    "who lost a lease is told": instead(LeaseDesk, "_ended", lambda self, *_: []),
    "only a supervisor uses force": around(LeaseDesk, "_requested", forgiving_force),
    "force needs a reason": around(LeaseDesk, "_requested", groundless_force),
    "a program takes nothing from a person": around(LeaseDesk, "_requested", as_a_person),
    "an original takes only what is free": around(
        LeaseDesk,
        "_commanded",
        lambda right, self, peer_id, resource, now_s: self._give(
            self._leases[resource], self._peers[peer_id], "", "", now_s
        ),
    ),
    "an empty session is shared with nobody": instead(
        Party, "is_same_session", lambda self, other: self.session_id == other.session_id
    ),
    "a stop is latched": around(StopLatch, "stop", fleeting_stop),
    "a stop is cleared by a person who may": around(StopLatch, "clear", any_clear),
    "a stop runs the safe actions": around(StopLatch, "stop", lambda right, self, *rest: right(self, *rest) and False),
    "silence stops": instead(Watchdog, "expire", lambda self, now_s: False),
    "silence is counted from the last command": instead(Watchdog, "due_at_s", property(lambda self: None)),
    "the commander's leaving stops": instead(Watchdog, "peer_left", lambda self, peer_id: False),
    "order": without(Gate.SEQUENCE),
    "age": without(Gate.AGE),
    "age is measured from the fastest, whatever the clocks say": instead(
        ArrivalBaseline, "age_s", lambda self, stamp_us, now_s: now_s - stamp_us / 1e6
    ),
    "rate": without(Gate.RATE),
    "only finite numbers move": in_module("mosaic_core.machines.commands.safety_envelope.number_at", without_numbers),
    "clamp": in_module("mosaic_core.machines.commands.safety_envelope.clamped", lambda *_: None),
    "slew": in_module("mosaic_core.machines.commands.safety_envelope.reach", far_too_far),
    "slew for as long as it was": in_module("mosaic_core.machines.commands.slew.MAX_RISE_STEP_S", 10.0),
    "the link": without(Gate.LINK),
    "the picture": without(Gate.PICTURE),
    "letting go after a stop": instead(ReleaseFirst, "is_holding", lambda self, key: False),
    "letting go of those who came during a stop": instead(ReleaseFirst, "joined", lambda self, key: None),
    "a stop": in_module("mosaic_core.machines.commands.admission.stop_code", lambda *_: None),
    "the lease when it arrives or when it acts": in_module(
        "mosaic_core.machines.commands.admission.lease_code", lambda *_: None
    ),
    "the lease and the stop once more when it acts": around(Turn, "begin", begin_unasked),
    "after a safe action everything begins at zero": instead(SafetyEnvelope, "stand_still", lambda self: None),
}


def first_steps() -> None:
    for seed in range(12):
        Walk(seed).run(10_000)


@pytest.mark.parametrize("guard", GUARDS)
def test_every_guard_is_needed(guard: str, monkeypatch: pytest.MonkeyPatch) -> None:
    GUARDS[guard](monkeypatch)
    with pytest.raises(Broken):
        first_steps()


def test_the_broken_rules_are_put_right_again() -> None:
    first_steps()
