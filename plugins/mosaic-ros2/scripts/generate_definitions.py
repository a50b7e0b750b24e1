"""Writes ``common_interfaces.txt``: the fields of the messages that every ROS 2 installation has.

    pip install rosbags && python scripts/generate_definitions.py [--check]

Only names and types of fields are taken, which are facts of common_interfaces, rcl_interfaces and others (Apache-2.0),
geometry2 (BSD-3-Clause) and unique_identifier_msgs (BSD-3-Clause); no comments and no constants.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

TARGET = Path(__file__).parents[1] / "mosaic_ros2" / "definitions" / "common_interfaces.txt"
DISTRIBUTIONS = {
    "kilted": Stores.ROS2_KILTED, "jazzy": Stores.ROS2_JAZZY, "iron": Stores.ROS2_IRON, "humble": Stores.ROS2_HUMBLE,
}  # fmt: skip
"""The newest first; an older one adds a line where it differs."""
HEAD = """\
# Fields of ROS 2 messages from Humble to Kilted, written by scripts/generate_definitions.py.
# After @ stands the newest distribution of ROS that has this older form.
"""


def type_text(node: Any) -> str:
    kind, content = node
    if kind is Nodetype.NAME:
        return str(content)
    if kind is Nodetype.BASE:
        base, bound = content
        return {"octet": "byte"}.get(base, base) + (f"<={bound}" if bound else "")
    inner, size = content
    many = str(size) if kind is Nodetype.ARRAY else f"<={size}" if size else ""
    return f"{type_text(inner)}[{many}]"


def lines() -> list[str]:
    found: dict[str, dict[str, str]] = {}
    for distribution, store in DISTRIBUTIONS.items():
        for name, (_, fields) in get_typestore(store).fielddefs.items():
            body = ", ".join(f"{type_text(node)} {own}" for own, node in fields)
            forms = found.setdefault(name, {})
            if body not in forms:
                forms[body] = f"@{distribution}" if forms else ""
    return [f"{name}{mark}: {body}" for name in sorted(found) for body, mark in found[name].items()]


def main() -> int:
    text = HEAD + "\n".join(lines()) + "\n"
    if "--check" in sys.argv:
        return int(TARGET.read_text() != text)
    TARGET.write_text(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
