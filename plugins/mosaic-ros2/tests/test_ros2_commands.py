"""`mosaic ros2` beside real nodes: what is heard, what it says, a file that loads, and every wrong word."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.devices.ros_side import RosNode, qos
from typer.testing import CliRunner

from mosaic_core.cli.main import app
from mosaic_ros2.bus.bus import HeardEndpoint
from mosaic_ros2.bus.shared_bus import BusChoice
from mosaic_ros2.bus.silence import why_foreign_services
from mosaic_ros2.commands.hearing import service_rows
from mosaic_ros2.commands.robot_file import robot_file


@pytest.fixture
def robot(node: RosNode) -> Iterator[RosNode]:
    """A node with topics, a service and an action, which speaks all the time."""
    scans = node.publisher("/scan", "sensor_msgs/msg/LaserScan", qos(reliable=False))
    image, compressed = (
        node.publisher("/image", "sensor_msgs/msg/Image"),
        node.publisher("/image/compressed", "sensor_msgs/msg/CompressedImage"),
    )
    heard = node.subscription("/cmd_vel", "geometry_msgs/msg/Twist")
    node.server("/lamp", "std_srvs/srv/SetBool", lambda ask: {})
    node.server("/count/_action/send_goal", "example_interfaces/action/Fibonacci_SendGoal", lambda ask: {})
    is_over = threading.Event()

    def speak() -> None:
        scan = {"angle_min": -1, "angle_max": 1, "angle_increment": 1, "range_max": 8, "ranges": [1, 2, 3]}
        while not is_over.wait(0.05):
            scans.write(scan)

    speaker = threading.Thread(target=speak)
    speaker.start()
    yield node
    is_over.set()
    speaker.join()
    del image, compressed, heard


def ros2(*words: str) -> Any:
    """``said``: what the terminal would show; ``main`` writes the errors."""
    done = CliRunner().invoke(app, ["ros2", *words])
    done.said = f"{done.output}{done.exception or ''} {getattr(done.exception, 'cure', '')}"  # type: ignore[attr-defined]
    return done


def test_topics_services_messages_and_a_file_of_what_is_heard(robot: RosNode, domain: int, tmp_path: Path) -> None:
    here = ("--domain", str(domain), "--wait", "0.5")
    topics = ros2("topics", *here).output
    assert "/scan" in topics
    assert "best effort, volatile" in topics
    services = ros2("services", *here).output
    assert "example_interfaces/action/Fibonacci" in services
    lines = ros2("echo", "scan", "--count", "2", *here).output.splitlines()
    assert [json.loads(line)["ranges"] for line in lines] == [[1, 2, 3]] * 2
    file = tmp_path / "robot.yaml"
    assert "5 connectors" in ros2("init", str(file), *here).output
    text = file.read_text()
    assert "/image/compressed" not in text
    assert "max_linear_mps" in text
    assert CliRunner().invoke(app, ["validate", str(file)]).exit_code == 0
    again = ros2("init", str(file), *here)
    assert (again.exit_code, "--force" in again.output) == (2, True)
    nowhere = ros2("init", str(tmp_path / "nowhere" / "robot.yaml"), *here)
    assert (nowhere.exit_code, "can't be written" in nowhere.output) == (2, True)
    nobody = ros2("echo", "/scn", *here)
    assert nobody.exit_code == 1
    assert "did you mean '/scan'" in nobody.said
    other = ros2("echo", "/scan", "--type", "std_msgs/Bool", *here)
    assert "--type sensor_msgs/msg/LaserScan" in other.said


def test_a_domain_in_which_nobody_is_says_what_was_tried(domain: int) -> None:
    done = ros2("topics", "--domain", str(domain % 230 + 1), "--wait", "0.2")
    assert done.exit_code == 1
    assert "nothing of ROS was heard on DDS, domain" in done.said
    assert "ROS_DOMAIN_ID" in done.said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("topics", "--transport", "smoke"), "There are: dds, zenoh"),
        (("topics", "--domain", "999"), "232"),
        (("echo", "a b", "--wait", "0.2"), "is no name of ROS"),
        (("echo", "/a", "--type", "LaserScan"), "names no ROS type"),
    ],
)
def test_a_wrong_word_is_told(words: tuple[str, ...], said: str, domain: int) -> None:
    done = ros2(*words)
    assert done.exit_code != 0
    assert said in done.said


def test_a_server_that_speaks_another_way_of_requests_is_marked_and_left_out_of_the_file() -> None:
    server = HeardEndpoint("/lamp", "std_srvs/srv/SetBool", "server", is_foreign_service=True)
    assert service_rows([server], shows_all=False)[0][3].startswith("no: Fast DDS")
    assert robot_file([server], BusChoice())[1] == 0


def test_servers_that_speak_another_way_of_requests_are_named_with_the_cure() -> None:
    kinds = {
        "/lamp": "std_srvs/srv/SetBool",
        "/go/_action/send_goal": "nav2_msgs/action/NavigateToPose_SendGoal",
        "/go/_action/cancel_goal": "action_msgs/srv/CancelGoal",
        "/node/list_parameters": "rcl_interfaces/srv/ListParameters",
    }
    servers = [HeardEndpoint(name, kind, "server", is_foreign_service=True) for name, kind in kinds.items()]
    told = why_foreign_services(servers)
    assert "/go, /lamp can't be called; start its node with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp" in told
    assert why_foreign_services([HeardEndpoint("/lamp", "std_srvs/srv/SetBool", "server")]) == ""


def test_labels_are_unique_and_the_domain_stands_in_the_file() -> None:
    twins = [HeardEndpoint(name, "std_msgs/msg/Bool", "publisher") for name in ("/a/b", "/a_b", "/A/b")]
    text, count = robot_file(twins, BusChoice(domain=7, interface="eth0", peers=("10.0.0.2",)))
    assert count == 3
    assert [label in text for label in ("label: a_b\n", "label: a_b_2\n", "label: a_b_3\n")] == [True] * 3
    params = yaml.safe_load(text)["connectors"][0]["params"]
    assert params == {
        "topic": "/A/b", "type": "std_msgs/msg/Bool", "domain": 7, "interface": "eth0", "peers": ["10.0.0.2"],
    }  # fmt: skip
