"""Cameras that params name: those that the robot doesn't have are told at their line, before anything starts."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mosaic_core import CameraLabel, Params
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer, Rehearsal
from mosaic_core.runtime.configuration.handler_problems import named_in
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.errors import ConfigError

Rehearsed = Callable[..., Rehearsal]


EYES = ("type: eye, label: front", "type: eye, label: rear")


def test_cameras_that_are_there_may_be_named_in_any_order(rehearsed: Rehearsed) -> None:
    watcher = "type: watcher, label: w, params: { main: rear, others: [front, rear], weights: { front: 0.5 } }"
    assert not rehearsed(watcher, *EYES).problems


def test_a_label_that_no_connector_has_is_told_with_its_line_and_the_nearest(rehearsed: Rehearsed) -> None:
    (problem,) = rehearsed(*EYES, "type: watcher, label: w, params: { others: [front, raer] }").problems
    assert (problem.line, problem.path) == (8, "connectors[2].params.others[1]")
    assert problem.message == "connector 'w' names the camera 'raer', which this robot does not have"
    assert problem.cure == "did you mean 'rear'?"


def test_a_label_like_no_other_is_told_what_there_is(rehearsed: Rehearsed) -> None:
    (problem,) = rehearsed(*EYES, "type: watcher, label: w, params: { weights: { x: 1 } }").problems
    assert (problem.path, problem.cure) == ("connectors[2].params.weights.x", "it has: front, rear")
    (alone,) = rehearsed("type: watcher, label: w, params: { main: front }").problems
    assert alone.cure == "add a camera with this label"


@pytest.mark.parametrize(("label", "kind"), [("battery", "gauge"), ("link", "pair"), ("link-sender", "pair")])
def test_a_connector_that_is_no_camera_is_told_with_its_type(rehearsed: Rehearsed, label: str, kind: str) -> None:
    others = ("type: gauge, label: battery", "type: pair, label: link")
    (problem,) = rehearsed(*EYES, *others, f"type: watcher, label: w, params: {{ main: {label} }}").problems
    assert problem.message == f"connector 'w' names the camera '{label}', which is of type '{kind}'"


def test_a_camera_with_a_mistake_of_its_own_is_not_missed(rehearsed: Rehearsed) -> None:
    broken = "type: eye, label: front, params: { colour: red }"
    (problem,) = rehearsed(broken, "type: watcher, label: w, params: { main: front }").problems
    assert "unknown key 'colour'" in problem.message
    (problem, other) = rehearsed(broken, "type: watcher, label: w, params: { main: rear }").problems
    assert "names the camera 'rear'" in other.message
    (problem, other) = rehearsed(broken, "type: watcher, label: w, params: { main: frnt }").problems
    assert other.cure == "did you mean 'front'?"


def test_a_label_that_only_the_robot_knows_may_be_any(rehearsed: Rehearsed) -> None:
    unknown = 'type: eye, label: "${FRONT}"'
    assert not rehearsed(unknown, "type: watcher, label: w, params: { main: rear }", allow_missing_env=True).problems


def test_data_that_is_named_is_a_data_channel_of_the_robot(rehearsed: Rehearsed) -> None:
    gauge = "type: gauge, label: battery"
    assert not rehearsed(gauge, "type: watcher, label: w, params: { data: [battery] }").problems
    (problem,) = rehearsed(*EYES, gauge, "type: watcher, label: w, params: { data: [batery] }").problems
    assert (problem.path, problem.cure) == ("connectors[3].params.data[0]", "did you mean 'battery'?")
    assert problem.message == "connector 'w' names the data channel 'batery', which this robot does not have"
    (problem,) = rehearsed(*EYES, gauge, "type: watcher, label: w, params: { data: [front] }").problems
    assert problem.message == "connector 'w' names the data channel 'front', which is of type 'eye'"


def test_a_robot_made_in_python_is_checked_too(acme: ConnectorResolver) -> None:
    watcher = {"type": "watcher", "label": "w", "params": {"main": "frnt"}}
    config = RobotConfig.model_validate({"connectors": [{"type": "eye", "label": "front"}, watcher]})
    with pytest.raises(ConfigError, match="did you mean 'front'"):
        AutoConfigurer(resolver=acme, plugins=hook_plugins([])).from_config(config)


class Inner(Params):
    camera: CameraLabel = CameraLabel("front")


class Outer(Params):
    inner: Inner = Inner()
    text: str = "rear"
    many: frozenset[CameraLabel] = frozenset({CameraLabel("left")})


def test_labels_are_found_in_every_depth_and_as_defaults() -> None:
    assert dict(named_in(Outer(), CameraLabel)) == {("inner", "camera"): "front", ("many", 0): "left"}


def test_a_label_is_text_for_its_reader_and_its_schema() -> None:
    params = Inner.model_validate({"camera": "rear"})
    assert f"{params.camera}" == "rear"
    assert params.model_dump_json() == '{"camera":"rear"}'
    assert Inner.model_json_schema()["properties"]["camera"]["type"] == "string"
