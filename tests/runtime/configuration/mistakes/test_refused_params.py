"""A configurer that refuses its params says so of the file, with path and line; other errors are its author's."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter, field_validator

from mosaic_core import (
    ConfigError,
    DataChannelConfigurer,
    DataChannelSendable,
    DeviceGone,
    MosaicError,
    Params,
)
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.words.errors import Problem


class State(DataChannelSendable[str]):
    """Tells how it is."""


class ArmParams(Params):
    port: str = "/dev/ttyACM0"
    joints: tuple[str, ...] = ()
    mode: str = "fast"

    @field_validator("mode")
    @classmethod
    def _known(cls, mode: str) -> str:
        return {"fast": "f", "slow": "s"}[mode]


class ArmConfigurer(DataChannelConfigurer[ArmParams]):
    connector_type = "arm"

    def configure(self) -> State:
        match self.params.port:
            case "config":
                cure = "name each joint once"
                raise ConfigError([Problem("'elbow' stands there twice", path="joints[1]", cure=cure)])
            case "mosaic":
                raise MosaicError("two say otherwise. Say it once.", code="config.invalid", cure="Say it once.")
            case "value":
                raise ValueError("no such port")
            case "model":
                TypeAdapter(int).validate_python("x")
            case "key":
                raise KeyError("elbow")
            case "absent":
                raise FileNotFoundError("no /dev/ttyACM0")
            case "gone":
                raise DeviceGone("no arm", "plug it in")
        return State(self.label)


@pytest.fixture
def told(write: Callable[[str], Path], robot_yaml: Callable[..., str]) -> Callable[[str], Problem]:
    def problem_of(params: str) -> Problem:
        path = write(robot_yaml(f"\n  - type: arm\n    label: it\n    params:\n{params}"))
        resolver = ConnectorResolver([EntryPoint("arm", f"{__name__}:ArmConfigurer", "mosaic.connectors")])
        validation = validate_file(path, resolver=resolver, environ={})
        rehearsal = AutoConfigurer(resolver=resolver, plugins=hook_plugins([])).rehearse(validation)
        (problem,) = (*validation.problems, *rehearsal.problems)
        assert problem.file == (__file__ if problem.code == "config.broken_plugin" else str(path))
        return problem

    return problem_of


def line_of(words: str) -> str:
    lines, first = inspect.getsourcelines(ArmConfigurer)
    return f"{__file__}:{first + next(index for index, line in enumerate(lines) if words in line)}"


def refused(*words: Any) -> str:
    return "".join(("connector 'it' of tests refuses its params: ", *words))


def test_a_config_error_is_told_at_its_place_in_the_params(told: Callable[[str], Problem]) -> None:
    problem = told("      port: config\n      joints: [elbow,\n        elbow]\n")
    assert problem.message == refused("'elbow' stands there twice")
    assert (problem.path, problem.line, problem.code) == ("connectors[0].params.joints[1]", 11, "config.invalid")
    assert problem.cure == "name each joint once"


def test_so_is_what_the_framework_says_of_a_configuration(told: Callable[[str], Problem]) -> None:
    problem = told("      port: mosaic\n")
    assert problem.message == refused("two say otherwise.")
    assert (problem.path, problem.line, problem.cure) == ("connectors[0].params", 8, "Say it once.")


def test_a_value_error_is_one_of_the_params_with_the_line_that_raised_it(told: Callable[[str], Problem]) -> None:
    problem = told("      port: value\n")
    assert problem.message == refused(f"no such port ({line_of('no such port')})")
    assert (problem.path, problem.line, problem.code) == ("connectors[0].params", 8, "config.invalid")


@pytest.mark.parametrize(("port", "words"), [("key", "KeyError: 'elbow'"), ("model", "ValidationError: ")])
def test_anything_else_is_a_mistake_of_its_author(told: Callable[[str], Problem], port: str, words: str) -> None:
    problem = told(f"      port: {port}\n")
    assert problem.message.startswith(f"connector 'it' of tests can't be made: {words}")
    assert (problem.code, problem.path) == ("config.broken_plugin", "connectors[0]")
    assert problem.file == __file__


@pytest.mark.parametrize(("port", "words"), [("absent", "FileNotFoundError: no /dev/ttyACM0"), ("gone", "no arm")])
def test_a_device_that_is_opened_before_the_robot_starts_is_told_where_to_open_it(
    told: Callable[[str], Problem], port: str, words: str
) -> None:
    problem = told(f"      port: {port}\n")
    assert words in problem.message
    assert problem.cure.startswith("open the device in the body, or by a Keeper, and raise DeviceGone there")
    assert problem.file == __file__


def test_so_is_a_validator_that_fails(told: Callable[[str], Problem]) -> None:
    problem = told("      mode: medium\n")
    assert problem.message == "'params' of 'arm' can't be checked: KeyError: 'medium'"
    assert (problem.file, problem.path, problem.code) == (__file__, "connectors[0].params", "config.broken_plugin")
