"""Makes the handlers of a connector as the robot would: params and safety are validated, then ``configure()`` runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, TypeVar, cast

from mosaic_core.contract.configurer import Configurer, check_configurer, check_written
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.harness.fake_hosts import FakeClock, FakeHost
from mosaic_core.harness.right_kind import check_made
from mosaic_core.runtime.configuration.auto_configurer import problems_of, usable_handlers
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.config_problems import validated
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.configuration.resolver import InstalledConnector, uninstalled
from mosaic_core.runtime.configuration.yaml_document import YamlDocument
from mosaic_core.words.config import ConnectorConfig
from mosaic_core.words.errors import ConfigError, Problem

MadeHandler = TypeVar("MadeHandler", covariant=True)


class Makes(Protocol[MadeHandler]):
    """A configurer whose ``configure`` says what it returns, so that ``build`` can say it too."""

    def configure(self) -> MadeHandler: ...


def build(
    configurer: type[Makes[MadeHandler]],
    *,
    label: str = "under_test",
    params: Mapping[str, Any] | None = None,
    safety: Mapping[str, Any] | None = None,
    delivery: str | Mapping[str, Any] | None = None,
    shared: Shared | None = None,
    clock: FakeClock | None = None,
) -> MadeHandler:
    """What ``configure()`` of this configurer returns, bound to a :class:`FakeHost` on ``clock``.

    ``label``, ``params``, ``safety`` and ``delivery`` are written as in the YAML file. Raises :class:`ConfigError` with
    every mistake, as ``mosaic validate`` would print it, and what ``configure()`` raises as it is. Devices that live
    in ``shared`` are opened by ``with shared.entered():``.
    """
    check_configurer(configurer, "build")
    check_written("build", params=params, safety=safety)
    check_made("shared", shared, Shared)
    check_made("clock", clock, FakeClock)
    model = cast("type[Configurer[Any]]", configurer)
    one = checked_entry(
        model, label, {"params": dict(params or {}), "safety": dict(safety or {}), "delivery": delivery}
    )
    made = model(label, one.params, safety=one.safety, shared=shared).configure()
    problems: list[Problem] = []
    handlers = usable_handlers(one, made, problems)
    if problems or (problems := [*problems_of(one, handlers)]):
        raise ConfigError(problems)
    clock = clock or FakeClock()
    for handler in handlers:
        host = FakeHost(clock)
        if isinstance(handler, DataChannelReceivable):
            host.safety = ReceiverSafety.of(one.safety, handler)
        handler.bind(host)
    return cast("MadeHandler", made)


def checked_entry(
    configurer: type[Configurer[Any]],
    label: str,
    entry: Mapping[str, Any],
    installed: InstalledConnector | None = None,
) -> CheckedConnector:
    """The connector of an ``entry`` of the YAML file, which ``installed`` ships; raises :class:`ConfigError`."""
    document = YamlDocument({"type": configurer.connector_type or "under-test", "label": label, **entry})
    config, problems = validated(ConnectorConfig, document.tree, document, ())
    if config is None:
        raise ConfigError(problems)
    params, problems = validated(configurer.params_model, config.params, document, ("params",))
    safety, more = validated(configurer.safety_model, config.safety, document, ("safety",))
    if params is None or safety is None:
        raise ConfigError([*problems, *more])
    installed = installed or uninstalled(configurer, config.type)
    return CheckedConnector(config, configurer, params, safety, installed, (), document)
