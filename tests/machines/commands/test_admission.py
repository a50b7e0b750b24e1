"""Every gate refuses for its own reason, and the first in the order names the refusal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands import admission
from mosaic_core.machines.commands.admission import (
    ON_ACTING,
    ON_ARRIVAL,
    OVERTAKEN,
    ArrivedCommand,
    CommandChannel,
    refusal_on_acting,
    refusal_on_arrival,
)
from mosaic_core.machines.commands.gates import Gate, GateRefusal, WrongShape
from mosaic_core.machines.commands.slow_down import Measures
from mosaic_core.machines.control.lease_events import LegacyPeers
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.words.codes import REASONS
from mosaic_core.words.errors import Refused
from mosaic_core.words.limits import NO_SLOW_DOWN, SlowDownCurves


@dataclass
class Terms:
    takes_observers: bool = False
    is_motion: bool = True
    resource: str | None = "motion"
    curves: SlowDownCurves = NO_SLOW_DOWN


@dataclass
class Leases:
    code: str | None = None

    def refusal(self, peer_id: str, resource: str, epoch: int | None, now_s: float) -> str | None:
        assert (peer_id, resource, epoch, now_s) == ("p", "motion", 7, 1.0)
        return self.code


@dataclass
class Latch:
    is_stopped: bool = False


class Empty(TokenBucket):
    """A bucket that never has anything; ``asked`` counts."""

    asked = 0

    def admits(self, now_s: float, size: float = 1.0) -> bool:
        self.asked += 1
        return False


def channel(**more: Any) -> CommandChannel:
    return CommandChannel(Terms(), Leases(), Latch(), max_age_s=0.3, **more)


def arrival(at: CommandChannel, **more: Any) -> ArrivedCommand:
    return ArrivedCommand(at, "p", more.pop("role", "operator"), more.pop("is_ours", True), 7, 1.0, **more)


FAULTS: dict[Gate, tuple[Callable[[ArrivedCommand], object], str]] = {
    Gate.ROLE: (lambda it: setattr(it, "role", "observer"), "lease.forbidden"),
    Gate.ORIGIN: (
        lambda it: (setattr(it, "is_ours", False), setattr(it.channel, "legacy", "observe")),
        "lease.original_observes",
    ),
    Gate.LEASE: (lambda it: setattr(it.channel, "leases", Leases("lease.not_holder")), "lease.not_holder"),
    Gate.AGE: (lambda it: setattr(it, "age_s", 0.31), "safety.stale"),
    Gate.SEQUENCE: (lambda it: setattr(it, "is_newest", False), "safety.out_of_order"),
    Gate.RATE: (lambda it: setattr(it.channel, "rate", Empty(1.0, 1.0)), "safety.too_fast"),
    Gate.STOP: (lambda it: setattr(it.channel, "latch", Latch(True)), "safety.stopped"),
}
"""What is wrong with a command, by the gate that finds it; in the order of the gates."""


def test_the_documented_order_is_the_one_that_is_asked() -> None:
    assert [rule.gate for rule in ON_ARRIVAL] == [
        "message", "role", "origin", "lease", "age", "sequence", "rate", "stop", "queue",
    ]  # fmt: skip
    assert [rule.gate for rule in ON_ACTING] == [
        "rest", "age", "link", "picture", "shape", "envelope", "stop", "act", "handler",
    ]  # fmt: skip
    assert list(FAULTS) == [rule.gate for rule in ON_ARRIVAL if rule.asks is not None]


def test_a_command_without_fault_may_wait_for_its_turn() -> None:
    assert refusal_on_arrival(arrival(channel())) is None
    assert refusal_on_arrival(arrival(channel(rate=TokenBucket(1.0, 1.0)), age_s=0.3)) is None, "just not too old"


@pytest.mark.parametrize("gate", FAULTS)
def test_each_gate_refuses_for_its_own_fault_with_its_name(gate: Gate) -> None:
    it = arrival(channel())
    fault, code = FAULTS[gate]
    fault(it)
    assert refusal_on_arrival(it) == GateRefusal(gate, code)
    assert code in next(rule.codes for rule in ON_ARRIVAL if rule.gate is gate)


@given(st.sets(st.sampled_from(list(FAULTS)), min_size=1))
def test_of_several_faults_the_first_gate_is_told(gates: set[Gate]) -> None:
    it = arrival(channel())
    for gate in gates:
        FAULTS[gate][0](it)
    first = next(gate for gate in FAULTS if gate in gates)
    assert refusal_on_arrival(it) == GateRefusal(first, FAULTS[first][1])


def test_what_an_earlier_gate_refuses_uses_up_no_rate() -> None:
    rate = Empty(1.0, 1.0)
    assert refusal_on_arrival(arrival(channel(rate=rate), is_newest=False)) is not None
    assert rate.asked == 0


def test_commands_come_no_faster_than_the_rate_and_a_pause_makes_room_again() -> None:
    at = channel(rate=TokenBucket(2.0, 1.0))
    at.terms = Terms(resource=None)
    refused = [refusal_on_arrival(replace(arrival(at), now_s=now_s)) for now_s in (1.0, 1.4, 1.5, 1.6, 2.0)]
    too_fast = GateRefusal(Gate.RATE, "safety.too_fast")
    assert refused == [None, too_fast, None, too_fast, None]


def test_originals_may_command_where_nothing_else_is_said() -> None:
    assert refusal_on_arrival(arrival(channel(), is_ours=False)) is None


@pytest.mark.parametrize("role", ["operator", "supervisor", "observer", "", "admin"])
@pytest.mark.parametrize("takes_observers", [False, True])
def test_who_may_command_by_role(role: str, takes_observers: bool) -> None:
    at = channel()
    at.terms = Terms(takes_observers=takes_observers)
    refused = refusal_on_arrival(arrival(at, role=role))
    assert (refused is None) == (takes_observers or role in ("operator", "supervisor"))


@pytest.mark.parametrize("is_ours", [False, True])
@pytest.mark.parametrize("legacy", ["allow", "observe", "refuse"])
@pytest.mark.parametrize("takes_observers", [False, True])
def test_originals_command_only_where_they_may(is_ours: bool, legacy: LegacyPeers, takes_observers: bool) -> None:
    at = channel(legacy=legacy)
    at.terms = Terms(takes_observers=takes_observers)
    refused = refusal_on_arrival(arrival(at, is_ours=is_ours))
    assert (refused is None) == (is_ours or legacy == "allow" or takes_observers)


def test_what_ages_never_and_what_moves_nothing_is_not_asked_for_it() -> None:
    at = channel()
    at.max_age_s, at.latch, at.leases = None, Latch(True), Leases("lease.not_holder")
    at.terms = Terms(is_motion=False, resource=None)
    assert refusal_on_arrival(arrival(at, age_s=1e9)) is None


# -- when its turn has come


class Turn:
    """Notes what it is asked; ``faults``: what goes wrong, by step."""

    def __init__(self, curves: SlowDownCurves = NO_SLOW_DOWN, link: Measures | None = None, **faults: Any) -> None:
        self.terms = Terms(curves=curves)
        self.max_age_s: float | None = 0.3
        self.waited_s = 0.3
        self.factor = 1.0
        self.measured = Measures()
        self.rest_code: str | None = None
        self.asked: list[str] = []
        self.link = link or Measures()
        self.faults = faults
        self.codes: list[str | None] = [None]
        self.holds = False

    def measure(self) -> Measures:
        self.asked.append("measure")
        return self.link

    def parse(self) -> None:
        self._step("parse")

    def limit(self) -> None:
        self._step(f"limit {self.factor:g}")

    def is_let_go(self) -> bool:
        return not self.holds

    def begin(self) -> str | None:
        self._step("begin")
        return self.codes.pop(0)

    def _step(self, name: str) -> None:
        self.asked.append(name)
        fault = self.faults.get(name.split()[0])
        if fault is not None:
            raise fault


def test_a_command_passes_link_picture_shape_envelope_and_acts() -> None:
    turn = Turn()
    assert refusal_on_acting(turn) is None
    assert turn.asked == ["measure", "parse", "limit 1", "begin"]


CURVES = SlowDownCurves(rtt_ms=((0.0, 1.0), (100.0, 0.0)), loss=None, picture_ms=((0.0, 1.0), (100.0, 0.0)))


@pytest.mark.parametrize(
    ("link", "factor"),
    [(Measures(), "1"), (Measures(rtt_ms=25.0), "0.75"), (Measures(rtt_ms=25.0, picture_ms=50.0), "0.5"),
     (Measures(rtt_ms=75.0, picture_ms=50.0), "0.25")],
)  # fmt: skip
def test_link_and_picture_leave_the_smaller_share_of_the_speed(link: Measures, factor: str) -> None:
    turn = Turn(CURVES, link)
    assert refusal_on_acting(turn) is None
    assert turn.asked[2] == f"limit {factor}"


@pytest.mark.parametrize(
    ("change", "refusal", "asked"),
    [
        ({"rest_code": "plugin.no_device"}, GateRefusal(Gate.REST, "plugin.no_device"), []),
        (
            {"waited_s": 0.31},
            GateRefusal(Gate.AGE, "safety.stale", "it waited behind a slow handle_data"),
            [],
        ),
        ({"waited_s": 9.0, "max_age_s": None}, None, ["measure", "parse", "limit 1", "begin"]),
        (
            {"faults": {"parse": Refused("channel.invalid", "not JSON")}},
            GateRefusal(Gate.SHAPE, "channel.invalid", "not JSON"),
            ["measure", "parse"],
        ),
        (
            {"faults": {"limit": Refused("safety.out_of_range", "x")}},
            GateRefusal(Gate.ENVELOPE, "safety.out_of_range", "x"),
            ["measure", "parse", "limit 1"],
        ),
        (
            {"faults": {"limit": WrongShape("channel.invalid", "linear: a number is needed")}},
            GateRefusal(Gate.SHAPE, "channel.invalid", "linear: a number is needed"),
            ["measure", "parse", "limit 1"],
        ),
        (
            {"holds": True},
            GateRefusal(Gate.STOP, "safety.release_first"),
            ["measure", "parse", "limit 1"],
        ),
        (
            {"codes": ["safety.stopped"]},
            GateRefusal(Gate.ACT, "safety.stopped"),
            ["measure", "parse", "limit 1", "begin"],
        ),
    ],
)
def test_each_gate_of_the_turn_refuses_and_nothing_after_it_is_asked(
    change: dict[str, Any], refusal: GateRefusal | None, asked: list[str]
) -> None:
    turn = Turn()
    for name, value in change.items():
        setattr(turn, name, value)
    assert refusal_on_acting(turn) == refusal
    assert turn.asked == asked


def test_a_command_that_a_safe_action_overtook_is_shaped_anew() -> None:
    turn = Turn()
    turn.codes = [OVERTAKEN, OVERTAKEN, "lease.expired"]
    assert refusal_on_acting(turn) == GateRefusal(Gate.ACT, "lease.expired")
    assert turn.asked == ["measure", "parse", "limit 1", "begin"] * 3


def test_what_a_model_raises_besides_comes_out() -> None:
    with pytest.raises(ZeroDivisionError):
        refusal_on_acting(Turn(limit=ZeroDivisionError()))


# -- what a refusal says


def test_a_refusal_tells_cause_and_cure() -> None:
    refusal = GateRefusal(Gate.LEASE, "lease.required")
    assert (refusal.cause, refusal.cure) == (REASONS["lease.required"].sentence, REASONS["lease.required"].cure)
    assert replace(refusal, message="not so").cause == "not so"
    own = GateRefusal(Gate.HANDLER, "gripper.full")
    assert (own.cause, own.cure) == ("gripper.full", "")


def test_no_code_is_told_by_two_neighbouring_gates_of_one_moment() -> None:
    """Else a refusal would not say which of them it was without its gate's name."""
    for rules in (ON_ARRIVAL, ON_ACTING):
        for one, other in pairwise(rules):
            if (one.gate, other.gate) != (Gate.SHAPE, Gate.ENVELOPE):
                assert not set(one.codes) & set(other.codes) - set(admission.LEASE_CODES)
