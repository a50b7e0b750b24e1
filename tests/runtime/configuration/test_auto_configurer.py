"""The documented steps: resolve, before-hook, configure, register, after-hook; what fails is named."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pluggy
import pytest

from mosaic_core import Configurer, Handler, hookimpl
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer, Configured
from mosaic_core.runtime.configuration.hook_calls import call_hook, hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.data_type import Delivery, Direction, Kind, MosaicDataType
from mosaic_core.words.errors import ConfigError, Problem

Write = Callable[[str], Path]
RobotYaml = Callable[..., str]


@pytest.fixture
def configured(acme: ConnectorResolver, write: Write, robot_yaml: RobotYaml) -> Callable[..., Configured]:
    def configure(connectors: str, plugins: pluggy.PluginManager | None = None) -> Configured:
        automatic = AutoConfigurer(resolver=acme, plugins=plugins or hook_plugins([]))
        return automatic.from_file(write(robot_yaml(connectors)), environ={})

    return configure


@pytest.fixture
def mistakes(configured: Callable[..., Configured]) -> Callable[[str], tuple[Problem, ...]]:
    def mistakes_of(connectors: str) -> tuple[Problem, ...]:
        with pytest.raises(ConfigError) as caught:
            configured(connectors)
        return caught.value.problems

    return mistakes_of


def test_the_catalogue_entry_is_derived_from_the_handler(configured: Callable[..., Configured]) -> None:
    (connector,) = configured("[{type: gauge, label: battery}]").connectors
    (entry,) = connector.entries
    assert (entry.label, entry.type, entry.kind, entry.widget) == ("battery", "gauge", Kind.DATA, "value-cards")
    assert (entry.data_type, entry.direction) == (MosaicDataType.JSON_R2U, Direction.TO_OPERATOR)
    assert [channel.label for channel in entry.channels] == ["battery"]
    assert entry.message_schema is not None
    assert entry.message_schema["properties"]["voltage_v"]["unit"] == "V"
    assert entry.safety is None


def test_a_receivers_limits_are_announced_and_its_own_timeout_counts(configured: Callable[..., Configured]) -> None:
    first, second = configured(
        "[{type: motor, label: a, params: {pin: 1}},"
        " {type: motor, label: b, params: {pin: 2}, safety: {timeout_s: 2, max_mps: 3}, delivery: reliable}]"
    ).connectors
    assert first.entries[0].safety == {"timeout_s": 0.4, "max_mps": 1.0}
    assert (first.terms_of(first.handlers[0]).mode, first.entries[0].delivery) == (Delivery.LATEST, Delivery.LATEST)
    assert second.entries[0].safety == {"timeout_s": 2.0, "max_mps": 3.0}
    assert (second.terms_of(second.handlers[0]).mode, second.entries[0].delivery) == (
        Delivery.RELIABLE,
        Delivery.RELIABLE,
    )


def test_a_camera_has_no_channel(configured: Callable[..., Configured]) -> None:
    (connector,) = configured("[{type: eye, label: front}]").connectors
    (entry,) = connector.entries
    assert (entry.kind, entry.data_type, entry.channels) == (Kind.VIDEO, MosaicDataType.MEDIA, ())
    assert entry.message_schema is None


def test_each_handler_of_a_connector_is_an_entry(configured: Callable[..., Configured]) -> None:
    (connector,) = configured("[{type: pair, label: link}]").connectors
    assert [(entry.label, entry.type, entry.direction) for entry in connector.entries] == [
        ("link-receiver", "pair", Direction.TO_ROBOT),
        ("link-sender", "pair", Direction.TO_OPERATOR),
    ]
    assert [[channel.label for channel in entry.channels] for entry in connector.entries] == [
        ["link-receiver"],
        ["link-sender"],
    ]


@pytest.mark.parametrize("init", ["pass", "super().__init__(None)", "super().__init__(5)"])
def test_a_handler_without_a_label_is_told_beside_the_other_mistakes(
    init: str, install_distribution: InstallDistribution, write: Write, robot_yaml: RobotYaml
) -> None:
    module = f"""from mosaic_core import DataChannelConfigurer, DataChannelSendable, NoParams

class Mute(DataChannelSendable[str]):
    def __init__(self) -> None:
        {init}

class MuteConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "mute"

    def configure(self) -> Mute:
        return Mute()
"""
    points = {"mosaic.connectors": {"mute": "acme_mute:MuteConfigurer"}}
    install_distribution("acme-mute", entry_points=points, modules={"acme_mute": module})
    config = write(robot_yaml("[{type: mute, label: a}, {type: mute, label: b}]"))
    with pytest.raises(ConfigError) as caught:
        AutoConfigurer(plugins=hook_plugins([])).from_file(config, environ={})
    assert len(caught.value.problems) == 2
    for problem in caught.value.problems:
        assert problem.message.endswith("can't be made: its handler has no label")
        assert problem.cure == "call super().__init__(label) with a text in Mute.__init__"
        assert (Path(problem.file).name, problem.line) == ("acme_mute.py", 3)


def test_channel_names_are_unique_beyond_labels(mistakes: Callable[[str], tuple[Problem, ...]]) -> None:
    (problem,) = mistakes("\n  - {type: pair, label: link}\n  - {type: gauge, label: link-sender}")
    assert problem.code == "config.duplicate_label"
    assert problem.line == 7
    assert problem.message == "connector 'link-sender' makes 'link-sender', which 'link' has already"


def test_every_connector_that_cannot_be_made_is_named(mistakes: Callable[[str], tuple[Problem, ...]]) -> None:
    found = mistakes(
        "\n  - {type: faulty, label: a}\n  - {type: gauge, label: b}\n  - {type: nothing, label: c}"
        "\n  - {type: hidden, label: d}"
    )
    assert [(problem.path, problem.code) for problem in found] == [
        ("connectors[0]", "config.broken_plugin"),
        ("connectors[2]", "config.broken_plugin"),
        ("connectors[3]", "config.broken_plugin"),
    ]
    assert found[0].message == "connector 'a' of acme-gauges 1.0.0 can't be made: OSError: no such bus"
    for problem, line in zip(found, ("raise OSError", "def configure", "def configure"), strict=True):
        assert line in Path(problem.file).read_text().splitlines()[(problem.line or 0) - 1]
    assert "returned None instead of a handler" in found[1].message
    assert "'_hidden'" in found[2].message


def test_a_connector_that_wants_to_end_the_program_is_a_mistake_like_any_other(
    mistakes: Callable[[str], tuple[Problem, ...]],
) -> None:
    found = mistakes("[{type: leaving, label: a}, {type: leaving, label: b, params: {when: made}}]")
    assert [(problem.path, problem.code) for problem in found] == [
        ("connectors[1]", "config.broken_plugin"),
        ("connectors[0]", "config.broken_plugin"),
    ]
    assert all(problem.message.endswith("can't be made: SystemExit: 3") for problem in found)
    (panic,) = mistakes("[{type: leaving, label: a, params: {when: panic}}]")
    assert panic.message.endswith("can't be made: GeneratorExit: panic")


def test_a_message_type_without_a_schema_is_named(mistakes: Callable[[str], tuple[Problem, ...]]) -> None:
    (problem,) = mistakes("[{type: odd, label: a}]")
    assert problem.code == "config.broken_plugin"
    assert "its message type has no JSON Schema" in problem.message


def test_limits_for_what_receives_nothing_are_a_mistake(mistakes: Callable[[str], tuple[Problem, ...]]) -> None:
    (problem,) = mistakes("[{type: gauge, label: a, safety: {timeout_s: 1}}]")
    assert problem.path == "connectors[0].safety"
    assert problem.cure == "remove `safety:`"


def test_a_configuration_made_in_python_is_configured_too(acme: ConnectorResolver) -> None:
    config = RobotConfig.model_validate(
        {
            "server": {
                "ws_url": "ws://127.0.0.1:9001",
                "auth": {"type": "no-authorization", "robot_id": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"},
            },
            "connectors": [{"type": "gauge", "label": "a", "params": {"period_s": 3}}],
        }
    )
    made = AutoConfigurer(resolver=acme, plugins=hook_plugins([])).from_config(config)
    assert made.config is config
    assert made.connectors[0].entries[0].label == "a"


class Recorder:
    def __init__(self) -> None:
        self.steps: list[tuple[str, Any]] = []

    @hookimpl
    def mosaic_before_configure(self, config: RobotConfig, configurers: Sequence[Configurer[Any]]) -> None:
        self.steps.append(("before", [configurer.label for configurer in configurers]))

    @hookimpl
    def mosaic_after_configure(self, handlers: Sequence[Handler]) -> None:
        self.steps.append(("after", [handler.label for handler in handlers]))


class Broken:
    def __init__(self, error: BaseException) -> None:
        self._error = error

    @hookimpl
    def mosaic_before_configure(self) -> None:
        raise self._error


@pytest.mark.parametrize("error", [RuntimeError("hook"), SystemExit(3)], ids=repr)
def test_hooks_see_the_steps_and_a_broken_one_disturbs_nobody(
    configured: Callable[..., Configured], caplog: pytest.LogCaptureFixture, error: BaseException
) -> None:
    plugins, recorder = hook_plugins([]), Recorder()
    plugins.register(recorder)
    plugins.register(Broken(error), "broken one")
    configured("[{type: gauge, label: a}, {type: pair, label: b}]", plugins)
    assert recorder.steps == [("before", ["a", "b"]), ("after", ["a", "b-receiver", "b-sender"])]
    assert "hook mosaic_before_configure of broken one failed" in caplog.text


def test_installed_hook_plugins_are_found_and_broken_ones_named(
    install_distribution: InstallDistribution, caplog: pytest.LogCaptureFixture
) -> None:
    source = (
        "from mosaic_core import hookimpl\nSTATES = []\n"
        "@hookimpl\ndef mosaic_robot_state_changed(state): STATES.append(state)\n"
    )
    install_distribution(
        "acme-hooks", modules={"acme_hooks": source}, entry_points={"mosaic.plugins": {"h": "acme_hooks"}}
    )
    install_distribution("acme-broken", entry_points={"mosaic.plugins": {"b": "acme_not_there"}})
    plugins = hook_plugins()
    call_hook(plugins, "mosaic_robot_state_changed", state="ready")
    import acme_hooks  # type: ignore[import-not-found]

    assert acme_hooks.STATES == ["ready"]
    assert "hook plugin 'b' of acme-broken 1.0.0 can't be used" in caplog.text


def test_installed_entry_points_are_injectable(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.ERROR):
        hook_plugins([EntryPoint("x", "nowhere_at_all", "mosaic.plugins")])
    assert "hook plugin 'x' of nowhere_at_all" in caplog.text
