"""Makes the handlers of a connector as the robot would: params and safety are validated, then ``configure()`` runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, TypeVar, cast

from mosaic_core.contract.configurer import Configurer
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import DataChannelReceivable, Handler, check_made
from mosaic_core.harness.fake_hosts import FakeClock, FakeHost
from mosaic_core.harness.right_kind import check_configurer
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.config_problems import validated
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.configuration.resolver import uninstalled
from mosaic_core.runtime.configuration.safety_problems import safety_problems
from mosaic_core.runtime.configuration.yaml_document import YamlDocument
from mosaic_core.words.config import ConnectorConfig
from mosaic_core.words.errors import ConfigError

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
    shared: Shared | None = None,
    clock: FakeClock | None = None,
) -> MadeHandler:
    """What ``configure()`` of this configurer returns, bound to a :class:`FakeHost` on ``clock``.

    ``params`` and ``safety`` are written as in the YAML file. Raises :class:`ConfigError` with every mistake, as
    ``mosaic validate`` would print it. Devices that live in ``shared`` are opened by ``with shared.entered():``.
    """
    check_configurer(configurer)
    model = cast("type[Configurer[Any]]", configurer)
    document = YamlDocument({"params": dict(params or {}), "safety": dict(safety or {})})
    valid_params, problems = validated(model.params_model, document.tree["params"], document, ("params",))
    valid_safety, more = validated(model.safety_model, document.tree["safety"], document, ("safety",))
    if valid_params is None or valid_safety is None:
        raise ConfigError([*problems, *more])
    made = model(label, valid_params, safety=valid_safety, shared=shared).configure()
    handlers: Sequence[Handler] = made if isinstance(made, Sequence) else [made]
    for handler in handlers:
        check_made(handler)
    if safety:
        raw = ConnectorConfig(type=model.connector_type or "under-test", label=label, safety=dict(safety))
        installed = uninstalled(model, raw.type)
        checked = CheckedConnector(raw, model, valid_params, valid_safety, installed, (), document)
        if wrong := [*safety_problems(checked, tuple(handlers))]:
            raise ConfigError(wrong)
    clock = clock or FakeClock()
    for handler in handlers:
        host = FakeHost(clock)
        if isinstance(handler, DataChannelReceivable):
            host.safety = ReceiverSafety.of(valid_safety, handler)
        handler.bind(host)
    return cast("MadeHandler", made)
