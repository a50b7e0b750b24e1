"""The ``ros2-service`` connector: operators' requests to a service of ROS, and its answers."""

from __future__ import annotations

import types
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import Refused
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_ros2.bus.bus import BusError
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.params import Ros2Params, RosName, ServiceTypeName
from mosaic_ros2.conversion.json_form import fields_of, model_of, plain

Q = TypeVar("Q")
A = TypeVar("A")

NO_SERVER = "plugin.no_device"


class Ros2ServiceParams(Ros2Params):
    service: RosName = Field(description="Its name, like /reset.")
    type: ServiceTypeName = Field(description="Its type, like std_srvs/srv/Trigger.")
    timeout_s: float = Field(default=10.0, gt=0, le=3600, description="Seconds after which a request is given up.")
    requires_lease: bool = Field(
        default=False, description="Only for the holder of the lease; right for whatever moves something."
    )


class ServiceCall:
    """Calls one service with values, and encodes and decodes them."""

    def __init__(self, shared: SharedBus, service: str, type_name: str) -> None:
        """Raises :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""
        self.service = service
        self._shared = shared
        self._type_name = type_name
        self._encoder = CdrEncoder(shared.book, f"{type_name}_Request")
        self._decoder = Decoder(shared.book, f"{type_name}_Response")

    def answer(self, fields: Any, is_over: Any) -> dict[str, Any] | None:
        """The response, decoded; ``None`` once ``is_over`` says so. Raises :class:`Refused`."""
        try:
            caller = self._shared.caller(self.service, self._type_name)
            reply = caller.call(self._encoder.encode(fields), is_over)
            return None if reply is None else self._decoder.decode(reply)
        except BusError as error:
            raise Refused(NO_SERVER, str(error)) from error
        except CdrError as error:
            raise Refused("channel.invalid", str(error)) from error


class RosService(RequestHandler[Q, A], Generic[Q, A]):
    """Passes requests on, each on a thread of its own."""

    def __init__(self, label: str, call: ServiceCall, requires_lease: bool) -> None:
        super().__init__(label)
        self.requires_lease = requires_lease
        self._call = call

    def answer(self, question: Q, request: Request) -> Any:
        response = self._call.answer(fields_of(question), lambda: request.is_cancelled)  # type: ignore[arg-type]
        return {} if response is None else plain(response)


class Ros2ServiceConfigurer(DataChannelConfigurer[Ros2ServiceParams]):
    """A ROS 2 service that operators may call."""

    connector_type = "ros2-service"
    example: ClassVar[dict[str, Any] | None] = {"service": "/reset", "type": "std_srvs/srv/Trigger"}

    def configure(self) -> RosService[Any, Any]:
        params, shared = self.params, self.params.bus(self.shared)
        question = model_of(shared.book, f"{params.type}_Request", is_command=True)
        answer = model_of(shared.book, f"{params.type}_Response", is_command=False)
        content = {"__module__": __name__, "answer_within_s": params.timeout_s}
        base: Any = RosService
        made = types.new_class("RosServiceOfType", (base[question, answer],), {}, lambda own: own.update(content))
        return made(self.label, ServiceCall(shared, params.service, params.type), params.requires_lease)  # type: ignore[no-any-return]
