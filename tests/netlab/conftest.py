"""A laboratory of real networks, see the modules in ``laboratory/``; they are beside the tests, not installed."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Coroutine, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from support.processes import QUICK_MOSAIC, mosaic_here

from mosaic_core.testing import until
from mosaic_core.testing.distributions import write_distribution

HERE = Path(__file__).parent
if str(HERE) not in sys.path:
    sys.path.append(str(HERE))

from laboratory.fleet import Fleet, run_fleet  # noqa: E402
from laboratory.forwarding import ROUTER_OPERATOR_IP, ROUTER_ROBOT_IP, Lab  # noqa: E402
from laboratory.nats import Kind, NatLab  # noqa: E402
from laboratory.processes import MOSAIC, Process  # noqa: E402
from laboratory.site import Site, Track  # noqa: E402
from laboratory.turn_server import SECRET, TURN_IP, Coturn, run_coturn  # noqa: E402

ROBOT_SIDE = HERE / "robot_side"
SHORT_CREDENTIALS = [sys.executable, str(ROBOT_SIDE / "short_credentials.py")]
CONNECTORS = """\
  - type: cmd-vel
    label: cmd_vel
    params: { drive: { type: callback, function: "drive_recorder:record_base" } }
    safety: { timeout_s: 0.3 }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
  - { type: blocker, label: blocker }
  - { type: bulk-source, label: bulk, params: { rate_mbyteps: 10 } }
"""


@pytest.fixture(scope="session")
def lab() -> Iterator[Lab]:
    """Skipped (in CI: fails) where networks can't be made."""
    if shutil.which("ip") is None:
        pytest.skip("no `ip`: apt install iproute2")
    with ExitStack() as stack:
        try:
            made = Lab(stack)
        except OSError as error:
            pytest.skip(f"network namespaces can't be made here, run as root: {error}")
        yield made
        made.heal()


def _start_server(lab: Lab, folder: Path, stack: ExitStack, wait_for: Callable[..., float]) -> tuple[int, Any]:
    words = ["server", "seed", "--data-dir", str(folder), "--robot-name", "Lab robot", "--json"]
    account = json.loads(mosaic_here(*words))
    ready = folder / "ready.json"
    words = ["server", "run", "--host", "0.0.0.0", "--port", "0", "--insecure-public", "--data-dir", str(folder)]  # noqa: S104
    hosts = [word for address in (ROUTER_ROBOT_IP, ROUTER_OPERATOR_IP) for word in ("--allow-host", address)]
    server = Process([*lab.router.prefix, *QUICK_MOSAIC, *words, *hosts, "--ready-file", str(ready)])
    stack.callback(server.stop)
    server.start()
    wait_for(
        lambda: ready.exists() and bool(ready.read_text()), "the server listens", alive=server.process, log=server.log
    )
    return json.loads(ready.read_text())["port"], account


@pytest.fixture(scope="module")
def whole_site(
    lab: Lab,
    tmp_path_factory: pytest.TempPathFactory,
    wait_for: Callable[..., float],
) -> Iterator[Site]:
    """One for all tests of a module: what one of them does to the robot, it must survive for the next. Kept to the end
    it would take ten seconds of a processor for nobody."""
    folder = tmp_path_factory.mktemp("lab")
    write_distribution(
        folder,
        "bad-plugin",
        entry_points={
            "mosaic.connectors": {
                "blocker": "bad_plugin:BlockerConfigurer",
                "bulk-source": "bulk_source:BulkSourceConfigurer",
            }
        },
    )
    record = folder / "record.txt"
    record.touch()
    with ExitStack() as stack:
        port, account = _start_server(lab, folder, stack, wait_for)
        config = folder / "mosaic_config.yaml"
        config.write_text(
            f"""\
version: 1
server:
  ws_url: ws://{ROUTER_ROBOT_IP}:{port}
  auth: {{ type: simple-token, robot_id: {account["robotId"]}, params: {{ token: {account["robotToken"]} }} }}
connectors:
{CONNECTORS}"""
        )
        path = os.pathsep.join(filter(None, (str(folder), str(ROBOT_SIDE), os.environ.get("PYTHONPATH"))))
        environment = {"PYTHONPATH": path, "DRIVE_RECORD": str(record)}
        robot = Process([*lab.robot.prefix, *MOSAIC, "run", str(config), "--json"], environment)
        stack.callback(robot.stop)
        robot.start()
        wait_for(
            lambda: any('"state": "ready"' in line or '"state":"ready"' in line for line in robot.log),
            "the robot is ready",
            alive=robot.process,
            log=robot.log,
        )
        yield Site(lab, f"http://{ROUTER_OPERATOR_IP}:{port}", account, robot, Track(record))


@pytest.fixture
def site(whole_site: Site, wait_for: Callable[..., float]) -> Iterator[Site]:
    """The robot stands; whatever the test cut is whole again afterwards."""
    wait_for(whole_site.track.stands, "the robot stands before the test")
    yield whole_site
    whole_site.lab.heal()


@pytest.fixture(name="until", scope="session")
def until_fixture() -> Callable[..., Coroutine[Any, Any, float]]:
    return until


@pytest.fixture(scope="session")
def nat_lab(lab: Lab) -> Iterator[NatLab]:
    """Symmetric NATs on both sides; one for all tests."""
    yield from _nat_lab("symmetric")


@pytest.fixture(scope="session")
def cone_lab(lab: Lab) -> Iterator[NatLab]:
    """NATs that keep one port for all destinations."""
    yield from _nat_lab("endpoint-independent")


def _nat_lab(kind: Kind) -> Iterator[NatLab]:
    for program, package in (("nft", "nftables"), ("turnserver", "coturn"), ("openssl", "openssl")):
        if shutil.which(program) is None:
            pytest.skip(f"no `{program}`: apt install {package}")
    with ExitStack() as stack:
        yield NatLab(stack, kind)


@pytest.fixture(scope="module")
def coturn(
    nat_lab: NatLab, tmp_path_factory: pytest.TempPathFactory, wait_for: Callable[..., float]
) -> Iterator[Coturn]:
    """In the public network between the symmetric NATs."""
    with ExitStack() as stack:
        yield run_coturn(nat_lab, tmp_path_factory.mktemp("coturn"), stack, wait_for)


@pytest.fixture(scope="module")
def fleet(
    nat_lab: NatLab, coturn: Coturn, tmp_path_factory: pytest.TempPathFactory, wait_for: Callable[..., float]
) -> Iterator[Fleet]:
    """Behind the symmetric NATs; credentials end after seconds, so that whatever needs fresh ones shows it."""
    folder = tmp_path_factory.mktemp("fleet")
    with ExitStack() as stack:
        found = run_fleet(nat_lab, coturn, folder, stack, wait_for, mosaic_server=SHORT_CREDENTIALS)
        yield found
        assert SECRET not in (folder / "server.log").read_text() + found.robot_log.read_text()


@pytest.fixture(scope="module")
def cone_fleet(
    cone_lab: NatLab, tmp_path_factory: pytest.TempPathFactory, wait_for: Callable[..., float]
) -> Iterator[Fleet]:
    """Behind the NATs that keep their ports; there is STUN, and no relay."""
    with ExitStack() as stack:
        stun = run_coturn(cone_lab, tmp_path_factory.mktemp("stun"), stack, wait_for)
        folder = tmp_path_factory.mktemp("cone-fleet")
        yield run_fleet(cone_lab, stun, folder, stack, wait_for, urls=(f"stun:{TURN_IP}:3478",))
