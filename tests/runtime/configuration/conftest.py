"""Plugins that exist for one test, and configurations that use them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer, Rehearsal
from mosaic_core.runtime.configuration.checked_config import Validation
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.errors import ConfigError, Problem

Rehearsed = Callable[..., Rehearsal]
ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"

ACME = '''
from collections.abc import Iterator
from typing import Any, Literal

from pydantic import Field

from mosaic_core import *
from mosaic_core.words.config import SafetyConfig


class GaugeParams(Params):
    port: str = "/dev/ttyUSB0"
    period_s: float = Field(default=1.0, gt=0, description="Seconds between two readings")
    mode: Literal["fast", "slow"] = "fast"
    serial_number: str | None = None
    channels: tuple[int, ...] = ()


class Reading(Message):
    voltage_v: float = Field(json_schema_extra=unit("V"))


class Gauge(DataChannelSendable[Reading]):
    widget = "value-cards"

    def messages(self) -> Iterator[Reading]:
        yield from ()


class GaugeConfigurer(DataChannelConfigurer[GaugeParams]):
    """Reads a gauge.

    More about it.
    """

    connector_type = "gauge"

    def configure(self) -> Gauge:
        return Gauge(self.label)


class Speed(Message):
    mps: float


class Wheel(DataChannelReceivable[Speed]):
    timeout_s = 0.4
    delivery = Delivery.LATEST

    def handle_data(self, data: Speed) -> None:
        pass

    def make_safe(self, cause: str) -> None:
        pass


class WheelParams(Params):
    pin: int


class WheelSafety(SafetyConfig):
    max_mps: float = Field(default=1.0, gt=0)


class WheelConfigurer(DataChannelConfigurer[WheelParams]):
    connector_type = "motor"
    safety_model = WheelSafety

    def configure(self) -> Wheel:
        return Wheel(self.label)


class Eye(MediaTrackHandler):
    pass


class EyeConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "eye"

    def configure(self) -> Eye:
        return Eye(self.label)


class Pair(DataChannelReceivable[str]):
    def handle_data(self, data: str) -> None:
        pass


class Answer(DataChannelSendable[str]):
    pass


class PairConfigurer(Configurer[NoParams]):
    connector_type = "pair"

    def configure(self) -> list[Handler]:
        return [Pair(f"{self.label}-receiver"), Answer(f"{self.label}-sender")]


class FaultyConfigurer(Configurer[NoParams]):
    connector_type = "faulty"

    def configure(self) -> Handler:
        raise OSError("no such bus")


class LeavingParams(Params):
    when: str = "configured"


class LeavingConfigurer(Configurer[LeavingParams]):
    connector_type = "leaving"

    def __init__(self, label: str, params: LeavingParams, **more: Any) -> None:
        super().__init__(label, params, **more)
        if params.when == "made":
            raise SystemExit(3)

    def configure(self) -> Handler:
        raise GeneratorExit("panic") if self.params.when == "panic" else SystemExit(3)


class NothingConfigurer(Configurer[NoParams]):
    connector_type = "nothing"

    def configure(self) -> Any:
        return None


class HiddenConfigurer(Configurer[NoParams]):
    connector_type = "hidden"

    def configure(self) -> Handler:
        return Gauge("_hidden")


class Strange(Message):
    model_config = {"arbitrary_types_allowed": True}
    thing: Any = None
    call: type(print) | None = None


class Odd(DataChannelSendable[Strange]):
    pass


class OddConfigurer(Configurer[NoParams]):
    connector_type = "odd"

    def configure(self) -> Handler:
        return Odd(self.label)


class WatcherParams(Params):
    main: CameraLabel | None = None
    others: tuple[CameraLabel, ...] = ()
    weights: dict[CameraLabel, float] = {}
    films: OwnFolder | None = None
    data: tuple[DataLabel, ...] = ()


class WatcherConfigurer(DataChannelConfigurer[WatcherParams]):
    connector_type = "watcher"

    def configure(self) -> Gauge:
        return Gauge(self.label)


class NotAConfigurer:
    pass


class Unfinished(DataChannelConfigurer[NoParams]):
    connector_type = "unfinished"
'''

TYPES = {
    "gauge": "acme_gauges:GaugeConfigurer",
    "motor": "acme_gauges:WheelConfigurer",
    "eye": "acme_gauges:EyeConfigurer",
    "pair": "acme_gauges:PairConfigurer",
    "faulty": "acme_gauges:FaultyConfigurer",
    "leaving": "acme_gauges:LeavingConfigurer",
    "nothing": "acme_gauges:NothingConfigurer",
    "hidden": "acme_gauges:HiddenConfigurer",
    "odd": "acme_gauges:OddConfigurer",
    "watcher": "acme_gauges:WatcherConfigurer",
    "no-configurer": "acme_gauges:NotAConfigurer",
    "unfinished": "acme_gauges:Unfinished",
    "no-module": "acme_missing:Configurer",
}


@pytest.fixture
def acme(install_distribution: InstallDistribution) -> ConnectorResolver:
    """A resolver that knows only what the distribution acme-gauges 1.0.0 offers."""
    from importlib.metadata import distribution

    install_distribution("acme-gauges", modules={"acme_gauges": ACME}, entry_points={"mosaic.connectors": TYPES})
    points = [one for one in distribution("acme-gauges").entry_points if one.group == "mosaic.connectors"]
    return ConnectorResolver(points)


@pytest.fixture
def entry_points_of(acme: ConnectorResolver) -> Callable[[str], EntryPoint]:
    return lambda name: acme.find(name).entry_point


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str | bytes], Path]:
    def write_file(text: str | bytes) -> Path:
        path = tmp_path / "robot.yaml"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write_file


@pytest.fixture
def robot_yaml() -> Callable[..., str]:
    """A valid file around ``connectors``."""

    def text(connectors: str = "[]", server: str = "") -> str:
        return f"""\
version: 1
server:
  ws_url: wss://mosaic.example.org
  auth: {{ type: simple-token, robot_id: {ROBOT_ID}, params: {{ token: abc }} }}
{server}connectors: {connectors}
"""

    return text


@pytest.fixture
def check(acme: ConnectorResolver, write: Callable[[str | bytes], Path]) -> Callable[..., Validation]:
    """What is said about a text; also where nothing can be read."""

    def check_text(text: str | bytes, environ: dict[str, str] | None = None, **options: Any) -> Validation:
        return validate_file(write(text), resolver=acme, environ=environ or {}, **options)

    return check_text


@pytest.fixture
def problems(check: Callable[..., Validation]) -> Callable[..., tuple[Problem, ...]]:
    def problems_of(text: str | bytes, environ: dict[str, str] | None = None, **options: Any) -> tuple[Problem, ...]:
        try:
            return check(text, environ, **options).problems
        except ConfigError as error:
            return error.problems

    return problems_of


@pytest.fixture
def rehearsed(acme: ConnectorResolver, write: Callable[[str], Path], robot_yaml: Callable[..., str]) -> Rehearsed:
    """What `mosaic validate` says of these connectors, each on a line of its own from line 6 on."""

    def rehearsal_of(*connectors: str, **options: Any) -> Rehearsal:
        text = robot_yaml("".join(f"\n  - {{ {one} }}" for one in connectors))
        validation = validate_file(write(text), resolver=acme, environ={}, **options)
        found = AutoConfigurer(resolver=acme, plugins=hook_plugins([])).rehearse(validation)
        return replace(found, problems=(*validation.problems, *found.problems))

    return rehearsal_of
