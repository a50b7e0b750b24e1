"""The page of names from MOSAIC's own bindings: whatever it names here is there."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

import mosaic_core

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "names-from-mosaic.md"
NAMES = sorted(set(re.findall(r"`(mosaic_core(?:\.\w+)+)`", PAGE.read_text())))
FROM_THE_BINDINGS = [
    "AutoConfigurer", "ADCHandlerConfigurer", "AMTHandlerConfigurer", "IConfigurableConnectorFactory",
    "AMediaTrackHandler", "DataChannelSendable", "DataChannelJsonReceivable", "DataChannelStringReceivable",
    "DataChannelByteReceivable", "get_connector_type", "create_connector", "configure", "set_handler", "get_config",
    "handle_data", "send_json", "send_frame", "is_running", "set_running", "get_stop_flag", "set_stop_flag",
    "start", "stop",
]  # fmt: skip


def found(name: str) -> object:
    """The thing of this dotted name: a module's, or a class's attribute."""
    parts = name.split(".")
    for length in range(len(parts) - 1, 0, -1):
        try:
            thing: object = import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            thing = getattr(thing, part)
        return thing
    raise AssertionError(f"{name}: there is no such module")


@pytest.mark.parametrize("name", NAMES)
def test_every_name_on_the_right_is_there(name: str) -> None:
    assert found(name) is not None


@pytest.mark.parametrize("name", FROM_THE_BINDINGS)
def test_every_name_of_the_bindings_is_on_the_left(name: str) -> None:
    left = [line.split("|")[1] for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    assert any(re.search(rf"`{name}[`(]", cell) for cell in left)


@pytest.mark.parametrize("name", mosaic_core.__all__)
def test_every_public_name_can_be_imported(name: str) -> None:
    assert getattr(mosaic_core, name) is not None


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="AutoConfigurator"):
        mosaic_core.AutoConfigurator  # noqa: B018
