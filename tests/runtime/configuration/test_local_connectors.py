"""Files of the folder ``connectors/`` beside a YAML file are plugins: found unread, run when used, told when wrong."""

from __future__ import annotations

import grp
import logging
import os
import pwd
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from mosaic_core.runtime.configuration import folder_trust
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.configuration.folder_trust import doubt_about
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.local_connectors import LocalConnectors, connectors_beside
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.testing import connector, joined
from mosaic_core.words.errors import MosaicError, PluginError, untold

ARM = '''
from collections.abc import Iterator

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message, Params


class ArmParams(Params):
    offset_rad: float = 0.5


class Joint(Message):
    angle_rad: float


class Arm(DataChannelSendable[Joint]):
    def __init__(self, label: str, params: ArmParams) -> None:
        super().__init__(label)
        self.params = params

    def messages(self) -> Iterator[Joint]:
        for _ in self.every(0.01):
            yield Joint(angle_rad=self.params.offset_rad)


class ArmConfigurer(DataChannelConfigurer[ArmParams]):
    """The angle of a joint."""

    connector_type = "arm"

    def configure(self) -> Arm:
        return Arm(self.label, self.params)
'''
CONFIGURER = """
from mosaic_core import *
class {name}(DataChannelConfigurer[NoParams]):
    connector_type = "{type}"
    def configure(self): ...
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "robot.yaml"
    path.write_text("connectors:\n  - { type: arm, label: arm, params: { offset_rad: 1 } }\n")
    (tmp_path / "connectors").mkdir()
    return path


@pytest.fixture
def beside(config: Path) -> Callable[..., LocalConnectors]:
    """What is found once these files stand beside the configuration."""

    def written(refusal: str = "", **sources: str) -> LocalConnectors:
        for name, source in sources.items():
            (config.parent / "connectors" / f"{name}.py").write_text(source)
        return connectors_beside(config, refusal=refusal)

    return written


@pytest.fixture
def resolver(beside: Callable[..., LocalConnectors]) -> Callable[..., ConnectorResolver]:
    return lambda **files: ConnectorResolver([], local=beside(**files))


async def test_one_file_is_a_connector_that_runs(resolver: Callable[..., ConnectorResolver]) -> None:
    known = resolver(arm=ARM)
    assert [(one.type, one.source, one.place) for one in known.types()] == [
        ("arm", "connectors/arm.py", "connectors/arm.py:25")
    ]
    async with joined(connector(known.resolve("arm"), label="arm", params={"offset_rad": 0.25})) as link:
        message = await link.connection.receivable("arm").next_message()
        assert message.json() == {"angle_rad": 0.25}


def test_a_file_is_run_when_a_type_of_it_is_used_and_the_log_says_so_once(
    resolver: Callable[..., ConnectorResolver], config: Path, caplog: pytest.LogCaptureFixture
) -> None:
    two = CONFIGURER.format(name="One", type="one") + CONFIGURER.format(name="Two", type="two")
    known = resolver(arm="raise RuntimeError" + ARM, two=two)
    with caplog.at_level(logging.WARNING):
        assert (known.resolve("one").__name__, known.resolve("two").__name__) == ("One", "Two")
    assert caplog.messages == [f"runs code of {config.parent / 'connectors' / 'two.py'}"]


def test_a_file_that_does_not_import_is_run_and_told_once_for_all_its_types(
    resolver: Callable[..., ConnectorResolver], config: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    runs = f"with open({str(tmp_path / 'runs')!r}, 'a') as file: file.write('x')\nimport nowhere_at_all\n"
    both = CONFIGURER.format(name="One", type="one") + CONFIGURER.format(name="Two", type="two")
    known = resolver(day_one=runs + both)
    config.write_text("connectors:\n  - { type: one, label: one }\n  - { type: two, label: two }\n")
    with caplog.at_level(logging.WARNING):
        (problem,) = validate_file(config, resolver=known).problems
    assert (Path(problem.file).name, problem.line, problem.code) == ("day_one.py", 2, "config.broken_local")
    assert problem.message.endswith("can't be used: ModuleNotFoundError: No module named 'nowhere_at_all'")
    assert (tmp_path / "runs").read_text() == "x"
    assert [one for one in caplog.messages if "runs code" in one] == [f"runs code of {tmp_path}/connectors/day_one.py"]
    with pytest.raises(PluginError, match=r"type 'two' of .*day_one\.py:2: ModuleNotFoundError"):
        known.resolve("two")  # whoever asks for this type alone hears it in full


def test_its_params_are_checked_with_their_lines(resolver: Callable[..., ConnectorResolver], config: Path) -> None:
    config.write_text("connectors:\n  - type: arm\n    label: arm\n    params:\n      ofset_rad: 1\n")
    (problem,) = validate_file(config, resolver=resolver(arm=ARM)).problems
    assert (problem.line, problem.cure) == (5, "did you mean 'offset_rad'?")


def test_a_name_hides_no_installed_module_and_a_sibling_is_imported(
    resolver: Callable[..., ConnectorResolver],
) -> None:
    json = "import json\nfrom .driver import PORT\n" + CONFIGURER.format(name="Json", type="json")
    configurer = resolver(json=json, driver="PORT = json = 1").resolve("json")
    module = sys.modules[configurer.__module__]
    assert (module.PORT, module.json) == (1, sys.modules["json"])
    assert "driver" not in sys.modules


def test_folders_of_two_robots_are_kept_apart(config: Path, tmp_path: Path) -> None:
    resolved = []
    for name in ("one", "two"):
        folder = tmp_path / name / "connectors"
        folder.mkdir(parents=True)
        (folder / "arm.py").write_text(CONFIGURER.format(name=name.title(), type="arm"))
        local = connectors_beside(tmp_path / name / "robot.yaml")
        resolved.append(ConnectorResolver([], local=local).resolve("arm").__name__)
    assert resolved == ["One", "Two"]


@pytest.mark.parametrize(
    ("source", "line", "cause", "cure"),
    [
        (
            "\nimport nowhere_at_all",
            2,
            "ModuleNotFoundError: No module named 'nowhere_at_all'",
            "install what has the module nowhere_at_all, or correct its name",
        ),
        ("import driver", 1, "No module named 'driver'", "for the file beside it write `from .driver import …`"),
        ("from .driver import stop", 1, "SystemExit: bye", "Mend the file that it names."),
        ("from .faulty import x", 1, "SyntaxError", "Mend the file that it names."),
    ],
)
def test_a_file_that_does_not_import_is_told_with_line_and_cause_and_hinders_no_other(
    resolver: Callable[..., ConnectorResolver], config: Path, source: str, line: int, cause: str, cure: str
) -> None:
    bad = source + CONFIGURER.format(name="Bad", type="bad")
    known = resolver(arm=ARM, bad=bad, driver="import sys; sys.exit('bye')", faulty="def (")
    with pytest.raises(PluginError) as caught:
        known.resolve("bad")
    assert caught.value.message.startswith("connector type 'bad' of connectors/bad.py can't be used: ")
    name = "faulty" if "faulty" in source else "driver" if "stop" in source else "bad"
    assert f"{config.parent / 'connectors' / name}.py:{line}: " in caught.value.message
    assert cause in caught.value.message
    assert (caught.value.code, caught.value.cure) == ("config.broken_local", cure)
    assert known.resolve("arm").connector_type == "arm"


INDENTED = CONFIGURER.format(name="Arm", type="arm").strip().replace("\n", "\n    ")


@pytest.mark.parametrize(
    "source",
    [
        f"import sys\nif sys:\n    {INDENTED}",
        f"try:\n    {INDENTED}\nexcept ImportError:\n    pass",
        f"try:\n    import nowhere_at_all\nexcept ImportError:\n    {INDENTED}\nelse:\n    {INDENTED}",
    ],
    ids=["if", "try", "else"],
)
def test_a_configurer_in_a_branch_of_its_module_is_found(
    resolver: Callable[..., ConnectorResolver], source: str
) -> None:
    known = resolver(arm=source)
    assert [one.type for one in known.types()] == ["arm"]
    assert known.resolve("arm").connector_type == "arm"
    assert known.local.problems == ()


def test_a_configurer_in_a_branch_that_is_not_taken_is_told_when_it_is_used(
    resolver: Callable[..., ConnectorResolver],
) -> None:
    with pytest.raises(PluginError, match=r"connectors/arm\.py can't be used: .*arm\.py: .* has no attribute 'Arm'"):
        resolver(arm=f"if False:\n    {INDENTED}").resolve("arm")


def test_a_configurer_inside_a_function_is_told(beside: Callable[..., LocalConnectors], config: Path) -> None:
    found = beside(arm=f"def make():\n    {INDENTED}\n    return Arm")
    assert found.connectors == ()
    assert [str(one) for one in found.problems] == [
        f"{config.parent}/connectors/arm.py:3: Arm stands inside a function or a class, where no connector is found "
        "(write it at the left margin of the file)"
    ]


def test_a_connector_in_a_folder_of_the_folder_is_told(beside: Callable[..., LocalConnectors], config: Path) -> None:
    for name in ("sub/deep", "tests", ".venv/lib", "driver"):
        (config.parent / "connectors" / name).mkdir(parents=True)
        (config.parent / "connectors" / name / "hand.py").write_text("PORT = 1" if name == "driver" else ARM)
    found = beside(arm=ARM)
    assert [one.type for one in found.connectors] == ["arm"]
    assert [str(one) for one in found.problems] == [
        f"{config.parent}/connectors/sub/deep/hand.py:25: the connector type 'arm' stands in a folder of connectors/, "
        "where none is found (move the file into connectors/ itself, or remove its connector_type)"
    ]


def test_a_class_that_is_no_configurer_is_told(resolver: Callable[..., ConnectorResolver]) -> None:
    with pytest.raises(PluginError, match=r"lamp\.py can't be used: Lamp, line 1, is not a Configurer class"):
        resolver(lamp="class Lamp:\n    connector_type = 'lamp'").resolve("lamp")


@pytest.mark.parametrize(
    ("name", "source", "line", "message", "cure"),
    [
        ("arm", "\ndef (", 2, "SyntaxError: invalid syntax", "its connectors are left out"),
        ("arm", "class A(Configurer): ...", 1, "A has no connector_type", "connector_type = 'a'"),
        ("arm", "class A(mosaic_core.DataChannelConfigurer[P]): ...", 1, "A has no connector_type", "'a'"),
        (
            "arm",
            "class A(Configurer):\n    connecter_type = 'a'",
            2,
            "A has no connector_type, but 'connecter_type'",
            "write connector_type instead",
        ),
        (
            "arm",
            "class A(Configurer):\n    connector_type: str = NAME",
            1,
            "connector_type of A is no plain text",
            "'a'",
        ),
        ("arm", "class A(Configurer):\n    connector_type = ''", 1, "connector_type of A is no plain text", "'a'"),
        ("my-arm", CONFIGURER.format(name="A", type="arm"), 3, "my-arm.py can't be imported by its name", "rename"),
    ],
)
def test_what_cannot_be_a_connector_is_told_with_its_line(
    beside: Callable[..., LocalConnectors], name: str, source: str, line: int, message: str, cure: str
) -> None:
    found = beside(**{name: source, "good": CONFIGURER.format(name="Good", type="good")})
    (problem,) = found.problems
    assert (Path(problem.file).name, problem.line) == (f"{name}.py", line)
    assert message in problem.message
    assert cure in problem.cure
    assert [one.type for one in found.connectors] == ["good"]


@pytest.mark.parametrize(
    ("source", "line", "mistake"),
    [
        ("\ndef (", 2, "SyntaxError: invalid syntax (mend it; until then its connectors are left out)"),
        (
            "class A(Configurer):\n    connecter_type = 'arm'",
            2,
            "A has no connector_type, but 'connecter_type' (write connector_type instead)",
        ),
    ],
)
def test_a_type_that_nobody_knows_is_told_with_the_mistake_of_the_file_that_may_have_it(
    resolver: Callable[..., ConnectorResolver], config: Path, source: str, line: int, mistake: str
) -> None:
    (problem,) = validate_file(config, resolver=resolver(arm=source)).problems
    assert (problem.code, problem.message) == ("config.unknown_type", "no connector type 'arm'")
    file = config.parent / "connectors" / "arm.py"
    assert problem.cure == f"If 'arm' is of a file beside the configuration, mend it: {file}:{line}: {mistake}"


LAMP = """from mosaic_core import DataChannelConfigurer, NoParams

class Lamp(DataChannelConfigurer[NoParams]):
    connector_type = "arm"
    def configure(self:
        pass
"""


def test_a_type_of_a_file_that_is_no_python_is_told_once_by_its_line(
    resolver: Callable[..., ConnectorResolver], config: Path
) -> None:
    known = resolver(lamp=LAMP)
    (problem,) = validate_file(config, resolver=known).problems
    file = str(config.parent / "connectors" / "lamp.py")
    assert (problem.file, problem.line, problem.code) == (file, 5, "config.broken_local")
    assert problem.message == (
        "connector type 'arm' of connectors/lamp.py can't be used: SyntaxError: '(' was never closed"
    )
    assert untold(known.local.problems, [problem]) == ()


def test_a_file_that_cannot_be_read_is_told_once(resolver: Callable[..., ConnectorResolver], config: Path) -> None:
    file = config.parent / "connectors" / "arm.py"
    resolver(arm="")
    file.write_bytes(b"\xff")
    known = ConnectorResolver([], local=connectors_beside(config))
    (problem,) = validate_file(config, resolver=known).problems
    assert f"mend it: {file}: UnicodeDecodeError: " in problem.cure
    assert untold(known.local.problems, [problem]) == ()


ONE = "Arm(self.label, self.params)"
RETURN = "return a handler, or a sequence of them"
MAKE = "return one of it: Arm(self.label, …)"


@pytest.mark.parametrize(
    ("returned", "said", "cure"),
    [
        ("Arm", "the class Arm instead of a handler", MAKE),
        ("[]", "an empty sequence instead of a handler", RETURN),
        ("'arm'", "one str instead of a handler", RETURN),
        (f"(one for one in [{ONE}])", "one generator instead of a handler", "return list(…) of it"),
        (f"[{ONE}, {ONE}, None]", "(one Arm, one Arm, None), of which number 3 is no handler", RETURN),
        (f"[{ONE}, Arm]", "(one Arm, the class Arm), of which number 2 is no handler", MAKE),
    ],
)
def test_what_is_no_handler_is_told_with_what_it_is(
    resolver: Callable[..., ConnectorResolver], config: Path, returned: str, said: str, cure: str
) -> None:
    source = ARM.replace("return Arm(self.label, self.params)", f"return {returned}")
    assert source != ARM
    auto = AutoConfigurer(resolver=resolver(arm=source), plugins=hook_plugins([]))
    (problem,) = auto.rehearse(validate_file(config, resolver=auto.resolver)).problems
    assert problem.message.endswith(f"can't be made: configure() returned {said}")
    assert problem.cure == cure


def test_a_type_that_is_nowhere_blames_no_broken_file_whose_types_are_known(
    resolver: Callable[..., ConnectorResolver], config: Path
) -> None:
    config.write_text("connectors: [{ type: lapm, label: lamp }]\n")
    known = resolver(arm=ARM, broken=LAMP.replace('"arm"', '"fan"'), lamp=CONFIGURER.format(name="Lamp", type="lamp"))
    (problem,) = validate_file(config, resolver=known).problems
    assert problem.cure.startswith("did you mean 'lamp'? ")
    assert "broken.py" not in problem.cure
    assert [Path(one.file).name for one in untold(known.local.problems, [problem])] == ["broken.py"]


def test_bases_that_others_inherit_and_files_of_other_things_are_left_alone(
    beside: Callable[..., LocalConnectors],
) -> None:
    base = "class Base(Configurer[P]): ...\nclass Arm(Base):\n    connector_type: str = 'arm'\nclass Other: ..."
    found = beside(arm=base, driver="PORT = 1")
    assert ([one.type for one in found.connectors], found.problems) == (["arm"], ())


def test_two_connectors_of_one_type_are_told_with_both_places(resolver: Callable[..., ConnectorResolver]) -> None:
    known = resolver(a=CONFIGURER.format(name="A", type="arm"), b=CONFIGURER.format(name="B", type="arm"))
    with pytest.raises(MosaicError) as caught:
        known.resolve("arm")
    assert caught.value.code == "config.ambiguous_type"
    assert caught.value.message == "connector type 'arm' is claimed by connectors/a.py:3 and connectors/b.py:3"


def test_a_type_of_an_installed_plugin_is_refused_but_not_where_the_file_is_off(
    acme: ConnectorResolver, beside: Callable[..., LocalConnectors]
) -> None:
    installed = [acme.find("gauge").entry_point]
    gauge = CONFIGURER.format(name="Gauge", type="gauge")
    with pytest.raises(MosaicError) as caught:
        ConnectorResolver(installed, local=beside(gauge=gauge)).resolve("gauge")
    assert caught.value.message == ("connector type 'gauge' is claimed by acme-gauges 1.0.0 and connectors/gauge.py:3")
    assert caught.value.cure == "Choose another connector_type in connectors/gauge.py:3."
    off = ConnectorResolver(installed, local=beside(refusal="nobody saw it", gauge=gauge))
    assert off.resolve("gauge").__name__ == "GaugeConfigurer"


def test_what_must_not_be_run_is_named_with_the_reason(resolver: Callable[..., ConnectorResolver]) -> None:
    known = resolver(refusal="nobody saw it", arm="raise RuntimeError" + ARM)
    assert known.types() == ()
    with pytest.raises(MosaicError) as caught:
        known.resolve("arm")
    assert caught.value.code == "config.local_off"
    assert caught.value.message == (
        "the code of connectors/arm.py, which has the type 'arm', is not run: nobody saw it"
    )


@pytest.mark.parametrize("place", ["connectors", "connectors/arm.py", "connectors/driver.py"])
def test_code_that_others_could_have_written_is_not_run(
    beside: Callable[..., LocalConnectors], config: Path, place: str
) -> None:
    beside(arm=ARM, driver="")
    (config.parent / place).chmod(0o777)
    refusal = connectors_beside(config).refusal
    assert refusal == f"{config.parent / place} can be written by other users than its owner (chmod go-w)"


def test_a_link_to_more_than_anybody_looks_at_is_doubted(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder_trust, "MANY_FILES", 2)
    folder = config.parent / "connectors"
    for number in range(3):
        (folder / f"data{number}").touch()
    assert doubt_about(folder, config) == f"{folder} leads to more than 2 files, too many to look at each"


def test_what_a_link_leads_to_counts_as_if_it_stood_there(config: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere" / "lib"
    elsewhere.mkdir(parents=True)
    driver = elsewhere / "driver.py"
    driver.write_text("VALUE = 1")
    (elsewhere / "round").symlink_to(elsewhere)
    folder = config.parent / "connectors"
    (folder / "lib").symlink_to(elsewhere)
    assert doubt_about(folder, config) == ""
    driver.chmod(0o666)
    assert doubt_about(folder, config) == (
        f"{folder}/lib/driver.py can be written by other users than its owner (chmod go-w)"
    )


@pytest.mark.parametrize(
    ("members", "others_primary", "is_fine"), [([], [], True), (["eve"], [], False), ([], ["eve"], False)]
)
def test_a_group_may_write_if_nobody_but_the_owner_is_in_it(
    config: Path, monkeypatch: pytest.MonkeyPatch, members: list[str], others_primary: list[str], is_fine: bool
) -> None:
    folder = config.parent / "connectors"
    folder.chmod(0o775)
    own = folder.stat()
    eve = SimpleNamespace(pw_uid=12345, pw_gid=own.st_gid if others_primary else 1)
    owner = SimpleNamespace(pw_uid=own.st_uid, pw_gid=own.st_gid)
    monkeypatch.setattr(grp, "getgrgid", lambda _gid: SimpleNamespace(gr_mem=members))
    monkeypatch.setattr(pwd, "getpwnam", lambda _name: eve)
    monkeypatch.setattr(pwd, "getpwall", lambda: [owner, eve])
    assert (doubt_about(folder, config) == "") is is_fine


def test_a_group_that_nobody_knows_may_not_write(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(gid: int) -> None:
        raise KeyError(gid)

    monkeypatch.setattr(grp, "getgrgid", unknown)
    folder = config.parent / "connectors"
    folder.chmod(0o775)
    assert "can be written by other users" in doubt_about(folder, config)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")
def test_the_folder_must_belong_to_the_author_of_the_file(config: Path) -> None:
    folder = config.parent / "connectors"
    os.chown(folder, 12345, -1)
    assert doubt_about(folder, config) == f"{folder} belongs to another user than robot.yaml"
    os.chown(config, 12345, -1)
    assert doubt_about(folder, config) == ""


def test_no_folder_is_no_doubt(tmp_path: Path) -> None:
    assert connectors_beside(tmp_path / "robot.yaml", refusal="nobody saw it") == LocalConnectors()
