"""Starts the demo's children in order, watches them, and ends them all: whatever happens, nothing stays behind."""

from __future__ import annotations

import signal
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import NoReturn

from mosaic_core.runtime.lan.child_process import end_all
from mosaic_sim.demo.child import Child, mosaic_command
from mosaic_sim.demo.demo_robot import YARD, DemoRobot
from mosaic_sim.demo.own_plugin import OwnPlugin
from mosaic_sim.demo.robot_file import OwnConnector, RobotFile, robot_file
from mosaic_sim.demo.server import (
    DemoServer,
    Seed,
    check_server_is_installed,
    chosen_port,
    robot_environment,
    seeded,
)

WATCH_S = 0.25
"""How often the supervisor looks after its children."""
ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupted(Exception):
    """Ctrl+C, or a polite request to end from elsewhere."""


@dataclass(frozen=True, slots=True)
class RunningDemo:
    """A demo that runs: both children up, the robot online."""

    folder: Path
    seed: Seed
    server: DemoServer
    robot: Child
    own: tuple[OwnConnector, ...] = ()
    """What ``--with`` has brought."""
    notes: tuple[str, ...] = ()
    """What of it was changed, for people."""
    shown: DemoRobot = YARD
    simulated: tuple[OwnConnector, ...] = ()
    """The robot without what ``--with`` has brought."""

    @property
    def url(self) -> str:
        return self.server.url

    def robot_page(self, code: str = "") -> str:
        """The page of the robot; ``code`` signs the browser in. It stands in the fragment, which is never sent."""
        return f"{self.url}/robots/{self.seed.robot_id}" + (f"#code={code}" if code else "")

    def check_alive(self) -> None:
        for child in (self.server.child, self.robot):
            child.check_alive()


@contextmanager
def endings_interrupt() -> Iterator[None]:
    """Ctrl+C, SIGTERM and a closed terminal raise :class:`Interrupted` in the main thread, once."""

    def interrupt(number: int, frame: FrameType | None) -> NoReturn:
        for ending in ENDING_SIGNALS:
            signal.signal(ending, signal.SIG_IGN)  # a second Ctrl+C must not cut the tidying up short
        raise Interrupted

    before = {ending: signal.signal(ending, interrupt) for ending in ENDING_SIGNALS}
    try:
        yield
    finally:
        for ending, handler in before.items():
            signal.signal(ending, handler)


@contextmanager
def running_demo(
    port: int | None, plugins: Sequence[OwnPlugin] = (), shown: DemoRobot = YARD, *, on_trial: bool = False
) -> Iterator[RunningDemo]:
    """Server and the robot ``shown`` for the length of a ``with`` block, in a folder that is removed after it. It
    has the connectors of ``plugins``, too; ``on_trial``: with the ``trial`` of their classes, which needs no device.

    Raises :class:`~mosaic_sim.demo.errors.DemoFailed` if anything does not come up.
    """
    check_server_is_installed()
    free_port = chosen_port(port)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="mosaic-demo-")))
        children: list[Child] = []
        stack.callback(end_all, children)
        config = robot_file(folder, plugins, shown, on_trial=on_trial)
        seed = seeded(folder)
        server = DemoServer(folder, free_port, config.environment)
        children.append(server.child)
        server.wait_until_listening()
        server.sign_in(seed)
        robot = _started_robot(config, folder, robot_environment(server.url, seed))
        # First: the robot says good-bye while its server still listens.
        children.insert(0, robot)
        server.wait_for_robot(seed.robot_id, robot)
        yield RunningDemo(folder, seed, server, robot, config.own, config.notes, shown, config.simulated)


def _started_robot(config: RobotFile, folder: Path, environment: dict[str, str]) -> Child:
    command = mosaic_command("run", str(config.path), "--log-level", "warning")
    return Child("robot", command, folder / "robot.log", {**environment, **config.environment})
