"""`mosaic connectors list --check` tells what plugins depend on and do not find."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from mosaic_core import __version__
from mosaic_core.testing.pytest_plugin import InstallDistribution


@pytest.mark.parametrize("is_checked", [True, False])
def test_a_hint_names_the_distribution_and_what_to_install(
    mosaic: Callable[..., Any],
    install_distribution: InstallDistribution,
    monkeypatch: pytest.MonkeyPatch,
    is_checked: bool,
) -> None:
    points = {"mosaic.connectors": {"acme-lamp": "acme_lamp:LampConfigurer"}}
    install_distribution("acme-lamp", entry_points=points, metadata={"Requires-Dist": "mosaic-core>=9"})
    monkeypatch.setattr("mosaic_core.cli.configuration.broken_types.broken_types", lambda resolver, *, imports: {})
    ended = mosaic("connectors", "list", *(["--check"] if is_checked else []))
    told = (
        f"hint: acme-lamp 1.0.0 wants mosaic-core>=9, and {__version__} is installed\n"
        '       = pip install "mosaic-core>=9"\n'
    )
    assert (ended.code, ended.err) == (0, told if is_checked else "")
