"""Connector types are found by name, listed without importing, and broken plugins are named."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint

import pytest

from mosaic_core.runtime.configuration.resolver import GROUP, ConnectorResolver
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.errors import MosaicError, PluginError, nearest

CONFIGURER = """
{before}
from mosaic_core import *
class Configurer(DataChannelConfigurer[NoParams]):
    connector_type = "{type}"
    {more}
    def configure(self): ...
"""


def test_types_are_listed_without_importing_the_plugin(acme: ConnectorResolver) -> None:
    assert [(one.type, one.source) for one in acme.types()][:2] == [
        ("eye", "acme-gauges 1.0.0"),
        ("faulty", "acme-gauges 1.0.0"),
    ]
    assert "acme_gauges" not in sys.modules


def test_only_the_plugin_that_is_used_is_imported(acme: ConnectorResolver) -> None:
    configurer = acme.resolve("gauge")
    assert configurer.connector_type == "gauge"
    assert acme.resolve("gauge") is configurer


def test_the_installed_entry_points_are_the_default() -> None:
    assert "connection-check" in {one.type for one in ConnectorResolver().types()}
    found = ConnectorResolver().find("connection-check")
    assert found.distribution == "mosaic-core"


@pytest.mark.parametrize(("word", "meant"), [("guage", "gauge"), ("GAUGE", "gauge"), ("motr", "motor")])
def test_an_unknown_type_gets_the_nearest_name(acme: ConnectorResolver, word: str, meant: str) -> None:
    with pytest.raises(MosaicError) as caught:
        acme.resolve(word)
    assert caught.value.code == "config.unknown_type"
    assert caught.value.message == f"no connector type '{word}'"
    assert caught.value.cure.startswith(f"did you mean '{meant}'? Installed: eye, ")


def test_a_type_like_no_other_gets_the_list_only(acme: ConnectorResolver) -> None:
    with pytest.raises(MosaicError) as caught:
        acme.resolve("zzz")
    assert caught.value.cure.startswith("Installed: ")
    with pytest.raises(MosaicError) as caught:
        ConnectorResolver([]).resolve("zzz")
    assert caught.value.cure == "Installed: none"


@pytest.mark.parametrize(("word", "meant"), [("type-111", "did you mean 'type-11'? "), ("zzz", "")])
def test_of_many_types_the_nearest_is_told_and_where_the_others_are(word: str, meant: str) -> None:
    many = ConnectorResolver([EntryPoint(f"type-{number}", "acme:Type", GROUP) for number in range(21)])
    with pytest.raises(MosaicError) as caught:
        many.resolve(word)
    assert caught.value.cure == (
        f"{meant}`mosaic connectors list` shows all 21; one of your own is among them once it stands in the folder "
        "connectors/ beside the YAML file, or is installed: pip install -e FOLDER"
    )


def test_two_distributions_with_one_type_are_both_named(install_distribution: InstallDistribution) -> None:
    module = {"both": CONFIGURER.format(before="", type="lamp", more="")}
    point = {"mosaic.connectors": {"lamp": "both:Configurer"}}
    install_distribution("acme-lamp", version="1.2", modules=module, entry_points=point)
    install_distribution("other-lamp", version="0.3", entry_points=point)
    resolver = ConnectorResolver()
    assert [one.source for one in resolver.types() if one.type == "lamp"] == ["acme-lamp 1.2", "other-lamp 0.3"]
    with pytest.raises(MosaicError) as caught:
        resolver.resolve("lamp")
    assert caught.value.code == "config.ambiguous_type"
    assert caught.value.message == "connector type 'lamp' is claimed by acme-lamp 1.2 and other-lamp 0.3"


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("no-module", "its entry point names the module 'acme_missing', which is not installed"),
        ("no-configurer", "acme_gauges:NotAConfigurer is not a Configurer class"),
        ("unfinished", "Unfinished does not implement configure"),
    ],
)
def test_a_broken_plugin_is_named_with_its_cause(acme: ConnectorResolver, name: str, cause: str) -> None:
    with pytest.raises(PluginError) as caught:
        acme.resolve(name)
    assert caught.value.distribution == "acme-gauges 1.0.0"
    message, _, place = caught.value.message.partition(" (/")
    assert message == f"connector type '{name}' of acme-gauges 1.0.0 can't be used: {cause}"
    assert "acme_gauges.py:" in place or name == "no-module"  # which is nowhere


@pytest.mark.parametrize(
    ("before", "cause"),
    [
        ("import sys; sys.exit('bye')", "SystemExit: bye"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("class Panic(BaseException): pass\nraise Panic('out of bounds')", "Panic: out of bounds"),
        ("def (", "SyntaxError"),
        ("MOSAIC_API_VERSION = 2", "it is written for API version 2, this mosaic-core speaks 1"),
    ],
)
def test_whatever_a_plugin_does_while_it_is_imported_is_told(
    install_distribution: InstallDistribution, before: str, cause: str
) -> None:
    install_distribution(
        "acme-odd",
        modules={"acme_odd": CONFIGURER.format(before=before, type="odd", more="")},
        entry_points={"mosaic.connectors": {"odd": "acme_odd:Configurer"}},
    )
    with pytest.raises(PluginError, match=r"of acme-odd 1\.0\.0 can't be used") as caught:
        ConnectorResolver().resolve("odd")
    assert cause in caught.value.message


def broken_by(install: InstallDistribution, value: str, **modules: str) -> PluginError:
    """What is said of a plugin whose entry point is ``odd = value``."""
    install("acme-odd", modules=modules, entry_points={"mosaic.connectors": {"odd": value}})
    with pytest.raises(PluginError) as caught:
        ConnectorResolver().resolve("odd")
    return caught.value


def test_a_class_that_is_not_there_is_told_with_the_nearest(install_distribution: InstallDistribution) -> None:
    module = CONFIGURER.format(before="", type="odd", more="")
    error = broken_by(install_distribution, "acme_odd1:Configurerr", acme_odd1=module)
    assert "its entry point names 'Configurerr', which the module acme_odd1 does not have (/" in error.message
    assert error.cure == (
        "did you mean 'Configurer'?; correct `odd = \"acme_odd1:Configurerr\"` among the entry points in its "
        "pyproject.toml, and install it again"
    )


@pytest.mark.parametrize(("value", "meant"), [("acme_p.gauges:G", "did you mean 'acme_p.gauge'?; "), ("acme_x:G", "")])
def test_a_module_that_is_not_there_is_told_with_the_nearest(
    install_distribution: InstallDistribution, value: str, meant: str
) -> None:
    error = broken_by(install_distribution, value, **{"acme_p/__init__": "", "acme_p/gauge": ""})
    assert f"its entry point names the module '{value[:-2]}', which is not installed" in error.message
    assert error.cure.startswith(f"{meant}correct `odd = ")


def test_a_library_that_is_not_there_is_no_fault_of_the_entry_point(install_distribution: InstallDistribution) -> None:
    error = broken_by(install_distribution, "acme_odd2:Configurer", acme_odd2="\nimport acme_driver_lib\n")
    assert "its module acme_odd2 needs 'acme_driver_lib', which is not installed (/" in error.message
    assert "acme_odd2.py:2)" in error.message
    assert error.cure == "install acme_driver_lib, and name it among the dependencies of the distribution"


@pytest.mark.parametrize(
    ("module", "words", "cure"),
    [
        (CONFIGURER.format(before="", type="", more=""), "Configurer has no connector_type (/", "write connector_type"),
        (CONFIGURER.format(before="", type="odd", more="example = 3"), "the example of Configurer is no mapping", ""),
        (CONFIGURER.format(before="", type="odd", more="safety_model = Params"), "the safety_model of Configurer", ""),
        ("def Configurer(): ...", "acme_odd3:Configurer is not a Configurer class (/", "derive the class from Data"),
    ],
)
def test_what_a_configurer_says_wrongly_is_told(
    install_distribution: InstallDistribution, module: str, words: str, cure: str
) -> None:
    error = broken_by(install_distribution, "acme_odd3:Configurer", acme_odd3=module)
    assert words in error.message
    assert error.cure.startswith(cure)


def test_a_type_that_no_file_could_name_is_told(install_distribution: InstallDistribution) -> None:
    source = CONFIGURER.format(before="", type="Plasma Cam", more="")
    install_distribution(
        "acme-plasma",
        modules={"acme_plasma": source},
        entry_points={"mosaic.connectors": {"Plasma Cam": "acme_plasma:Configurer"}},
    )
    with pytest.raises(
        PluginError, match="the connector_type of Configurer is 'Plasma Cam', no name for a type"
    ) as told:
        ConnectorResolver().resolve("Plasma Cam")
    assert told.value.cure == 'write connector_type = "plasma-cam"'


def test_the_right_api_version_may_be_declared(install_distribution: InstallDistribution) -> None:
    install_distribution(
        "acme-good", modules={"acme_good": CONFIGURER.format(before="MOSAIC_API_VERSION = 1", type="good", more="")}
    )
    resolver = ConnectorResolver([EntryPoint("good", "acme_good:Configurer", "mosaic.connectors")])
    assert resolver.resolve("good").__name__ == "Configurer"
    assert resolver.find("good").source == "acme_good"


def test_what_a_plugin_prints_while_it_is_imported_is_no_output_of_the_command(
    install_distribution: InstallDistribution, capsys: pytest.CaptureFixture[str]
) -> None:
    source = CONFIGURER.format(before="print('hello')", type="talks", more="")
    install_distribution("acme-talks", modules={"acme_talks": source})
    ConnectorResolver([EntryPoint("talks", "acme_talks:Configurer", "mosaic.connectors")]).resolve("talks")
    assert capsys.readouterr() == ("", "hello\n")


def test_a_broken_plugin_disturbs_no_other(
    acme: ConnectorResolver, entry_points_of: Callable[[str], EntryPoint]
) -> None:
    resolver = ConnectorResolver([entry_points_of("no-module"), entry_points_of("gauge")])
    assert resolver.resolve("gauge").connector_type == "gauge"


def test_the_nearest_name_ignores_case() -> None:
    assert nearest("Period_S", ["period_s", "port"]) == "period_s"
    assert nearest("qqqqq", ["period_s", "port"]) is None
    assert nearest("x", []) is None


@pytest.mark.parametrize(
    ("points", "cure"),
    [
        (
            {"mosaic.connector": {"acme-lamp": "acme_lamp:Configurer"}},
            "acme-lamp 1.0.0 names it in the group 'mosaic.connector', which nobody reads: write "
            '[project.entry-points."mosaic.connectors"] in its pyproject.toml, and install it again',
        ),
        (
            {},
            "acme-lamp 1.0.0 is installed and names no connector: write "
            '[project.entry-points."mosaic.connectors"] in its pyproject.toml, and install it again',
        ),
    ],
)
def test_a_distribution_that_does_not_name_its_type_as_it_must_is_told(
    install_distribution: InstallDistribution, points: dict[str, dict[str, str]], cure: str
) -> None:
    install_distribution("acme-lamp", entry_points=points)
    with pytest.raises(MosaicError, match="no connector type 'acme-lamp'") as caught:
        ConnectorResolver([]).resolve("acme-lamp")
    assert caught.value.cure == cure


def test_a_command_of_the_same_name_is_no_connector(install_distribution: InstallDistribution) -> None:
    install_distribution("acme-lamps", entry_points={"mosaic.commands": {"acme-lamp": "acme_lamp:app"}})
    with pytest.raises(MosaicError) as caught:
        ConnectorResolver([]).resolve("acme-lamp")
    assert caught.value.cure == "Installed: none"
