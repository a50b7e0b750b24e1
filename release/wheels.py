"""Finds what of a lock file has no wheel on a machine that MOSAIC supports: `./dev` builds nothing of others."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from packaging.markers import Marker
from packaging.tags import Tag, compatible_tags, cpython_tags, mac_platforms
from packaging.utils import parse_wheel_filename

PYTHONS = ((3, 11), (3, 12), (3, 13), (3, 14))
GLIBC = range(36, 4, -1)
"""Minor versions, newest first: up to Debian 12's 2.36."""
OLD_NAMES = ("manylinux2014", "manylinux2010", "manylinux1", "linux")
MACOS = (14, 0)
BUILT = {
    "empy": "its author publishes no wheel; wanted by the wheels of ROS alone",
    "yattag": "its author publishes no wheel; wanted by cosmic-ray alone",
}
"""Packages that are built from source, with the reason why that does."""


@dataclass(frozen=True)
class Machine:
    """A kind of machine as markers and wheel tags call it."""

    system: str
    processor: str

    def __str__(self) -> str:
        return f"{self.system} {self.processor}"

    def platforms(self) -> list[str]:
        if self.system == "Darwin":
            return list(mac_platforms(MACOS, self.processor))
        return [f"{name}_{self.processor}" for name in (*(f"manylinux_2_{minor}" for minor in GLIBC), *OLD_NAMES)]

    def tags(self, python: tuple[int, int]) -> set[Tag]:
        platforms = self.platforms()
        interpreter = f"cp{python[0]}{python[1]}"
        return {
            *cpython_tags(python, platforms=platforms),
            *compatible_tags(python, interpreter, platforms),
        }

    def environment(self, python: tuple[int, int]) -> dict[str, str]:
        """Markers' names; the last patch version matters to nobody."""
        version = f"{python[0]}.{python[1]}"
        return {
            "implementation_name": "cpython",
            "platform_python_implementation": "CPython",
            "os_name": "posix",
            "sys_platform": "darwin" if self.system == "Darwin" else "linux",
            "platform_system": self.system,
            "platform_machine": self.processor,
            "python_version": version,
            "python_full_version": f"{version}.9",
            "implementation_version": f"{version}.9",
            "extra": "",
        }


MACHINES = (Machine("Linux", "x86_64"), Machine("Linux", "aarch64"), Machine("Darwin", "arm64"))


def missing_wheels(pylock: str) -> Iterator[str]:
    """One line for each package, Python and machine that it is needed on and has no wheel for."""
    packages = tomllib.loads(pylock).get("packages", [])
    for python, machine in itertools.product(PYTHONS, MACHINES):
        environment, tags = machine.environment(python), machine.tags(python)
        for package in packages:
            is_needed = "marker" not in package or Marker(package["marker"]).evaluate(environment)
            if is_needed and package["name"] not in BUILT and not _fits(package, tags):
                yield f"{package['name']} {package['version']} on Python {python[0]}.{python[1]}, {machine}"


def _fits(package: dict[str, Any], tags: set[Tag]) -> bool:
    names = [wheel.get("name") or wheel["url"].rpartition("/")[2] for wheel in package.get("wheels", [])]
    return any(parse_wheel_filename(name)[3] & tags for name in names)
