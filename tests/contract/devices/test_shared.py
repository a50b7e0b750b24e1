"""What is shared is held against what the robot does with it, and its author is told file, line and cure."""

from __future__ import annotations

import inspect
from contextlib import contextmanager, nullcontext
from typing import Any

import pytest

from mosaic_core import DeviceGone, MosaicError, NoParams, Shared


class Thing:
    """What no robot can enter."""


class Door:
    """Raises what it is given."""

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def __enter__(self) -> None:
        raise self.error

    def __exit__(self, *_: object) -> None: ...


def told_by(make: Any) -> MosaicError:
    with pytest.raises(MosaicError) as told:
        Shared().of("motor").get("acme:motor", make)
    line = inspect.getsourcelines(told_by)[1] + 2
    assert told.value.at == (__file__, line)
    assert told.value.message.startswith(f"{__file__}:{line}: ")
    return told.value


def test_a_thing_in_place_of_what_makes_it_is_told_with_the_line_that_gave_it() -> None:
    error = told_by(Thing())
    assert error.code == "config.broken_plugin"
    assert "shared.get('acme:motor', …) got a Thing" in error.message
    assert error.cure.startswith("Write `lambda:` before it")


@pytest.mark.parametrize(("make", "called"), [(Thing, "a Thing"), (lambda: None, "None")])
def test_what_can_not_be_entered_is_told_when_it_is_made(make: Any, called: str) -> None:
    error = told_by(make)
    assert f"is {called}, which has no __enter__ and no __exit__." in error.message


def test_an_enter_that_fails_names_its_line_and_the_keeper() -> None:
    shared = Shared()
    shared.get("acme:motor", lambda: Door(OSError("no such port")))
    with pytest.raises(MosaicError, match="a Door can't be entered: OSError: no such port") as told:
        shared.enter()
    assert told.value.code == "plugin.failed"
    line = inspect.getsourcelines(Door.__enter__)[1] + 1
    assert told.value.at == (__file__, line)
    assert "Keeper" in told.value.cure


def test_an_enter_of_a_generator_names_its_line() -> None:
    @contextmanager
    def opened() -> Any:
        raise OSError("no such port")
        yield

    shared = Shared()
    shared.get("acme:motor", opened)
    with pytest.raises(MosaicError) as told:
        shared.enter()
    assert told.value.at == (__file__, inspect.getsourcelines(opened)[1] + 2)


def test_what_an_enter_says_of_its_own_is_passed_on() -> None:
    shared, own = Shared(), MosaicError("the wires are swapped", code="acme.swapped", cure="Swap them.")
    shared.get("acme:motor", lambda: Door(own))
    with pytest.raises(MosaicError) as told:
        shared.enter()
    assert told.value is own


class Remembering:
    def __init__(self, **remembered: Any) -> None:
        self.__dict__.update(remembered)

    def __enter__(self) -> None: ...
    def __exit__(self, *_: object) -> None: ...


@pytest.mark.parametrize(
    ("remembered", "has"), [({}, "no params"), ({"params": {"port": 1}}, "params that are none of a connector")]
)
def test_a_thing_that_forgets_its_params_is_told_where_they_are_compared(remembered: dict[str, Any], has: str) -> None:
    shared = Shared().of("motor")
    with pytest.raises(MosaicError) as told:
        shared.agreed("acme:motor", lambda: Remembering(**remembered), NoParams(), "the motor")
    line = inspect.getsourcelines(test_a_thing_that_forgets_its_params_is_told_where_they_are_compared)[1]
    said = f"what shared.agreed('acme:motor', …) makes is a Remembering, which has {has}. Let its __init__ remember"
    assert told.value.at[0] == __file__
    assert (told.value.at[1] or 0) > line
    assert said in told.value.message
    assert "self.params = params" in told.value.cure


class Panic(BaseException):
    """As those of extensions in Rust."""


@pytest.mark.parametrize(
    ("error", "said", "code"),
    [
        (DeviceGone("no motor", "plug it in"), "no motor; plug it in", "plugin.no_device"),
        (Panic("at the disco"), "Panic: at the disco", "plugin.failed"),
        (SystemExit(3), "SystemExit: 3", "plugin.failed"),
    ],
)
@pytest.mark.parametrize(("users", "whose"), [(["arm"], "connector 'arm'"), (["b", "a"], "connectors 'a', 'b'")])
def test_whatever_an_enter_raises_names_the_connectors_and_the_line(
    error: BaseException, said: str, code: str, users: list[str], whose: str
) -> None:
    shared = Shared()
    for user in users:
        shared.of(user).get("acme:motor", lambda: Door(error))
    with pytest.raises(MosaicError) as told:
        shared.enter()
    line = inspect.getsourcelines(Door.__enter__)[1] + 1
    assert told.value.message == f"{__file__}:{line}: a Door of {whose} can't be entered: {said}."
    assert (told.value.code, told.value.at) == (code, (__file__, line))
    assert "Keeper" in told.value.cure


def test_what_can_not_be_left_is_told_likewise() -> None:
    class Stuck:
        def __enter__(self) -> None: ...

        def __exit__(self, *_: object) -> None:
            raise Panic("it jams")

    shared = Shared()
    shared.of("arm").get("acme:motor", Stuck)
    shared.enter()
    with pytest.raises(MosaicError) as told:
        shared.leave()
    line = inspect.getsourcelines(Stuck.__exit__)[1] + 1
    assert (
        told.value.message
        == f"{__file__}:{line}: a {Stuck.__qualname__} of connector 'arm' can't be left: Panic: it jams."
    )


def test_what_is_entered_is_named_to_whoever_wants_to_watch_it() -> None:
    shared, named = Shared(), list[str]()
    shared.of("arm").get("acme:motor", lambda: nullcontext())

    @contextmanager
    def around(what: str) -> Any:
        named.append(what)
        yield

    shared.enter(around)
    assert named == ["the __enter__ of a nullcontext of connector 'arm'"]
