"""The page about widgets is true: its files make a plugin whose robot starts, and its TSX is the example's."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.widgets.widget_modules import exports_of
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
    "connectors": [{"type": "acme-arm", "label": "arm"}],
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
    assert files.keys() == {"acme_arm/arm.py", "acme_arm/widgets/acme-arm.js"}
    for name, text in files.items():
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text(text)
    return site / "acme_arm" / "widgets" / "acme-arm.js"


def test_the_plugin_of_the_page_announces_its_widget(module_file: Path) -> None:
    (connector,) = AutoConfigurer().from_config(RobotConfig.model_validate(CONFIG)).connectors
    assert connector.entries[0].widget == "acme-arm/ArmPanel"
    assert connector.entries[0].widget_module is not None
    assert exports_of(module_file.read_text()) == {"apiVersion", "ArmPanel"}


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
