"""A leader arm moves a follower at 100 Hz: how old what the follower does is, and how long it hears nothing, beside a
WebSocket made by hand in the same run.

    sudo .venv/bin/python bench/arm.py [--seconds 20] [--only loopback 4g] [--ways ours hand-made]

Both arms are servos made up byte by byte behind pseudo terminals, with processes of their own. The joint is led a tick
further every hundredth of a second; counted is from the reading of the leader to the first goal written to the follower
that is as far: bus, network, robot and bus. Ways take turns. The bad network lies between two namespaces: needs root.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from arm_bench.chains import MOST_S, chains
from arm_bench.figures import Followed, followed, table_line
from arm_bench.tun_link import ROBOT_IP, tun_link
from arm_bench.ways import Network, Way, hand_made, ours
from processes.mosaic import end_like_ctrl_c

LOOPBACK = "loopback"
NETWORKS = {LOOPBACK: LOOPBACK, "4g": "4g: 50 ± 15 ms each way, 3 % lost"}
WAYS: dict[str, Way] = {"ours": ours, "hand-made": hand_made}
TITLES = {"ours": "`mosaic arm follow`", "hand-made": "JSON over a WebSocket"}
SETTLE_S = 3.0
"""Before the leader is led; and after, for the last goal to arrive."""


@contextmanager
def network(name: str) -> Iterator[Network]:
    if name == LOOPBACK:
        yield Network()
        return
    with tun_link(name) as link:
        yield Network(link.robot.prefix, link.operator.prefix, ROBOT_IP)


def measured(name: str, way: str, seconds: float) -> Followed:
    with tempfile.TemporaryDirectory() as folder, network(name) as where, chains() as both, ExitStack() as stack:
        WAYS[way](where, both, Path(folder), stack)
        time.sleep(SETTLE_S)
        both.lead()
        time.sleep(seconds)
        led = both.led.copy()
        time.sleep(SETTLE_S)
        return followed(led, both.told.copy())


def main() -> None:
    end_like_ctrl_c()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help=f"of each (20; {MOST_S:.0f} at most)")
    parser.add_argument("--only", nargs="+", choices=list(NETWORKS), default=list(NETWORKS), help="which networks")
    parser.add_argument("--ways", nargs="+", choices=list(WAYS), default=list(WAYS))
    asked = parser.parse_args()
    if asked.only != [LOOPBACK] and os.geteuid() != 0:
        sys.exit("network namespaces need root: sudo .venv/bin/python bench/arm.py, or --only loopback")
    print(f"load of this machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print("| network | way | age of what the follower does, p50 / p99 / max ms | hears nothing for, p99 / max ms |")
    print("|---|---|---|---|", flush=True)
    for name in asked.only:
        for way in asked.ways:
            found = measured(name, way, min(asked.seconds, MOST_S))
            print(table_line(NETWORKS[name], TITLES[way], found), flush=True)
            if found.missed:
                print(f"{found.missed} places of the leader were never reached")


if __name__ == "__main__":
    main()
