"""A plugin that keeps every rule, in a folder that a test may spoil."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mosaic_core.testing.distributions import forget_modules_of

PROJECT = """[project]
name = "acme-gauge"
version = "1.0.0"
readme = "README.md"
license = "Apache-2.0"
requires-python = ">=3.11"

[project.entry-points."mosaic.connectors"]
acme-gauge = "acme_gauge.connector:GaugeConfigurer"
acme-wheel = "acme_gauge.connector:WheelConfigurer"
"""
README = """# acme-gauge

```yaml
connectors:
  - { type: acme-gauge, label: gauge, params: { period_s: 0.5 } }
  - { type: acme-wheel, label: wheel }
```
"""
CONNECTOR = '''"""A gauge and a wheel."""

from collections.abc import Iterator

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, DataChannelSendable, Delivery, DeviceGone
from mosaic_core import Message, Params, unit
from pydantic import Field


class GaugeParams(Params):
    port: str = Field(default="made-up", description="Where it is plugged in.")
    period_s: float = Field(default=0.02, gt=0, description="Seconds between two readings.")


class Reading(Message):
    pressure: float = Field(json_schema_extra=unit("bar"))


class Gauge(DataChannelSendable[Reading]):
    def __init__(self, label: str, params: GaugeParams) -> None:
        super().__init__(label)
        self.params = params

    def messages(self) -> Iterator[Reading]:
        if self.params.port != "made-up":
            raise DeviceGone("unplugged")
        for _ in self.every(self.params.period_s):
            yield Reading(pressure=1.0)


class GaugeConfigurer(DataChannelConfigurer[GaugeParams]):
    """What a gauge shows."""

    connector_type = "acme-gauge"

    def configure(self) -> Gauge:
        return Gauge(self.label, self.params)


class WheelParams(Params):
    pass


class Turn(Message):
    speed_mps: float = Field(ge=-1, le=1)


class Wheel(DataChannelReceivable[Turn]):
    delivery = Delivery.LATEST
    timeout_s = 0.3
    requires_lease = True
    motion_fields = ("speed_mps",)

    def handle_data(self, data: Turn) -> None:
        pass

    def make_safe(self, cause: str) -> None:
        pass


class WheelConfigurer(DataChannelConfigurer[WheelParams]):
    """A wheel that turns."""

    connector_type = "acme-wheel"

    def configure(self) -> Wheel:
        return Wheel(self.label)
'''
TEST = "from mosaic_core.testing import build\n"


class GoodPlugin:
    """A plugin in a folder. :meth:`spoil` changes one of its files."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        files = {
            "pyproject.toml": PROJECT, "README.md": README, "acme_gauge/__init__.py": "", "acme_gauge/py.typed": "",
            "acme_gauge/connector.py": CONNECTOR, "tests/test_gauge.py": TEST,
        }  # fmt: skip
        for name, text in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)

    def spoil(self, file: str, old: str, new: str) -> None:
        path = self.folder / file
        text = path.read_text()
        assert old in text, f"{file} has no {old!r}"
        path.write_text(text.replace(old, new))


@pytest.fixture
def plugin(tmp_path: Path) -> Iterator[GoodPlugin]:
    folder, path = tmp_path / "acme-gauge", list(sys.path)
    yield GoodPlugin(folder)
    sys.path[:] = path
    forget_modules_of(folder)
