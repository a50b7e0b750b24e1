"""Tells what the framework can't do for a receiver that moves something: stop it, slow it down, ask where it is."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from typing import Any

from mosaic_core.contract.declared.code_lines import standing_at
from mosaic_core.contract.devices.named_keeper import keepers_of
from mosaic_core.contract.handler import (
    DataChannelReceivable,
    Handler,
    has_safe_action,
    message_type_of,
    reports_position,
)
from mosaic_core.contract.message_fields import is_bound, may_lack
from mosaic_core.contract.message_schema import unit_at
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.runtime.configuration.catalogue_entry import receivers
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.receiver_safety import bounds_of, kind_for, resource_of, timeout_of
from mosaic_core.words.errors import Problem


def says_motion(kind: type[DataChannelReceivable[Any]]) -> bool:
    """Whether its author names ``motion_fields``; ``()`` says that it moves nothing."""
    return any("motion_fields" in vars(base) for base in kind.__mro__ if base is not DataChannelReceivable)


def guard_hints(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """What the framework can't do for a receiver that says it moves something: stop it, or slow it down."""
    safety = one.safety
    for handler in receivers(handlers):
        unstopped = [*_unstopped(one, handler)]
        yield from unstopped
        yield from _on_the_loop(one, handler)
        yield from _unasked(one, handler)
        yield from _unbounded(one, handler)
        yield from _in_degrees(one, handler)
        yield from _unheard(one, handler)
        yield from _unkept(one, handler)
        message_type, has_timeout = message_type_of(type(handler)), (safety.timeout_s or handler.timeout_s) is not None
        is_mover = has_timeout or has_safe_action(type(handler))
        own_limits = handler.limits or safety.limits or safety.field_limits()
        has_fields = says_motion(type(handler)) or handler.position_fields or own_limits
        if unstopped or not is_mover or has_fields:
            continue
        if moving := getattr(message_type, "motion_kinds", None):
            message = (
                f"connector '{one.config.label}' moves by '{next(iter(moving))}', velocities in a list, which nothing "
                "can limit"
            )
            cure = "bound and slow it down in its own code; a stop still stops it"
            yield one.problem(message, "safety", cure=cure)
            continue
        message = (
            f"nothing says which numbers move connector '{one.config.label}': a bad link does not slow it down, and "
            "after a stop was cleared no zero lets it go on, only silence"
        )
        cure = "name them in `limits`, or in the `motion_fields` of its class: `()` if it moves nothing"
        if message_type in (str, bytes):
            cure = "it takes no JSON messages, so it can't: let it stop quickly by itself"
        yield one.problem(message, "safety", cure=cure)


def _unheard(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    """It has a safe action, and moves nothing that a stop would concern."""
    kind, safety = type(handler), one.safety
    has_action = has_safe_action(kind) and not isinstance(handler, RequestHandler)
    is_guarded = timeout_of(safety, handler) is not None or resource_of(safety, handler) is not None
    has_fields = handler.motion_fields or handler.position_fields or bounds_of(handler, safety)
    if has_action and says_motion(kind) and not is_guarded and not has_fields:
        message = (
            f"connector '{one.config.label}' has a make_safe, which no stop and no silence calls: it runs when its "
            "commander leaves alone"
        )
        cure = f"write timeout_s or requires_lease = True in {kind.__name__}{standing_at(kind)}, and a stop concerns it"
        yield one.problem(message, "safety", cure=cure)


def _in_degrees(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    """Angles in radians that are bounded far beyond two turns: degrees are meant, and bound nothing."""
    for field, bounds in bounds_of(handler, one.safety).items():
        far = max((abs(end) for end in (bounds.min, bounds.max) if end is not None), default=0.0)
        if far > 2 * math.tau and unit_at(message_type_of(type(handler)), field) == "rad":
            message = f"connector '{one.config.label}': {far:g} rad of '{field}' are {far / math.tau:.1f} turns"
            cure = f"are degrees meant? {far:g}° are {math.radians(far):.4g} rad"
            place = ("safety", "limits", field) if field in one.safety.limits else ("safety",)
            yield one.problem(message, *place, cure=cure)


def acts_on_the_loop(handler: DataChannelReceivable[Any]) -> bool:
    """Whether its commands are carried out on the event loop."""
    return inspect.iscoroutinefunction(type(handler).handle_data)


def _on_the_loop(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    """It moves something on the event loop, which waits with it and for which it waits."""
    kind, has_timeout = type(handler), timeout_of(one.safety, handler) is not None
    is_leased = resource_of(one.safety, handler) is not None and not says_motion(kind)
    moves = has_timeout or is_leased or handler.motion_fields or handler.position_fields
    if moves and acts_on_the_loop(handler) and not isinstance(handler, RequestHandler):
        message = (
            f"connector '{one.config.label}' moves something in an `async def handle_data`: a call that blocks there "
            "holds up the whole robot, its stop too, and between two awaits a safe action may run"
        )
        place = standing_at(kind.handle_data)
        cure = f"write `def handle_data` in {kind.__name__}{place}, which runs on a thread of its own"
        yield one.problem(message, "safety", cure=cure)


def _unasked(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    """It reports positions, and nothing of it is one."""
    bounds = bounds_of(handler, one.safety).values()
    # A velocity whose rate is limited is refused beside a report.
    is_told = any(its.kind == "position" or its.max_rise_per_s or its.max_fall_per_s for its in bounds)
    if reports_position(handler) and not handler.position_fields and not is_told:
        kind = type(handler)
        message = f"connector '{one.config.label}' reports positions, and none of its numbers is one: nobody asks it"
        cure = f"name them in position_fields of {kind.__name__}{standing_at(kind)}, or drop reported_position"
        yield one.problem(message, "safety", cure=cure)


def _unbounded(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    """A number is limited that a message may be without: nobody knows what it is then, and nothing bounds it."""
    message_type = message_type_of(type(handler))
    for field, bounds in bounds_of(handler, one.safety).items():
        is_kind_known = bounds.kind is not None or kind_for(handler, one.safety, field) is not None
        is_filled = is_bound(field) and bounds.max is not None
        if is_kind_known or is_filled or not may_lack(message_type, field.split(".")):
            continue
        message = (
            f"'{field}' of connector '{one.config.label}' is limited, and a message may leave it out: whatever the "
            "connector takes it for then, nothing bounds"
        )
        cure = (
            f"require it in {message_type.__name__}, give it a default that is a number, or say what it is: "
            "`kind: velocity` where it is 0 then, `kind: position` where it stays as it is"
        )
        keys = ("limits", field) if field in one.safety.limits else ()
        yield one.problem(message, "safety", *keys, cure=cure)


def _unkept(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    """It drives a device that a keeper keeps open, and does not name the keeper. One that the device has for itself
    alone is nobody's to name, and whoever asks a request is told by its answer."""
    keepers = ((own, name) for own, thing in vars(handler).items() for name in keepers_of(thing))
    kept = (its for its in keepers if not its[1].startswith("_") and not isinstance(handler, RequestHandler))
    own, name = next(kept, ("", ""))
    if handler.keeper is None and own:
        kind = type(handler)
        message = (
            f"connector '{one.config.label}' has a {type(vars(handler)[own]).__name__}, which a Keeper keeps open, and "
            "names no keeper: nobody is told while that device is away, and commands go on when it is back"
        )
        yield one.problem(message, cure=f"write self.keeper = self.{own}.{name} in {kind.__name__}{standing_at(kind)}")


def _unstopped(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    """It moves something, and does not notice silence or has nothing that stops it then."""
    kind, safety = type(handler), one.safety
    resource, fields = resource_of(safety, handler), (*handler.motion_fields, *handler.position_fields)
    has_timeout = timeout_of(safety, handler) is not None
    has_action = has_safe_action(kind)
    is_bounded = isinstance(handler, RequestHandler) or (safety.on_loss or safety.on_timeout) != "callback"
    if is_bounded or (has_timeout and has_action):
        return
    is_leased = resource is not None and not says_motion(kind)
    if not fields and (has_action or not (has_timeout or is_leased)):
        return
    does = f"moves by {' and '.join(map(repr, fields))}" if fields else f"moves under the lease '{resource}'"
    if not fields and not is_leased:
        does = "has a time-out"
    missing, consequence = _LACKING[has_timeout, has_action]
    rest = "position_fields = ()" if handler.position_fields else "motion_fields = ()"
    otherwise = "leave timeout_s out" if has_timeout and not fields else rest
    cure = f"write {missing} in {kind.__name__}{standing_at(kind)}, or {otherwise} if it moves nothing"
    yield one.problem(f"connector '{one.config.label}' {does}, and {consequence}", "safety", cure=cure)


_LACKING = {
    (False, False): ("both", "nothing stops it: neither timeout_s nor make_safe"),
    (True, False): ("make_safe", "nothing stops it: without make_safe nothing happens after timeout_s"),
    (False, True): ("timeout_s", "nobody notices silence: it has make_safe, and no timeout_s"),
}
"""By whether it has a time-out and a safe action: what is missing, and what follows."""
