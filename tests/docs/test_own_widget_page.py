"""The page about widgets is true: its files make a plugin whose robot starts, and its TSX is the example's.

What its JavaScript shows, `dashboard/test/ownWidgetPage.test.ts` looks at.
"""

from __future__ import annotations

import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.widgets.widget_modules import exports_of
from mosaic_core.testing import connector, joined, until
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.errors import ConfigError

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "howto" / "own-widget.md").read_text()
FILE = re.compile(r"^`(acme_arm/[\w./-]+)`:\n\n```\w+\n(.*?)^```", re.MULTILINE | re.DOTALL)
CONFIG = {
    "server": {
        "ws_url": "ws://127.0.0.1:9",
        "auth": {"type": "no-authorization", "robot_id": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"},
    },
    "connectors": [{"type": "acme-arm", "label": "arm"}, {"type": "acme-grip", "label": "grip"}],
}


def block(language: str) -> str:
    found = re.search(rf"^```{language}\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


@pytest.fixture
def module_file(install_distribution: InstallDistribution) -> Path:
    """The plugin of the page, installed; the path of its module."""
    points = tomllib.loads(block("toml"))["project"]["entry-points"]
    site = install_distribution("acme-arm", version="1.2.0", entry_points=points)
    files = dict(FILE.findall(TEXT))
    scripts = {"acme_arm/widgets/acme-arm.js", "acme_arm/widgets/acme-grip.js"}
    assert files.keys() == {"acme_arm/arm.py", "acme_arm/grip.py", *scripts}
    for name, text in files.items():
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text(text)
    return site / "acme_arm" / "widgets" / "acme-arm.js"


def test_the_plugin_of_the_page_announces_its_widgets(module_file: Path) -> None:
    arm, grip = AutoConfigurer().from_config(RobotConfig.model_validate(CONFIG)).connectors
    state, command = grip.entries
    assert (arm.entries[0].widget, state.widget, command.widget) == ("acme-arm/ArmPanel", "acme-grip/GripPanel", None)
    assert None not in (arm.entries[0].widget_module, state.widget_module)
    assert exports_of(module_file.read_text()) == {"apiVersion", "ArmPanel"}


@pytest.mark.usefixtures("module_file")
async def test_who_holds_the_lease_closes_the_gripper_of_the_page() -> None:
    configurer = import_module("acme_arm.grip").GripConfigurer
    async with joined(connector(configurer, label="grip"), takes_leases=True) as link:
        assert (await link.connection.receivable("grip").next_message()).json() == {"is_closed": False}
        commands = link.connection.sendable("grip_command")
        await commands.wait_open()
        grip = link.configured.connectors[0].handlers[0]
        await until(lambda: commands.send_json({"is_closed": True}) and grip.is_closed)


def test_the_complaint_of_the_page_is_the_real_one(module_file: Path) -> None:
    module_file.unlink()
    with pytest.raises(ConfigError) as caught:
        AutoConfigurer().from_config(RobotConfig.model_validate(CONFIG))
    (problem,) = caught.value.problems
    told = f"{problem.message} ({problem.cure})".replace(str(module_file.parents[2]), "…/site-packages")
    assert " ".join(block("text").split()) == told


def test_the_tsx_of_the_page_is_the_widget_of_the_example() -> None:
    source = ROOT / "examples" / "third-party-connector" / "widget" / "acme-workbench.tsx"
    assert block("tsx") == source.read_text()
