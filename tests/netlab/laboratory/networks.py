"""Networks of their own, for processes and for threads of this one. Needs root (CAP_NET_ADMIN, CAP_SYS_ADMIN)."""

from __future__ import annotations

import ctypes
import subprocess
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

CLONE_NEWNET = 0x40000000
T = TypeVar("T")


def ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True)
    if done.returncode != 0:
        raise OSError(f"ip {' '.join(words)}: {done.stderr.strip()}")


@dataclass(frozen=True)
class Namespace:
    """A network of its own, named after this process."""

    name: str

    @property
    def prefix(self) -> list[str]:
        """What a command line begins with to run in here."""
        return ["ip", "netns", "exec", self.name]

    def run(self, work: Callable[[], T]) -> T:
        """``work()`` on a thread in here; sockets, threads and processes that it makes are in here too."""
        found: list[T] = []
        failed: list[BaseException] = []

        def inside() -> None:
            try:
                self._enter()
                found.append(work())
            except BaseException as error:  # noqa: BLE001 (raised where somebody waits for it)
                failed.append(error)

        thread = threading.Thread(target=inside, name=f"in-{self.name}")
        thread.start()
        thread.join()
        if failed:
            raise failed[0]
        return found[0]

    def _enter(self) -> None:
        """This thread only. `os.setns` came with Python 3.12."""
        with Path("/run/netns", self.name).open() as namespace:
            if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), CLONE_NEWNET) != 0:
                raise OSError(ctypes.get_errno(), f"setns to {self.name}")
