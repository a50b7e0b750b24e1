"""Connectors beside a node of ROS itself, with the middleware that it has by default, Fast DDS."""

from __future__ import annotations

import asyncio
import json
import os
import platform
import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from mosaic_core.cli.main import app
from mosaic_core.testing import Joined, build, collect, connector, joined, take_frames
from mosaic_ros2.connectors.image import Ros2ImageConfigurer
from mosaic_ros2.connectors.publisher import Ros2PublisherConfigurer
from mosaic_ros2.connectors.service import Ros2ServiceConfigurer
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer

ROOT = Path(__file__).parents[4]
PYTHON = Path(os.environ.get("MOSAIC_RCLPY") or ROOT / ".nox" / "ros" / "bin" / "python")
"""A Python that has rclpy; not ours, because ROS' wheels start every Python of their environment a second time."""
HAS_WHEELS = (sys.platform, platform.machine()) == ("linux", "x86_64")
MISSING = f"no Python with rclpy at {PYTHON}: `.venv/bin/nox -s ros` makes one, and MOSAIC_RCLPY names another"
DOMAIN = 1 + (os.getpid() + 115) % 230
HERE: dict[str, Any] = {"domain": DOMAIN, "interface": "lo"}
WORDS = {
    "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
    "ROS_DOMAIN_ID": str(DOMAIN),
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
}
pytestmark = pytest.mark.timeout(60)


@pytest.fixture(autouse=True)
def has_rclpy() -> None:
    if not PYTHON.exists():
        if os.environ.get("CI") and HAS_WHEELS:
            pytest.fail(MISSING)
        pytest.skip(MISSING)


@pytest.fixture
def node() -> Iterator[subprocess.Popen[str]]:
    command = [str(PYTHON), str(Path(__file__).with_name("acme_node.py"))]
    running = subprocess.Popen(command, env={**os.environ, **WORDS}, stdout=subprocess.PIPE, text=True)
    assert said(running) == {"rmw": "rmw_fastrtps_cpp"}
    yield running
    running.kill()
    running.communicate()


def said(node: subprocess.Popen[str]) -> Any:
    assert node.stdout is not None
    return json.loads(node.stdout.readline())


def made(configurer: Any, **params: Any) -> Any:
    handler = build(configurer, params={**HERE, **params, "silence_s": 20})
    handler.monotonic_s = time.monotonic  # type: ignore[method-assign]
    return handler


async def heard_by(node: subprocess.Popen[str], link: Joined, label: str, command: Any) -> Any:
    """What the node says once it hears the command, which is said until then, as by somebody who drives."""
    store = link.connection.sendable(label)
    await store.wait_open()
    hearing = asyncio.create_task(asyncio.to_thread(said, node))
    while not hearing.done():
        store.send_json(command)
        await asyncio.wait({hearing}, timeout=0.05)
    return await hearing


def test_topics_whose_types_have_lists_and_those_without_are_heard(node: subprocess.Popen[str]) -> None:
    (scan,) = collect(made(Ros2TopicConfigurer, topic="/scan", type="sensor_msgs/msg/LaserScan"), 1)
    assert scan.ranges == [1.0, 2.0, None]
    (imu,) = collect(made(Ros2TopicConfigurer, topic="/imu", type="sensor_msgs/msg/Imu"), 1)
    assert imu.linear_acceleration.z == 9.81
    (picture,) = take_frames(made(Ros2ImageConfigurer, topic="/image"), 1)
    assert np.all(picture.image == (30, 20, 10))  # type: ignore[union-attr]


async def test_commands_reach_it_within_their_limits_and_end_in_a_standstill(node: subprocess.Popen[str]) -> None:
    params = {**HERE, "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}
    safety = {"max_linear_mps": 0.5, "max_angular_radps": 1.0, "requires_lease": False, "slow_down": "off"}
    async with joined(connector(Ros2PublisherConfigurer, label="drive", params=params, safety=safety)) as link:
        command = {"linear": {"x": 2.0}, "angular": {"z": 0.25}}
        assert await heard_by(node, link, "drive", command) == {"x": 0.5, "turn": 0.25}
        while (heard := await asyncio.to_thread(said, node)) != {"x": 0.0, "turn": 0.0}:
            assert heard == {"x": 0.5, "turn": 0.25}


async def test_a_command_whose_type_has_lists_reaches_it(node: subprocess.Popen[str]) -> None:
    params = {**HERE, "topic": "/joints", "type": "sensor_msgs/msg/JointState"}
    one = connector(Ros2PublisherConfigurer, label="joints", params=params, safety={"requires_lease": False})
    async with joined(one) as link:
        found = await heard_by(node, link, "joints", {"names": ["elbow"], "positions": [0.5]})
    assert found == {"names": ["elbow"]}


async def test_its_services_are_refused_with_the_cure(node: subprocess.Popen[str]) -> None:
    params = {**HERE, "service": "/lamp", "type": "std_srvs/srv/SetBool"}
    async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
        with pytest.raises(Exception, match="RMW_IMPLEMENTATION=rmw_cyclonedds_cpp"):
            await link.connection.request("lamp", {"data": True}, timeout_s=20)


@pytest.mark.usefixtures("node")
def test_a_file_of_what_it_tells_is_valid_and_says_what_is_left_out(tmp_path: Path) -> None:
    file, here = str(tmp_path / "robot.yaml"), ("--domain", str(DOMAIN), "--interface", "lo")
    done = CliRunner().invoke(app, ["ros2", "init", file, *here])
    assert "/lamp can't be called; start its node with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp" in done.output
    assert CliRunner().invoke(app, ["validate", file]).exit_code == 0
    topics = {one["params"]["topic"] for one in yaml.safe_load(Path(file).read_text())["connectors"]}
    assert topics == {"/image", "/imu", "/rosout", "/scan", "/cmd_vel"}


def test_connectors_and_a_node_of_rclpy_live_in_one_process() -> None:
    words = {**os.environ, **WORDS, "OUR_PACKAGES": sysconfig.get_path("purelib"), "DOMAIN": str(DOMAIN)}
    script = Path(__file__).with_name("acme_in_process.py")
    done = subprocess.run([PYTHON, script], env=words, capture_output=True, text=True, timeout=50)
    assert json.loads(done.stdout) == {"heard": [1.0, 2.0, None], "told": {"x": 0.5, "turn": 0.25}}, done.stderr
