"""The kit's fixtures for pytest. Loaded with every pytest run of the environment, so nothing heavy is imported here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import pytest

if TYPE_CHECKING:
    from mosaic_core.testing.fake_hosts import FakeClock


class InstallDistribution(Protocol):
    """The type of the fixture :func:`install_distribution`."""

    def __call__(
        self,
        name: str,
        *,
        version: str = "1.0.0",
        modules: Mapping[str, str] | None = None,
        entry_points: Mapping[str, Mapping[str, str]] | None = None,
    ) -> Path: ...


@pytest.fixture
def fake_clock() -> FakeClock:
    """A clock that stands still unless somebody waits; hand it to ``build(…, clock=fake_clock)``."""
    from mosaic_core.testing.fake_hosts import FakeClock

    return FakeClock()


@pytest.fixture
def install_distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[InstallDistribution]:
    """``install_distribution("acme-lamp", modules={"acme": "…"}, entry_points={"mosaic.connectors": {"lamp":
    "acme:Lamp"}})``: a distribution that is installed until the test ends. Returns its folder on ``sys.path``."""
    from mosaic_core.testing.distributions import forget_modules_of, write_distribution

    folder = tmp_path / "site-packages"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))

    def install(
        name: str,
        *,
        version: str = "1.0.0",
        modules: Mapping[str, str] | None = None,
        entry_points: Mapping[str, Mapping[str, str]] | None = None,
    ) -> Path:
        write_distribution(folder, name, version=version, modules=modules, entry_points=entry_points)
        return folder

    yield install
    forget_modules_of(folder)
