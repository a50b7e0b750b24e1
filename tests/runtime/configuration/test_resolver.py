"""Connector types are found by name, listed without importing, and broken plugins are named."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint

import pytest

from mosaic_core.runtime.configuration.resolver import GROUP, ConnectorResolver, nearest
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.errors import MosaicError, PluginError

CONFIGURER = """
{before}
from mosaic_core import *
class Configurer(DataChannelConfigurer[NoParams]):
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
        f"{meant}`mosaic connectors list` shows all 21; a plugin of your own is among them once it is installed: "
        "pip install -e FOLDER"
    )


def test_two_distributions_with_one_type_are_both_named(install_distribution: InstallDistribution) -> None:
    module = {"both": CONFIGURER.format(before="")}
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
        ("no-module", "ModuleNotFoundError: No module named 'acme_missing'"),
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
        ("def (", "SyntaxError"),
        ("MOSAIC_API_VERSION = 2", "it is written for API version 2, this mosaic-core speaks 1"),
    ],
)
def test_whatever_a_plugin_does_while_it_is_imported_is_told(
    install_distribution: InstallDistribution, before: str, cause: str
) -> None:
    install_distribution(
        "acme-odd",
        modules={"acme_odd": CONFIGURER.format(before=before)},
        entry_points={"mosaic.connectors": {"odd": "acme_odd:Configurer"}},
    )
    with pytest.raises(PluginError, match=r"of acme-odd 1\.0\.0 can't be used") as caught:
        ConnectorResolver().resolve("odd")
    assert cause in caught.value.message


def test_the_right_api_version_may_be_declared(install_distribution: InstallDistribution) -> None:
    install_distribution("acme-good", modules={"acme_good": CONFIGURER.format(before="MOSAIC_API_VERSION = 1")})
    resolver = ConnectorResolver([EntryPoint("good", "acme_good:Configurer", "mosaic.connectors")])
    assert resolver.resolve("good").__name__ == "Configurer"
    assert resolver.find("good").source == "acme_good"


def test_a_broken_plugin_disturbs_no_other(
    acme: ConnectorResolver, entry_points_of: Callable[[str], EntryPoint]
) -> None:
    resolver = ConnectorResolver([entry_points_of("no-module"), entry_points_of("gauge")])
    assert resolver.resolve("gauge").connector_type == "gauge"


def test_the_nearest_name_ignores_case() -> None:
    assert nearest("Period_S", ["period_s", "port"]) == "period_s"
    assert nearest("qqqqq", ["period_s", "port"]) is None
    assert nearest("x", []) is None
