"""The kit's fixtures for pytest. Loaded with every pytest run of the environment, so nothing heavy is imported here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from mosaic_core.harness.fake_hosts import FakeClock
    from mosaic_core.laboratory.networks import Network
    from mosaic_core.machines.laboratory.impaired_link import LinkProfile
    from mosaic_core.machines.laboratory.nat import NatKind


class InstallDistribution:
    """Installs distributions in ``folder``, which is on ``sys.path``; the fixture :func:`install_distribution`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __call__(
        self,
        name: str,
        *,
        version: str = "1.0.0",
        modules: Mapping[str, str] | None = None,
        entry_points: Mapping[str, Mapping[str, str]] | None = None,
        metadata: Mapping[str, str] | None = None,
        description: str = "",
    ) -> Path:
        from mosaic_core.testing.distributions import write_distribution

        write_distribution(
            self._folder,
            name,
            version=version,
            modules=modules,
            entry_points=entry_points,
            metadata=metadata,
            description=description,
        )
        return self._folder


class ImpairedNetwork:
    """Makes networks that end with ``stack``; the fixture :func:`impaired_network`."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack

    def __call__(
        self,
        profile: LinkProfile | str = "pristine",
        *,
        in_memory: bool = False,
        nat: NatKind | tuple[NatKind, NatKind] | None = None,
        with_relay: bool = True,
        seed: int = 1,
    ) -> Network:
        if in_memory:
            if nat is not None:
                raise ValueError("there is no NAT in memory; leave in_memory out")
            from mosaic_core.laboratory.memory_network import MemoryNetwork

            return MemoryNetwork(profile, seed=seed)
        from mosaic_core.laboratory.networks import WebRtcNetwork

        return self._stack.enter_context(WebRtcNetwork(profile, nat=nat, with_relay=with_relay, seed=seed))


@pytest.fixture
def fake_clock() -> FakeClock:
    """A clock that stands still unless somebody waits; hand it to ``build(…, clock=fake_clock)``."""
    from mosaic_core.harness.fake_hosts import FakeClock

    return FakeClock()


@pytest.fixture
def install_distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[InstallDistribution]:
    """``install_distribution("acme-lamp", modules={"acme": "…"}, entry_points={"mosaic.connectors": {"lamp":
    "acme:Lamp"}})``: a distribution that is installed until the test ends. Returns its folder on ``sys.path``."""
    from mosaic_core.testing.distributions import forget_modules_of

    folder = tmp_path / "site-packages"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    yield InstallDistribution(folder)
    forget_modules_of(folder)


@pytest.fixture
def impaired_network() -> Iterator[ImpairedNetwork]:
    """``joined(…, network=impaired_network("4g"))``: real WebRTC over a bad network, without root, until the test ends.

    ``profile``: ``pristine``, ``starlink``, ``4g``, ``wifi-walls``, ``severe`` or a ``LinkProfile`` of your own.
    ``in_memory``: without WebRTC, which is quicker; whole messages are late or lost then. ``nat``: both sides (or each
    its own, the robot's first) behind such a NAT, joined by a TURN server unless ``with_relay`` is off. The network
    that is returned may ``become`` another one, be ``cut`` and ``heal``.
    """
    with ExitStack() as stack:
        yield ImpairedNetwork(stack)
