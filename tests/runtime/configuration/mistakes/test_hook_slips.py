"""What was meant as a hook and could not be called is told with its line; the rest of its plugin is heard."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import pytest

from mosaic_core import hookimpl
from mosaic_core.runtime.configuration.hook_calls import call_hook, hook_plugins
from mosaic_core.testing.pytest_plugin import InstallDistribution


class Misspelt:
    @hookimpl
    def mosaic_robot_state_chnged(self, state: str) -> None:
        raise AssertionError(state)


class Renamed:
    @hookimpl(specname="mosaic_nothing_at_all")
    def on_state(self, state: str) -> None:
        raise AssertionError(state)


class Undecorated:
    def mosaic_robot_state_changed(self, state: str) -> None:
        raise AssertionError(state)


class Generator:
    @hookimpl
    def mosaic_robot_state_changed(self, state: str) -> Any:
        yield state


class Wrapper:
    @hookimpl(wrapper=True)
    def mosaic_robot_state_changed(self, state: str) -> Any:
        return (yield state)


class Asynchronous:
    @hookimpl
    async def mosaic_robot_state_changed(self, state: str) -> None:
        raise AssertionError(state)


class OtherArgument:
    @hookimpl
    def mosaic_robot_state_changed(self, stat: str) -> None:
        raise AssertionError(stat)


class NoInstance:
    @hookimpl
    def mosaic_robot_state_changed(self, state: str) -> None:
        raise AssertionError(state)


NOT_AWAITED = "is an `async def`, which nobody would await: write `def`; what waits needs a task or a thread"
NOT_RUN = "has a `yield`, so that nobody would run its body: write it without one"


@pytest.mark.parametrize(
    ("plugin", "name", "slip"),
    [
        (
            Misspelt(),
            "mosaic_robot_state_chnged",
            "is called by nobody, for there is no such hook: did you mean 'mosaic_robot_state_changed'?",
        ),
        (Renamed(), "on_state", "is called by nobody, for there is no such hook: there are mosaic_before_configure, "),
        (Undecorated(), "mosaic_robot_state_changed", "is not called: write @hookimpl above it"),
        (Generator(), "mosaic_robot_state_changed", NOT_RUN),
        (Wrapper(), "mosaic_robot_state_changed", NOT_RUN),
        (Asynchronous(), "mosaic_robot_state_changed", NOT_AWAITED),
        (
            OtherArgument(),
            "mosaic_robot_state_changed",
            "takes 'stat', which its hook does not give: did you mean 'state'?",
        ),
        (
            NoInstance,
            "mosaic_robot_state_changed",
            "is a method of the class NoInstance, which is no object: let the entry point name an instance",
        ),
    ],
    ids=lambda one: one.__name__ if isinstance(one, type) else type(one).__name__,
)
def test_what_could_not_be_called_is_told_with_its_line_and_left_out(
    plugin: object, name: str, slip: str, caplog: pytest.LogCaptureFixture
) -> None:
    plugins = hook_plugins([])
    plugins.register(plugin, "acme 1.0:acme")
    kind = plugin if isinstance(plugin, type) else type(plugin)
    line = inspect.getsourcelines(getattr(kind, name))[1]
    (told,) = caplog.messages
    assert told.startswith(f"hook plugin acme 1.0:acme: {name} ({__file__}:{line}) {slip}")
    call_hook(plugins, "mosaic_robot_state_changed", state="ready")
    assert caplog.messages == [told]


class Mixed(Undecorated):
    """One that is left out, and three that are heard."""

    def __init__(self) -> None:
        self.heard: list[object] = []

    @hookimpl
    def mosaic_peer_closed(self, code: str = "", more: int = 0) -> None:
        self.heard.append((code, more))

    @hookimpl(specname="mosaic_stop_changed")
    def on_stop(self, is_stopped: bool) -> None:
        self.heard.append(is_stopped)

    @hookimpl(optionalhook=True)
    def mosaic_of_a_later_version(self) -> None:
        raise AssertionError


def test_the_other_hooks_of_its_plugin_are_heard(caplog: pytest.LogCaptureFixture) -> None:
    plugins, plugin = hook_plugins([]), Mixed()
    plugins.register(plugin)
    call_hook(plugins, "mosaic_peer_closed", sender=None, code="left")
    call_hook(plugins, "mosaic_stop_changed", is_stopped=True, by="Alice", reason="")
    assert plugin.heard == [("left", 0), True]
    assert len(caplog.messages) == 1


class Panic(BaseException):
    """As a library in Rust raises it."""


PANICS = "class Panic(BaseException): pass\n\nraise Panic('at import')\n"


@pytest.mark.parametrize(
    ("source", "cause"),
    [(PANICS, "Panic: at import"), ("\n\nraise ValueError('no bus')\n", "ValueError: no bus")],
    ids=["panic", "error"],
)
def test_whatever_an_import_raises_is_told_with_its_line(
    install_distribution: InstallDistribution, caplog: pytest.LogCaptureFixture, source: str, cause: str
) -> None:
    installed = install_distribution(
        "acme-broken", modules={"acme_broken": source}, entry_points={"mosaic.plugins": {"b": "acme_broken"}}
    )
    hook_plugins()
    file = installed / "acme_broken.py"
    assert caplog.messages == [f"hook plugin 'b' of acme-broken 1.0.0 can't be used: {cause} ({file}:3)"]


def test_what_the_user_ends_ends() -> None:
    plugins = hook_plugins([])
    plugins.register(raising(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        call_hook(plugins, "mosaic_robot_state_changed", state="ready")


def test_a_panic_in_a_hook_ends_no_robot(caplog: pytest.LogCaptureFixture) -> None:
    plugins = hook_plugins([])
    plugins.register(raising(Panic), "acme")
    call_hook(plugins, "mosaic_robot_state_changed", state="ready")
    assert caplog.messages == ["hook mosaic_robot_state_changed of acme failed"]


def raising(error: Callable[[], BaseException]) -> object:
    class Raising:
        @hookimpl
        def mosaic_robot_state_changed(self) -> None:
            raise error()

    return Raising()
