"""What a plugin depends on and does not find is told with the cure, wherever plugins are looked at."""

from __future__ import annotations

import pytest

from mosaic_core import __version__
from mosaic_core.doctor.install_checks import install_checks
from mosaic_core.doctor.unmet_dependencies import unmet_dependencies
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.testing.pytest_plugin import InstallDistribution

LAMP = """
from mosaic_core import DataChannelConfigurer, DataChannelReceivable, NoParams
class Lamp(DataChannelReceivable[str]):
    def handle_data(self, data: str) -> None: ...
class LampConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "acme-lamp"
    def configure(self) -> Lamp:
        return Lamp(self.label)
"""
UNMET = f"acme-lamp 1.0.0 wants mosaic-core>=9, and {__version__} is installed"


@pytest.fixture
def _installed(install_distribution: InstallDistribution) -> None:
    install_distribution(
        "acme-lamp",
        modules={"acme_lamp": LAMP},
        entry_points={"mosaic.connectors": {"acme-lamp": "acme_lamp:LampConfigurer"}},
        metadata={"Requires-Dist": "mosaic-core>=9"},
    )


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("mosaic-core>=0.1,<1", []),
        ("mosaic_core", []),
        ("mosaic-core>=9", [f"wants mosaic-core>=9, and {__version__} is installed"]),
        ("acme-nowhere[fast]>2", ["wants acme-nowhere>2, which is not installed"]),
        ("acme-nowhere; extra == 'fast'", []),
        ("acme-nowhere; python_version < '3'", []),
        ("mosaic core", ["wants 'mosaic core', which is no requirement"]),
    ],
)
def test_what_is_not_met_is_told_and_nothing_else(line: str, told: list[str]) -> None:
    assert [one.message for one in unmet_dependencies([line])] == told


@pytest.mark.usefixtures("_installed")
async def test_the_doctor_warns_of_it_and_says_what_to_install() -> None:
    found = {one.check: one async for one in install_checks(ConnectorResolver())}["install.needs.acme-lamp"]
    assert (found.status, found.code, found.sentence) == ("warn", "check.version_mismatch", f"{UNMET}.")
    assert found.cure == 'pip install "mosaic-core>=9"'
