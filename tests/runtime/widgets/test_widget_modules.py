"""The modules of widgets that distributions ship: found without importing code, refused with who, where and a cure."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.configuration.local_connectors import connectors_beside
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.widgets.widget_modules import (
    FoundModule,
    announced_module,
    exports_of,
    installed_modules,
    is_shipped,
    module_with,
    read_module,
)
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.catalogue import MAX_WIDGET_MODULE_BYTES
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.errors import ConfigError, MosaicError, PluginError

MODULE = "export const apiVersion = 1\nexport function ArmPanel() { return null }\n"
CONNECTOR = """
from mosaic_core import DataChannelConfigurer, DataChannelSendable, NoParams

class Arm(DataChannelSendable[dict]):
    widget = "acme-arm/ArmPanel"

class ArmConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "acme-arm"

    def configure(self) -> Arm:
        return Arm(self.label)
"""
InstallArm = Callable[..., Path]


@pytest.fixture
def install_arm(install_distribution: InstallDistribution) -> InstallArm:
    """``install_arm(text)``: acme-arm 1.2.0 with this module; returns the path of its file. None: without the file."""

    def install(text: str | bytes | None = MODULE, name: str = "acme-arm", folder: str = "acme_arm.widgets") -> Path:
        points = {"mosaic.widgets": {name: folder}, "mosaic.connectors": {"acme-arm": "acme_arm.arm:ArmConfigurer"}}
        modules = {"acme_arm.__init__": "raise SystemExit('nobody asked for this')", "acme_arm.arm": CONNECTOR}
        site = install_distribution("acme-arm", version="1.2.0", modules=modules, entry_points=points)
        path = site / "acme_arm" / "widgets" / "acme-arm.js"
        path.parent.mkdir()
        if text is not None:
            path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return install


def refusal(hint: str) -> MosaicError:
    with pytest.raises(MosaicError) as caught:
        module_with(hint)
    assert caught.value.code == "config.broken_plugin"
    return caught.value


def found_with(name: str) -> list[FoundModule | PluginError]:
    return [
        one
        for one in installed_modules()
        if (one.announced.name == name if isinstance(one, FoundModule) else name in one.message)
    ]


def test_a_module_is_announced_with_its_distribution_hash_and_size(install_arm: InstallArm) -> None:
    path = install_arm()
    found = module_with("acme-arm/ArmPanel")
    assert found.path == path
    assert found.announced.wire() == {
        "name": "acme-arm",
        "distribution": "acme-arm",
        "version": "1.2.0",
        "sha256": hashlib.sha256(MODULE.encode()).hexdigest(),
        "sizeBytes": len(MODULE),
    }
    assert announced_module("acme-arm/ArmPanel") == found.announced
    assert "acme_arm" not in sys.modules


def test_stock_widgets_have_no_module() -> None:
    assert not is_shipped("drive-pad")
    assert announced_module("drive-pad") is None
    assert announced_module(None) is None


def test_a_missing_file_is_told_with_distribution_and_path(install_arm: InstallArm) -> None:
    path = install_arm(None)
    error = refusal("acme-arm/ArmPanel")
    assert error.message == f"acme-arm 1.2.0 has no file {path}"
    assert error.cure == "build it, and let the wheel carry the folder acme_arm/widgets"
    assert announced_module("acme-arm/ArmPanel") is None


def test_the_place_of_a_missing_file_is_beside_the_code_and_not_beside_the_metadata(
    install_distribution: InstallDistribution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = tmp_path / "source" / "acme_arm" / "widgets"
    code.mkdir(parents=True)
    (code.parent / "__init__.py").touch()
    monkeypatch.syspath_prepend(code.parents[1])
    install_distribution("acme-arm", entry_points={"mosaic.widgets": {"acme-arm": "acme_arm.widgets"}})
    (error,) = [one for one in installed_modules() if isinstance(one, PluginError)]
    assert error.message == f"acme-arm 1.0.0 has no file {code / 'acme-arm.js'}"


def test_a_distribution_installed_from_its_sources_has_its_file_beside_its_code(
    install_distribution: InstallDistribution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install_distribution("acme-arm", entry_points={"mosaic.widgets": {"acme-arm": "acme_arm.widgets"}})
    path = tmp_path / "checkout" / "acme_arm" / "widgets" / "acme-arm.js"
    path.parent.mkdir(parents=True)
    path.write_text(MODULE)
    (tmp_path / "checkout" / "acme_arm" / "__init__.py").write_text("raise SystemExit('nobody asked for this')")
    monkeypatch.syspath_prepend(str(tmp_path / "checkout"))
    assert module_with("acme-arm/ArmPanel").path == path


def test_an_unknown_module_gets_the_nearest_name(install_arm: InstallArm) -> None:
    install_arm()
    assert "ships widgets as 'acme-am'; did you mean 'acme-arm'?" in refusal("acme-am/ArmPanel").message


def test_an_export_that_is_not_there_gets_the_nearest_name(install_arm: InstallArm) -> None:
    path = install_arm()
    message = refusal("acme-arm/ArmPanell").message
    assert message == f"{path} of acme-arm 1.2.0 exports no 'ArmPanell'; did you mean 'ArmPanel'?"


@pytest.mark.parametrize("hint", ["acme-arm/", "acme-arm/Arm Panel", "acme-arm/../x", "/"])
def test_what_no_module_can_export_is_refused(install_arm: InstallArm, hint: str) -> None:
    install_arm()
    assert refusal(hint).cure == "write module/Export, such as acme-arm/ArmPanel"


def test_a_name_that_two_distributions_claim_is_refused(
    install_arm: InstallArm, install_distribution: InstallDistribution
) -> None:
    install_arm()
    install_distribution("acme-fork", entry_points={"mosaic.widgets": {"acme-arm": "acme_fork.widgets"}})
    message = refusal("acme-arm/ArmPanel").message
    assert message == "the widgets 'acme-arm' are claimed by acme-arm 1.2.0 and acme-fork 1.0.0"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"x" * (MAX_WIDGET_MODULE_BYTES + 1), "has more than 2048 KiB"),
        (b"\xff\xfe", "can't be read: 'utf-8'"),
    ],
)
def test_a_file_that_no_page_could_load_is_refused(install_arm: InstallArm, content: bytes, words: str) -> None:
    install_arm(content)
    assert words in refusal("acme-arm/ArmPanel").message


@pytest.mark.parametrize(
    ("name", "folder"),
    [("acme-arm", "../../etc"), ("acme-arm", "acme_arm.widgets:x"), ("../x", "acme_arm"), ("A", "a")],
)
def test_an_entry_point_that_names_no_file_is_refused(name: str, folder: str) -> None:
    with pytest.raises(PluginError, match="is no module name and the package of its file"):
        read_module(EntryPoint(name, folder, "mosaic.widgets"))


def test_one_that_is_broken_hides_no_other(install_arm: InstallArm, install_distribution: InstallDistribution) -> None:
    install_arm()
    install_distribution("acme-broken", entry_points={"mosaic.widgets": {"acme-arm": "acme_broken.widgets"}})
    good, bad = found_with("acme-arm")
    assert isinstance(good, FoundModule)
    assert isinstance(bad, PluginError)
    assert bad.distribution == "acme-broken 1.0.0"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("export function A() {}\nexport async function b() {}", {"A", "b"}),
        ("export const A = 1; export class B {}", {"A", "B"}),
        ("const a=1;export{a as ArmPanel,b,};", {"ArmPanel", "b"}),
        ("function A() {}", set()),
    ],
)
def test_the_exports_of_a_module_are_seen(text: str, names: set[str]) -> None:
    assert exports_of(text) == names


def configured(*, type_: str = "acme-arm") -> Any:
    server = {
        "ws_url": "ws://127.0.0.1:9",
        "auth": {"type": "no-authorization", "robot_id": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"},
    }
    document = {"server": server, "connectors": [{"type": type_, "label": "arm"}]}
    return AutoConfigurer().from_config(RobotConfig.model_validate(document))


@pytest.fixture
def importable(install_arm: InstallArm) -> InstallArm:
    """The distribution with a package that can be imported, as a robot does with the connector that it uses."""

    def install(text: str | None = MODULE) -> Path:
        path = install_arm(text)
        (path.parents[1] / "__init__.py").write_text("")
        return path

    return install


def test_the_catalogue_of_a_robot_has_the_module(importable: InstallArm) -> None:
    importable()
    (connector,) = configured().connectors
    assert connector.entries[0].widget == "acme-arm/ArmPanel"
    assert connector.entries[0].widget_module == module_with("acme-arm/ArmPanel").announced
    assert connector.entries[0].short().widget_module is not None


def test_a_robot_whose_widget_is_missing_does_not_start(importable: InstallArm) -> None:
    path = importable(None)
    with pytest.raises(ConfigError) as caught:
        configured()
    (problem,) = caught.value.problems
    assert problem.code == "config.broken_plugin"
    assert problem.message == (
        f"connector 'arm' of acme-arm 1.2.0 names the widget 'acme-arm/ArmPanel': acme-arm 1.2.0 has no file {path}"
    )
    assert problem.cure == "build it, and let the wheel carry the folder acme_arm/widgets"
    assert Path(problem.file).read_text().splitlines()[(problem.line or 0) - 1].startswith("class Arm(")


def test_a_connector_beside_the_file_may_name_an_installed_widget_and_no_other(
    install_arm: InstallArm, tmp_path: Path
) -> None:
    config = tmp_path / "robot" / "mosaic_config.yaml"
    (config.parent / "connectors").mkdir(parents=True)
    (config.parent / "connectors" / "arm.py").write_text(CONNECTOR.replace('"acme-arm"\n', '"own-arm"\n'))
    config.write_text("version: 1\nconnectors:\n  - { type: own-arm, label: arm }\n")

    def complaints() -> list[str]:
        resolver = ConnectorResolver(local=connectors_beside(config))
        rehearsal = AutoConfigurer(resolver=resolver).rehearse(validate_file(config, resolver=resolver))
        return [problem.message for problem in rehearsal.problems]

    (complaint,) = complaints()
    assert "connector 'arm' of connectors/arm.py names the widget 'acme-arm/ArmPanel': no installed" in complaint
    install_arm()
    assert complaints() == []


@pytest.mark.parametrize(
    ("text", "lacking"),
    [
        ("export const apiVersion = 1\nfunction ArmPanel() {}\n", "exports no 'ArmPanel'"),
        ("export const apiVersion = 1\nexport const ArmPanel = 5\n",
         "exports 'ArmPanel' as a plain value, which is no component"),
    ],
)  # fmt: skip
def test_a_component_that_is_not_exported_or_is_none_is_refused(
    install_arm: InstallArm, text: str, lacking: str
) -> None:
    path = install_arm(text)
    assert refusal("acme-arm/ArmPanel").message == f"{path} of acme-arm 1.2.0 {lacking}"


@pytest.mark.parametrize("text", ["export * from './rest'\n", "const all = {}\nexport const { ArmPanel } = all\n"])
def test_what_a_glance_does_not_tell_is_believed(install_arm: InstallArm, text: str) -> None:
    path = install_arm(text)
    assert module_with("acme-arm/ArmPanel").path == path
