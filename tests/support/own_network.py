"""Moves this process into a network of its own, so that tests with real peers run side by side and meet nobody else's.

The network is a machine's at home: a loopback, and a cable with a private address that leads nowhere. Linux alone, and
with CAP_NET_ADMIN and CAP_SYS_ADMIN: as root.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys

CLONE_NEWNET = 0x40000000
CABLE = """\
link set lo up
link add lan0 type veth peer name lan1
addr add 192.168.77.2/24 dev lan0
addr add fd77::2/64 dev lan0 nodad
link set lan1 up
link set lan0 up
route add default via 192.168.77.1 dev lan0
rule add ipproto udp dport 53 unreachable
rule add ipproto tcp dport 53 unreachable
"""
"""What `ip -batch` does there. A cable and no dummy: not every kernel has those. Who asks for a name hears at once that
nobody answers."""


def enter_own_network() -> None:
    """For the calling thread, and for the threads and processes that it makes from now on. :class:`OSError` where that
    can't be done; then everything is as before."""
    if not sys.platform.startswith("linux") or os.geteuid() != 0:
        raise OSError("networks of one's own need Linux and root")
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWNET) != 0:  # `os.unshare` came with Python 3.12
        raise OSError(ctypes.get_errno(), "unshare")
    subprocess.run(["ip", "-batch", "-"], input=CABLE, text=True, check=True, timeout=30)
