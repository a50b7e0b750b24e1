"""`mosaic demo --with`: plugins that nobody has installed, found by the demo's robot alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from mosaic_core.cli.plugin.scaffold import KINDS, NewPlugin
from mosaic_sim.demo.checks import Result
from mosaic_sim.demo.child import Child
from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.headless_check import failures_in, with_cause
from mosaic_sim.demo.own_plugin import plugin_at
from mosaic_sim.demo.robot_file import OwnConnector, RobotFile, robot_file

LUX = """
from collections.abc import Iterator

from mosaic_core import DataChannelConfigurer, DataChannelSendable, NoParams

from .driver import READING


class Meter(DataChannelSendable[str]):
    def messages(self) -> Iterator[str]:
        for _ in self.every(0.1):
            yield READING


class LuxConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "lux"

    def configure(self) -> Meter:
        return Meter(self.label)
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    NewPlugin("acme-lamp", "sensor").write(tmp_path / "acme-lamp")
    return tmp_path / "acme-lamp"


@pytest.fixture
def lux(tmp_path: Path) -> Path:
    folder = tmp_path / "robot" / "connectors"
    folder.mkdir(parents=True)
    (folder / "driver.py").write_text("READING = 'bright'\n")
    (folder / "lux.py").write_text(LUX)
    return folder / "lux.py"


def changed(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def made(folder: Path, *paths: Path) -> RobotFile:
    (folder / "demo").mkdir()
    return robot_file(folder / "demo", [plugin_at(path) for path in paths])


def failure(folder: Path, *paths: Path) -> DemoFailed:
    with pytest.raises(DemoFailed) as caught:
        made(folder, *paths)
    return caught.value


def added_entries(file: RobotFile) -> list[object]:
    return [one for one in yaml.safe_load(file.path.read_text())["connectors"] if one["label"] in file.labels]


def test_without_plugins_the_robot_is_the_simulated_one_and_nothing_is_checked(tmp_path: Path) -> None:
    file = made(tmp_path)
    assert (file.own, file.environment) == ((), {})
    assert "sim-camera" in file.path.read_text()


def test_a_plugin_brings_its_entry_and_a_file_its_type(tmp_path: Path, lamp: Path, lux: Path) -> None:
    file = made(tmp_path, lamp, lux)
    assert file.own == (
        OwnConnector("acme_lamp", "acme-lamp", "acme-lamp 0.1.0"),
        OwnConnector("lux", "lux", "lux.py"),
    )
    assert added_entries(file) == [
        {"type": "acme-lamp", "label": "acme_lamp", "params": {"port": "/dev/ttyUSB0", "period_s": 0.5}},
        {"type": "lux", "label": "lux"},
    ]
    assert file.notes == ()


def test_the_trial_of_a_class_takes_the_place_of_a_device_in_a_check_and_where_no_file_names_params(
    tmp_path: Path, lamp: Path
) -> None:
    changed(lamp / "acme_lamp" / "connector.py", '    connector_type = "acme-lamp"\n',
            '    connector_type = "acme-lamp"\n    trial = {"port": "made-up"}\n')  # fmt: skip
    assert "/dev/ttyUSB0" in str(added_entries(made(tmp_path, lamp)))
    (tmp_path / "checked").mkdir()
    checked = robot_file(tmp_path / "checked", [plugin_at(lamp)], on_trial=True)
    entry = {"type": "acme-lamp", "label": "acme_lamp", "params": {"port": "made-up"}}
    assert added_entries(checked) == [entry]
    assert checked.notes == ("'acme_lamp' runs with the `trial` of its class instead of the params of its file",)
    (lamp / "mosaic_config.yaml").unlink()
    (tmp_path / "unnamed").mkdir()
    assert added_entries(robot_file(tmp_path / "unnamed", [plugin_at(lamp)])) == [entry]


LOG = """\
12:00:00 WARNING connector 'lamp': no lamp on /dev/x; plug it in (plugin.no_device); tries again in 1.0 s
12:00:00 ERROR   connector 'arm_grip' failed at /a/arm.py:7: ValueError: 3 (plugin.failed); tries again in 0.5 s
12:00:00 ERROR   connector 'gauge' failed at /a b/gauge.py:11 in Gauge.messages: AttributeError: 'Gauge' object has no \
attribute 'parms' (plugin.failed); tries again in 0.4 s
    Traceback (most recent call last):
12:00:01 WARNING connector 'scale': Scale (/a/scale.py:9) sends 'kg', which is no finite number: refused \
(plugin.wrong_message)
12:00:02 WARNING connector 'scale': no scale on /dev/x (plugin.no_device); tries again in 1.0 s
12:00:00 WARNING something else
"""


def test_a_missing_device_is_the_verdict_on_what_nothing_was_seen_of() -> None:
    failures = failures_in(LOG, ["lamp", "arm", "gauge", "scale", "other"])
    why = "no lamp on /dev/x; plug it in (plugin.no_device)"
    assert failures == {
        "lamp": why,
        "arm": "/a/arm.py:7: ValueError: 3 (plugin.failed)",
        "gauge": "/a b/gauge.py:11: AttributeError: 'Gauge' object has no attribute 'parms' (plugin.failed)",
        "scale": (
            wrong := "Scale (/a/scale.py:9) sends 'kg', which is no finite number: refused (plugin.wrong_message)"
        ),
    }
    assert with_cause(Result("scale", True, "kg"), wrong) == Result("scale", False, wrong)
    assert with_cause(Result("lamp", True, "takes messages"), why) == Result("lamp", False, why)
    assert with_cause(Result("lamp", False, "nothing arrived in time"), why) == Result("lamp", False, why)
    assert with_cause(Result("lamp", True, "is_on"), why) == Result("lamp", True, "is_on")
    assert with_cause(Result("lamp", True, "takes messages"), "") == Result("lamp", True, "takes messages")


def test_its_code_comes_from_its_folder_for_the_robot_alone(tmp_path: Path, lamp: Path, lux: Path) -> None:
    file = made(tmp_path, lamp, lux)
    code = (
        "from importlib.metadata import entry_points as all_of;"
        "found = {one.name: one.load().__module__ for one in all_of(group='mosaic.connectors')"
        " if one.name in ('lux', 'acme-lamp')};"
        "import acme_lamp; print(sorted(found), acme_lamp.__file__)"
    )
    environment = {**os.environ, **file.environment}
    done = subprocess.run([sys.executable, "-c", code], env=environment, cwd="/", capture_output=True, text=True)
    assert done.stdout.split() == ["['acme-lamp',", "'lux']", str(lamp / "acme_lamp" / "__init__.py")], done.stderr


def test_a_package_below_src_is_found(tmp_path: Path, lamp: Path) -> None:
    (lamp / "src").mkdir()
    (lamp / "acme_lamp").rename(lamp / "src" / "acme_lamp")
    assert plugin_at(lamp).import_from == lamp / "src"
    assert made(tmp_path, lamp).labels == ("acme_lamp",)


def test_a_label_that_is_taken_gets_a_number_and_that_is_told(tmp_path: Path, lamp: Path, lux: Path) -> None:
    changed(lamp / "mosaic_config.yaml", "label: acme_lamp", "label: front")
    (lux.parents[1] / "mosaic_config.yaml").write_text("connectors: [{ type: lux, label: front }]")
    file = made(tmp_path, lamp, lux)
    assert file.labels == ("front_2", "front_3")
    assert file.notes == (
        "the label 'front' is taken by the simulated robot: 'front_2' instead",
        "the label 'front' is taken by the simulated robot: 'front_3' instead",
    )


def test_the_environment_is_read_by_the_robot_and_what_is_missing_is_told(
    tmp_path: Path, lamp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed(lamp / "mosaic_config.yaml", "/dev/ttyUSB0", "${ACME_PORT}")
    assert "acme_lamp.params.port: the environment variable ACME_PORT is not set" in failure(tmp_path, lamp).message
    monkeypatch.setenv("ACME_PORT", "/dev/acme")
    (tmp_path / "again").mkdir()
    assert "port: ${ACME_PORT}" in made(tmp_path / "again", lamp).path.read_text()


def test_a_missing_dependency_is_told_with_place_and_cure(tmp_path: Path, lamp: Path) -> None:
    connector = lamp / "acme_lamp" / "connector.py"
    changed(connector, "from pydantic", "import no_such_driver\nfrom pydantic")
    told = failure(tmp_path, lamp)
    needs = "its module acme_lamp.connector needs 'no_such_driver', which is not installed"
    assert f"acme-lamp 0.1.0 can't be used: {needs}" in told.message
    assert f"{connector}:" in told.message
    assert told.cure.startswith(f"pip install -e {lamp}")


def test_a_broken_import_is_told_with_its_line(tmp_path: Path, lux: Path) -> None:
    lux.write_text(f"{LUX}\nnonsense\n")
    told = failure(tmp_path, lux)
    assert f"NameError: name 'nonsense' is not defined ({lux}:{len(LUX.splitlines()) + 2})" in told.message
    assert told.cure == "mend it, and start the demo again"


def test_a_sibling_that_is_imported_as_if_installed_is_told(tmp_path: Path, lux: Path) -> None:
    changed(lux, "from .driver", "from driver")
    assert failure(tmp_path, lux).cure == "for the file beside it write `from .driver import …`"


def test_wrong_params_are_told_by_their_label_and_the_line_of_the_plugins_own_file(tmp_path: Path, lamp: Path) -> None:
    config = lamp / "mosaic_config.yaml"
    changed(config, "period_s", "perid_s")
    line = 1 + next(at for at, text in enumerate(config.read_text().splitlines()) if "perid_s" in text)
    told = failure(tmp_path, lamp)
    assert told.message == f"acme_lamp.params.perid_s: unknown key 'perid_s' ({config}:{line})"
    assert told.cure == "did you mean 'period_s'?"


def test_params_that_no_file_names_are_told_without_a_line(tmp_path: Path, lamp: Path) -> None:
    (lamp / "mosaic_config.yaml").unlink()
    changed(lamp / "acme_lamp" / "connector.py", 'default="/dev/ttyUSB0", ', "")
    assert "acme_lamp.params" in (told := failure(tmp_path, lamp)).message
    assert "(" not in told.message


def test_a_type_that_somebody_has_already_is_told(tmp_path: Path, lux: Path) -> None:
    changed(lux, '"lux"', '"sim-camera"')
    assert "connector type 'sim-camera' is claimed by" in failure(tmp_path, lux).message


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("nothing", None, "nothing: it does not exist"),
        ("notes.txt", "x", "notes.txt: it is no Python file"),
        ("empty.py", "x = 1", "empty.py offers no connector"),
        ("broken.py", "def", r"broken\.py:1: SyntaxError: invalid syntax$"),
        ("pyproject.toml", "[project", "pyproject.toml can't be read"),
        ("pyproject.toml", "[project]\nname = 'x'", "pyproject.toml offers no connector"),
    ],
)
def test_what_is_no_plugin_is_told_with_a_cure(tmp_path: Path, name: str, text: str | None, message: str) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(DemoFailed, match=message) as caught:
        plugin_at(tmp_path if name == "pyproject.toml" else tmp_path / name)
    assert caught.value.cure


@pytest.mark.parametrize(
    ("text", "message", "cure"),
    [
        ("x = 1\ndef broken(:\n    pass\n", ":2: SyntaxError: invalid syntax", "mend it"),
        (
            "class A(DataChannelConfigurer[NoParams]):\n    conector_type = 'a'\n",
            ":2: A has no connector_type",
            "write connector_type",
        ),
        ("x = 1\n", " offers no connector", "write a DataChannelConfigurer"),
    ],
)
def test_the_cure_of_a_file_without_connectors_is_that_of_its_mistake(
    tmp_path: Path, text: str, message: str, cure: str
) -> None:
    file = tmp_path / "lux.py"
    file.write_text(text)
    with pytest.raises(DemoFailed) as caught:
        plugin_at(file)
    assert caught.value.message.startswith(f"{file}{message}")
    assert caught.value.cure.startswith(cure)


@pytest.mark.parametrize("module", ["__init__.py", "connector.py", "device.py"])
def test_a_line_that_is_no_python_is_told_with_its_file_and_no_installation(
    tmp_path: Path, lamp: Path, module: str
) -> None:
    file = lamp / "acme_lamp" / module
    file.write_text(f"{file.read_text()}\ndef broken(:\n    pass\n")
    told = failure(tmp_path, lamp)
    assert f"{file}:{len(file.read_text().splitlines()) - 1}" in told.message
    assert told.cure == "mend it, and start the demo again"


def test_a_folder_without_a_plugin_is_told(tmp_path: Path) -> None:
    with pytest.raises(DemoFailed, match="it is no plugin"):
        plugin_at(tmp_path)


def test_a_broken_yaml_file_of_a_plugin_is_told(lamp: Path) -> None:
    (lamp / "mosaic_config.yaml").write_text("connectors: [")
    with pytest.raises(DemoFailed, match=r"mosaic_config\.yaml:1: not valid YAML"):
        plugin_at(lamp)


def test_a_misspelt_type_in_the_file_of_a_plugin_is_told_before_its_entry_is_left_out(lamp: Path) -> None:
    config = lamp / "mosaic_config.yaml"
    config.write_text(config.read_text().replace("type: acme-lamp", "type: acme-lmap"))
    with pytest.raises(DemoFailed, match=r"yaml:\d+: the connector type 'acme-lmap' is none of this plugin's") as told:
        plugin_at(lamp)
    assert told.value.cure == "write acme-lamp"


def test_every_kind_of_new_plugin_can_join_at_once(tmp_path: Path) -> None:
    for kind in KINDS:
        NewPlugin(f"acme-{kind}", kind).write(tmp_path / kind)
    labels = {f"acme_{kind}" for kind in KINDS} | {"acme_full_speed", "acme_full_average"}
    assert set(made(tmp_path, *(tmp_path / kind for kind in KINDS)).labels) == labels


def test_what_a_child_writes_is_told_line_by_line(tmp_path: Path) -> None:
    child = Child(
        "thing", [sys.executable, "-c", "print('one'); print('two'); print('half', end='')"], tmp_path / "log"
    )
    child.process.wait(10)
    assert child.new_lines() == ["one", "two"]
    assert child.new_lines() == []


def test_an_import_that_never_ends_is_a_failure_of_the_plugin_by_name(
    tmp_path: Path, lamp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mosaic_sim.demo.plugin_process.START_PATIENCE_S", 0.01)
    failed = failure(tmp_path, lamp)
    assert (failed.message, failed.cure) == (
        "the import of acme-lamp 0.1.0 had not ended after 0.01 s",
        "open devices in the bodies of handlers: what a module does at its top ends",
    )
