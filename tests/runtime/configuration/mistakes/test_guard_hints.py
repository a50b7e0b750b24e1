"""A receiver that moves something and does not say by which numbers: what no guard can do for it is told, as a hint."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import pytest
from pydantic import Field

from mosaic_core import DataChannelReceivable, Keeper, Message, Request, RequestHandler, unit
from mosaic_core.messages import JointTarget
from mosaic_core.runtime.configuration.auto_configurer import Rehearsal
from mosaic_core.runtime.configuration.mistakes.guard_hints import guard_hints
from mosaic_core.words.errors import Problem
from mosaic_core.words.limits import MotionKind
from mosaic_core.words.safety_config import FieldBounds, SafetyConfig

Rehearsed = Callable[..., Rehearsal]


def test_the_hint_stands_at_the_connector_and_refuses_nothing(rehearsed: Rehearsed) -> None:
    found = rehearsed("type: motor, label: wheel, params: { pin: 1 }", "type: gauge, label: battery")
    (hint,) = found.hints
    assert not found.problems
    assert (hint.line, hint.message) == (
        6,
        "nothing says which numbers move connector 'wheel': a bad link does not slow it down, and after a stop was "
        "cleared no zero lets it go on, only silence",
    )
    assert hint.cure == "name them in `limits`, or in the `motion_fields` of its class: `()` if it moves nothing"


class Speed(Message):
    mps: float


class Angle(Message):
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"rad": "position"}
    rad: float


class Stops(DataChannelReceivable[Speed]):
    def make_safe(self, cause: str) -> None:
        """Stands."""


class Named(Stops):
    motion_fields = ("mps",)


class Lamp(DataChannelReceivable[Speed]):
    """Moves nothing."""


class SaysSo(Stops):
    motion_fields = ()


class Safe:
    """Has a safe action."""

    def make_safe(self, cause: str) -> None:
        """Stands."""


class Timed(Safe, DataChannelReceivable[Speed]):
    timeout_s = 0.3


class Joint(Safe, DataChannelReceivable[Angle]):
    timeout_s = 0.3


class Arm(Safe, DataChannelReceivable[JointTarget]):
    timeout_s = 0.3


class Wheels(Message):
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"mps": "velocity"}
    mps: list[float]


class Rover(Safe, DataChannelReceivable[Wheels]):
    """Is moved by velocities in a list."""


class Text(Safe, DataChannelReceivable[str]):
    timeout_s = 0.3


class Place:
    """Of the connector in its file."""

    class config:
        label = "it"

    def __init__(self, **safety: Any) -> None:
        self.safety = SafetyConfig(**safety)

    def problem(self, message: str, *key: str, cure: str = "") -> Problem:
        return Problem(message, cure=cure)


def test_a_time_out_of_the_file_after_which_nothing_happens_is_told() -> None:
    one: Any = Place(timeout_s=1.0)
    (hint,) = guard_hints(one, (Lamp("it"),))
    told = "connector 'it' has a time-out, and nothing stops it: without make_safe nothing happens after timeout_s"
    assert hint.message == told
    assert hint.cure.startswith("write make_safe in Lamp (")
    assert hint.cure.endswith("or leave timeout_s out if it moves nothing")


@pytest.mark.parametrize(
    ("handler", "safety", "cure"),
    [
        (Stops, {}, "name them in `limits`, or in the `motion_fields` of its class: `()` if it moves nothing"),
        (Timed, {}, "name them in `limits`, or in the `motion_fields` of its class: `()` if it moves nothing"),
        (Text, {}, "it takes no JSON messages, so it can't: let it stop quickly by itself"),
        (Lamp, {}, None),
        (Named, {"timeout_s": 0.3}, None),
        (SaysSo, {"timeout_s": 0.3}, None),
        (Joint, {}, None),
        (Arm, {}, None),
        (Rover, {}, "bound and slow it down in its own code; a stop still stops it"),
        (Timed, {"limits": {"mps": FieldBounds(max=1.0)}}, None),
    ],
)
def test_who_moves_something_by_no_named_number_gets_it(handler: Any, safety: dict[str, Any], cure: str | None) -> None:
    one: Any = Place(**safety)
    assert [hint.cure for hint in guard_hints(one, (handler("it"),))] == ([] if cure is None else [cure])


class Moved(DataChannelReceivable[Speed]):
    motion_fields = ("mps",)


class Turned(DataChannelReceivable[Angle]):
    """Its message says that it is a position."""


class Leased(DataChannelReceivable[Speed]):
    requires_lease = True


class Guarded(Leased):
    motion_fields = ()


class Asked(RequestHandler[Speed, Speed]):
    requires_lease = True


@pytest.mark.parametrize(
    ("handler", "safety", "why", "rest"),
    [
        (Moved, {}, "moves by 'mps'", "motion_fields = ()"),
        (Turned, {}, "moves by 'rad'", "position_fields = ()"),
        (Leased, {}, "moves under the lease 'motion'", "motion_fields = ()"),
        (Lamp, {"requires_lease": True}, "moves under the lease 'motion'", "motion_fields = ()"),
    ],
)
def test_who_moves_something_that_nothing_stops_gets_a_hint(
    handler: Any, safety: dict[str, Any], why: str, rest: str
) -> None:
    one: Any = Place(**safety)
    (hint,) = guard_hints(one, (handler("it"),))
    said = hint.message
    assert said == f"connector 'it' {why}, and nothing stops it: neither timeout_s nor make_safe"
    assert hint.cure.startswith(f"write both in {handler.__name__} ({__file__}:")
    assert hint.cure.endswith(f"), or {rest} if it moves nothing")


class Resting(Moved):
    def make_safe(self, cause: str) -> None: ...


@pytest.mark.parametrize(
    ("handler", "safety", "missing", "consequence"),
    [
        (Moved, {"timeout_s": 0.3}, "make_safe", "nothing stops it: without make_safe nothing happens after timeout_s"),
        (Resting, {}, "timeout_s", "nobody notices silence: it has make_safe, and no timeout_s"),
    ],
)
def test_who_is_guarded_by_half_is_told_what_is_missing(
    handler: Any, safety: dict[str, Any], missing: str, consequence: str
) -> None:
    one: Any = Place(**safety)
    (hint,) = guard_hints(one, (handler("it"),))
    assert hint.message == f"connector 'it' moves by 'mps', and {consequence}"
    assert hint.cure.startswith(f"write {missing} in {handler.__name__} (")


@pytest.mark.parametrize(
    ("handler", "safety"),
    [
        (Named, {}),
        (Resting, {"timeout_s": 0.3}),
        (Asked, {}),
        (Guarded, {}),
        (Lamp, {}),
        (Moved, {"on_loss": "zero"}),
        (Leased, {"requires_lease": False}),
    ],
)
def test_who_is_stopped_or_moves_nothing_gets_none(handler: Any, safety: dict[str, Any]) -> None:
    one: Any = Place(**safety)
    assert not [hint for hint in guard_hints(one, (handler("it"),)) if "nothing stops it" in hint.message]


class Awaits(Named):
    async def handle_data(self, data: Speed) -> None:
        """Waits for the event loop."""


class AwaitsNothing(Awaits):
    motion_fields = ()


class AsksLater(RequestHandler[Speed, Speed]):
    requires_lease = True

    async def answer(self, question: Speed, request: Request) -> Speed:
        return question


def test_who_moves_something_on_the_event_loop_is_told() -> None:
    one: Any = Place(timeout_s=0.3)
    (hint,) = guard_hints(one, (Awaits("it"),))
    assert hint.message.startswith(
        "connector 'it' moves something in an `async def handle_data`: a call that blocks th"
    )
    line = Awaits.handle_data.__code__.co_firstlineno
    assert hint.cure == (f"write `def handle_data` in Awaits ({__file__}:{line}), which runs on a thread of its own")


@pytest.mark.parametrize(
    ("handler", "safety"),
    [(Named, {"timeout_s": 0.3}), (AwaitsNothing, {"requires_lease": True}), (AsksLater, {})],
)
def test_who_moves_nothing_on_the_event_loop_is_not(handler: Any, safety: dict[str, Any]) -> None:
    one: Any = Place(**safety)
    assert not [hint for hint in guard_hints(one, (handler("it"),)) if "async def" in hint.message]


class Reports(Named):
    def reported_position(self, field: str) -> float | None:
        return float(len(field))


class ReportsAngles(Joint):
    def reported_position(self, field: str) -> float | None:
        return float(len(field))


def test_who_reports_positions_and_has_none_is_told() -> None:
    one: Any = Place(timeout_s=0.3)
    (hint,) = guard_hints(one, (Reports("it"),))
    assert hint.message == "connector 'it' reports positions, and none of its numbers is one: nobody asks it"
    assert hint.cure.startswith(f"name them in position_fields of Reports ({__file__}:")


@pytest.mark.parametrize(
    ("handler", "safety"),
    [
        (ReportsAngles, {}),
        (Reports, {"timeout_s": 0.3, "limits": {"mps": FieldBounds(kind="position", max=1.0)}}),
    ],
)
def test_who_reports_the_positions_that_it_has_is_not(handler: Any, safety: dict[str, Any]) -> None:
    one: Any = Place(**safety)
    assert not [hint for hint in guard_hints(one, (handler("it"),)) if "reports positions" in hint.message]


class Push(Message):
    mps: float
    force_n: float | None = None
    max_force_n: float | None = None
    damping: float = 1.0


class Pushes(DataChannelReceivable[Push]):
    motion_fields = ("mps",)
    timeout_s = 0.3

    def make_safe(self, cause: str) -> None:
        """Stands."""


class Bounded(Pushes):
    limits: ClassVar[Mapping[str, FieldBounds]] = {"force_n": FieldBounds(max=5.0)}


def unbounded(handler: Any, **limits: FieldBounds) -> list[Problem]:
    one: Any = Place(limits=limits)
    return [hint for hint in guard_hints(one, (handler("it"),)) if "is limited" in hint.message]


@pytest.mark.parametrize(("handler", "limits"), [(Pushes, {"force_n": FieldBounds(max=5.0)}), (Bounded, {})])
def test_a_limited_number_that_a_message_may_leave_out_is_told(handler: Any, limits: dict[str, FieldBounds]) -> None:
    (hint,) = unbounded(handler, **limits)
    assert hint.message == (
        "'force_n' of connector 'it' is limited, and a message may leave it out: whatever the connector takes it for "
        "then, nothing bounds"
    )
    assert hint.cure == (
        "require it in Push, give it a default that is a number, or say what it is: `kind: velocity` where it is 0 "
        "then, `kind: position` where it stays as it is"
    )


@pytest.mark.parametrize(
    "limits",
    [
        {"mps": FieldBounds(max=1.0)},
        {"damping": FieldBounds(max=1.0)},
        {"max_force_n": FieldBounds(max=5.0)},
        {"force_n": FieldBounds(kind="velocity", max=5.0)},
    ],
)
def test_one_that_is_known_where_it_is_left_out_is_not(limits: dict[str, FieldBounds]) -> None:
    assert not unbounded(Pushes, **limits)


class Turn(Message):
    angle: float = Field(default=0.0, json_schema_extra=unit("rad"))
    reach_m: float = 0.0


class Turns(DataChannelReceivable[Turn]):
    timeout_s = 0.5
    position_fields: ClassVar[tuple[str, ...]] = ("angle", "reach_m")

    def make_safe(self, cause: str) -> None:
        """It holds."""


@pytest.mark.parametrize(
    ("limits", "cure"),
    [
        ({"angle": FieldBounds(min=-90, max=45)}, "are degrees meant? 90° are 1.571 rad"),
        ({"angle": FieldBounds(min=-1.57, max=12.5)}, None),
        ({"reach_m": FieldBounds(min=-90, max=90)}, None),
    ],
)
def test_radians_beyond_two_turns_look_like_degrees(limits: dict[str, FieldBounds], cure: str | None) -> None:
    one: Any = Place(limits=limits)
    hints = [hint for hint in guard_hints(one, (Turns("it"),)) if "turns" in hint.message]
    assert [hint.cure for hint in hints] == ([cure] if cure else [])
    assert all(hint.message == "connector 'it': 90 rad of 'angle' are 14.3 turns" for hint in hints)


class Motor:
    def __init__(self) -> None:
        self.keeper = Keeper("motor", lambda: None)


class Drives(SaysSo):
    timeout_s = 0.3

    def __init__(self, label: str, *, names_it: bool) -> None:
        super().__init__(label)
        self._motor = Motor()
        if names_it:
            self.keeper = self._motor.keeper


class Looks(Asked):
    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.motor = Motor()


class Hides(SaysSo):
    timeout_s = 0.3

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.motor = Motor()
        self.motor._keeper = self.motor.__dict__.pop("keeper")  # type: ignore[attr-defined]


def test_who_asks_it_or_can_not_name_its_keeper_is_not() -> None:
    one: Any = Place(requires_lease=False)
    assert [hint for kind in (Looks, Hides) for hint in guard_hints(one, (kind("it"),))] == []


def test_who_drives_a_kept_device_and_does_not_name_its_keeper_is_told() -> None:
    one: Any = Place()
    assert [*guard_hints(one, (Drives("it", names_it=True),))] == []
    (hint,) = guard_hints(one, (Drives("it", names_it=False),))
    assert hint.message == (
        "connector 'it' has a Motor, which a Keeper keeps open, and names no keeper: nobody is told while that device "
        "is away, and commands go on when it is back"
    )
    line = inspect.getsourcelines(Drives)[1]
    assert hint.cure == f"write self.keeper = self._motor.keeper in Drives ({__file__}:{line})"


class Switch(DataChannelReceivable[dict[str, Any]]):
    motion_fields: ClassVar[tuple[str, ...]] = ()

    def make_safe(self, cause: str) -> None:
        """Switches off."""


class LeasedSwitch(Switch):
    requires_lease = True


class Lamp(DataChannelReceivable[dict[str, Any]]):
    motion_fields: ClassVar[tuple[str, ...]] = ()


@pytest.mark.parametrize(("kind", "is_told"), [(Switch, True), (LeasedSwitch, False), (Lamp, False)])
def test_a_safe_action_that_no_stop_calls_is_told(kind: type[Any], is_told: bool) -> None:
    one: Any = Place()
    hints = [hint for hint in guard_hints(one, (kind("it"),)) if "has a make_safe" in hint.message]
    assert bool(hints) is is_told
    assert all(hint.cure.startswith("write timeout_s or requires_lease = True in Switch (") for hint in hints)
