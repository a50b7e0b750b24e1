"""Names the robots that ``mosaic demo`` can show: the one in the yard, and those that MuJoCo simulates."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files

from mosaic_sim.demo.errors import DemoFailed


@dataclass(frozen=True, slots=True)
class DemoRobot:
    """A robot's file, which lies in ``package``, and what to try with it, a line each."""

    package: str
    file: str
    to_try: tuple[str, ...]
    distribution: str = "mosaic-sim"

    def text(self) -> str:
        """The YAML file. Raises :class:`DemoFailed` where its distribution is not installed."""
        try:
            return (files(self.package) / self.file).read_text("utf-8")
        except ModuleNotFoundError:
            message = f"{self.file.removesuffix('.yaml')} needs {self.distribution}, which is not installed"
            raise DemoFailed(message, f"pip install {self.distribution}") from None


_LET_GO = "let go: it stops. Close the tab while driving: it stops, too."
_SECOND_WINDOW = "open the address in a second window: both see the same robot."

YARD = DemoRobot(
    "mosaic_sim.demo",
    "robot.yaml",
    (
        "hold W, A, S, D or the arrow keys, or drag the drive pad: the robot drives.",
        _LET_GO,
        _SECOND_WINDOW,
        "park on the green pad behind the robot: the battery charges.",
    ),
)
ARM = DemoRobot(
    "mosaic_mujoco.robots",
    "arm.yaml",
    (
        "take control, set the sliders of `arm` and press Move: the arm goes there.",
        "Stop on the way: it stays where it is.",
        "put a block elsewhere with the gripper; `reset` puts everything back.",
        _SECOND_WINDOW,
    ),
    "mosaic-mujoco",
)
VEHICLE = DemoRobot(
    "mosaic_mujoco.robots",
    "vehicle.yaml",
    (
        "hold W, A, S, D or the arrow keys, or drag the drive pad: the vehicle drives.",
        _LET_GO,
        "push the green crate through the room; `reset` puts everything back.",
        _SECOND_WINDOW,
    ),
    "mosaic-mujoco",
)


def chosen_robot(*, arm: bool, vehicle: bool) -> DemoRobot:
    """What the options name. Raises :class:`DemoFailed` for both at once."""
    if arm and vehicle:
        raise DemoFailed("--arm and --vehicle are two robots", "choose one of them")
    return ARM if arm else VEHICLE if vehicle else YARD
