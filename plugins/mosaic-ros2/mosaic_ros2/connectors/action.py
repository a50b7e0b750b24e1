"""The ``ros2-action`` connector: operators' goals to an action of ROS. Feedback is the request's progress; a request
that is cancelled, by its operator, a stop or the loss of the lease, cancels the goal.
"""

from __future__ import annotations

import secrets
import time
import types
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, ClassVar, Generic, Literal, TypeVar

from pydantic import Field, create_model

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import Refused
from mosaic_core.contract.params import Message
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_ros2.bus.bus import BusError, Subscription
from mosaic_ros2.bus.qos import RELIABLE
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.connectors.params import ActionTypeName, Ros2Params, RosName
from mosaic_ros2.connectors.service import NO_SERVER, ServiceCall
from mosaic_ros2.conversion.json_form import fields_of, model_of, plain

Q = TypeVar("Q")
A = TypeVar("A")

GoalOutcome = Literal["succeeded", "canceled", "aborted", "unknown"]
_OUTCOMES: Mapping[int, GoalOutcome] = {4: "succeeded", 5: "canceled", 6: "aborted"}
"""action_msgs/GoalStatus."""
CANCEL_S = 2.0
"""Longest wait for the server's word that it cancels."""
SETTLE_S = 10.0
"""Longest wait for the result of a goal that was cancelled."""


class Ros2ActionParams(Ros2Params):
    action: RosName = Field(description="Its name, like /navigate_to_pose.")
    type: ActionTypeName = Field(description="Its type, like nav2_msgs/action/NavigateToPose.")
    timeout_s: float = Field(
        default=600.0, gt=0, le=86_400, description="Seconds after which a goal is given up and cancelled."
    )
    requires_lease: bool = Field(default=True, description="Only for the holder of the lease; a stop cancels the goal.")


class ActionClient:
    """The three services and the feedback of one action."""

    def __init__(self, shared: SharedBus, action: str, type_name: str) -> None:
        """Raises :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""
        self.action = action
        self._shared = shared
        self._feedback_type = f"{type_name}_FeedbackMessage"
        self._decoder = Decoder(shared.book, self._feedback_type)
        self._send = ServiceCall(shared, f"{action}/_action/send_goal", f"{type_name}_SendGoal")
        self._result = ServiceCall(shared, f"{action}/_action/get_result", f"{type_name}_GetResult")
        self._cancel = ServiceCall(shared, f"{action}/_action/cancel_goal", "action_msgs/srv/CancelGoal")

    def feedback(self) -> Subscription:
        """Its feedback, of everybody's goals. Raises :class:`Refused`."""
        try:
            return self._shared.joined().subscribe(f"{self.action}/_action/feedback", self._feedback_type, RELIABLE)
        except BusError as error:
            raise Refused(NO_SERVER, str(error)) from error

    def send(self, goal_id: bytes, goal: Mapping[str, Any], is_over: Any) -> bool:
        """Whether the server takes the goal; ``False`` too if it is over before. Raises :class:`Refused`."""
        answer = self._send.answer({"goal_id": {"uuid": goal_id}, "goal": goal}, is_over)
        if answer is not None and not answer["accepted"]:
            raise Refused("ros2.goal_rejected", f"{self.action} rejects this goal")
        return answer is not None

    def result(self, goal_id: bytes, is_over: Any) -> dict[str, Any] | None:
        """Status and result, once there are any; ``None`` once it is over."""
        return self._result.answer({"goal_id": {"uuid": goal_id}}, is_over)

    def cancel(self, goal_id: bytes) -> None:
        """Ask the server to cancel the goal; a server that is gone has nothing to cancel."""
        until_s = time.monotonic() + CANCEL_S
        with suppress(Refused):
            self._cancel.answer({"goal_info": {"goal_id": {"uuid": goal_id}}}, lambda: time.monotonic() > until_s)

    def feedback_in(self, data: bytes, goal_id: bytes) -> dict[str, Any] | None:
        """The feedback in this message, if it is of this goal."""
        try:
            message = self._decoder.decode(data)
        except CdrError:
            return None
        return plain(message["feedback"]) if bytes(message["goal_id"]["uuid"]) == goal_id else None


class RosAction(RequestHandler[Q, A], Generic[Q, A]):
    """Carries out goals, each on a thread of its own."""

    def __init__(self, label: str, client: ActionClient, requires_lease: bool) -> None:
        super().__init__(label)
        self.requires_lease = requires_lease
        self._client = client

    def answer(self, question: Q, request: Request) -> Any:
        goal_id = secrets.token_bytes(16)
        feedback = self._client.feedback()
        try:
            # A goal that was sent may run, also where its acceptance came too late: it is cancelled below.
            if not self._client.send(goal_id, fields_of(question), lambda: request.is_cancelled):  # type: ignore[arg-type]
                self._client.cancel(goal_id)
                return _outcome(None)
            return _outcome(self._client.result(goal_id, _Course(self._client, goal_id, request, feedback)))
        finally:
            feedback.close()


class _Course:
    """Asked several times a second whether a goal is over; tells feedback and cancels in between."""

    def __init__(self, client: ActionClient, goal_id: bytes, request: Request, feedback: Subscription) -> None:
        self._client = client
        self._goal_id = goal_id
        self._request = request
        self._feedback = feedback
        self._ends_at_s: float | None = None

    def __call__(self) -> bool:
        for arrived in self._feedback.take(0.0):
            told = self._client.feedback_in(arrived.data, self._goal_id)
            if told is not None:
                self._request.progress(told)
        if self._request.is_cancelled and self._ends_at_s is None:
            self._client.cancel(self._goal_id)
            self._ends_at_s = time.monotonic() + SETTLE_S
        return self._ends_at_s is not None and time.monotonic() > self._ends_at_s


def _outcome(response: Mapping[str, Any] | None) -> dict[str, Any]:
    if response is None:
        return {"outcome": "unknown", "result": None}
    return {"outcome": _OUTCOMES.get(response["status"], "unknown"), "result": plain(response["result"])}


class Ros2ActionConfigurer(DataChannelConfigurer[Ros2ActionParams]):
    """A ROS 2 action: goals with progress, which a stop cancels."""

    connector_type = "ros2-action"
    example: ClassVar[dict[str, Any] | None] = {
        "action": "/navigate_to_pose",
        "type": "nav2_msgs/action/NavigateToPose",
    }

    def configure(self) -> RosAction[Any, Any]:
        params, shared = self.params, self.params.bus(self.shared)
        goal = model_of(shared.book, f"{params.type}_Goal", is_command=True)
        result: Any = model_of(shared.book, f"{params.type}_Result", is_command=False)
        answer = create_model(
            "ActionResult", __base__=Message, outcome=(GoalOutcome, ...), result=(result | None, None)
        )
        content = {"__module__": __name__, "answer_within_s": params.timeout_s}
        base: Any = RosAction
        made = types.new_class("RosActionOfType", (base[goal, answer],), {}, lambda own: own.update(content))
        client = ActionClient(shared, params.action, params.type)
        return made(self.label, client, params.requires_lease)  # type: ignore[no-any-return]
