"""The doctor names what of an installed plugin of hooks is never called, and whatever its import raises."""

from __future__ import annotations

import pytest

from mosaic_core.doctor.install_checks import install_checks
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.testing.pytest_plugin import InstallDistribution

PANIC = "class Panic(BaseException): pass\nraise Panic('at import')\n"
UNMARKED = "def mosaic_robot_state_changed(state): pass\n"


@pytest.mark.parametrize(
    ("source", "cause"),
    [
        (PANIC, "can't be used: Panic: at import ({file}:2)"),
        (
            UNMARKED,
            "is not all heard: mosaic_robot_state_changed ({file}:1) is not called: write @hookimpl above it",
        ),
    ],
    ids=["panic", "not marked"],
)
async def test_a_plugin_of_hooks_that_is_broken_is_a_failure(
    install_distribution: InstallDistribution, source: str, cause: str
) -> None:
    folder = install_distribution(
        "acme-hooks", modules={"acme_hooks": source}, entry_points={"mosaic.plugins": {"h": "acme_hooks"}}
    )
    found = [one async for one in install_checks(ConnectorResolver([])) if one.check == "install.plugin.h"]
    told = cause.format(file=folder / "acme_hooks.py")
    assert [(one.status, one.sentence) for one in found] == [
        ("fail", f"'h' of acme-hooks (mosaic.plugins) {told}"),
    ]
