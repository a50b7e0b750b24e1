"""Finds what a configuration can't mean of a connector that answers requests."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_type_hints

from mosaic_core.contract.configurer import Configurer
from mosaic_core.contract.handler import Handler
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.machines.delivery.delivery_terms import chosen
from mosaic_core.runtime.configuration.catalogue_entry import receivers
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import Problem

CURES = {
    "limits": "remove it: the model of a question bounds its numbers",
    "on_loss": "remove it: a request ends when its operator leaves, and its handler is told",
    "on_timeout": "remove it",
    "slow_down": "remove it: a question is asked as it is",
    "timeout_s": "remove it: its class bounds a request by `answer_within_s`",
}
"""Of what bounds motion, and says nothing of a question and its answer."""
_DELIVERY_CURES = {
    "latch": "remove it: an answer is for the one who asked",
    "max_rate_hz": "remove it, or write max_rate_hz in `safety`, which bounds the questions",
}
"""Of what bounds what goes to everybody."""


def request_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """Limits of motion, and a delivery that loses messages or bounds none of them."""
    answering = [handler for handler in handlers if isinstance(handler, RequestHandler)]
    if not answering:
        return
    is_alone = len(answering) == len(receivers(handlers))
    for key in sorted(CURES.keys() & one.safety.model_fields_set if is_alone else ()):
        message = f"connector '{one.config.label}' answers requests, for which '{key}' has no meaning"
        yield one.problem(message, "safety", key, cure=CURES[key])
    its_delivery = one.config.delivery.model_fields_set if one.config.delivery is not None else set[str]()
    for key in sorted(_DELIVERY_CURES.keys() & its_delivery if len(answering) == len(handlers) else ()):
        message = f"connector '{one.config.label}' answers requests, for which '{key}' of a delivery has no meaning"
        yield one.problem(message, "delivery", key, cure=_DELIVERY_CURES[key])
    mode = chosen(answering[0].delivery, one.config.delivery).mode
    if mode not in (None, Delivery.RELIABLE):
        message = f"connector '{one.config.label}' answers requests, of which none may be lost: '{mode}' can't be"
        yield one.problem(message, "delivery", cure="remove `delivery`, or choose `reliable`")


def declared_requests(configurer: type[Configurer[Any]]) -> type[RequestHandler[Any, Any]] | None:
    """The request handler that ``configure`` is declared to make; ``None``: another one, or nothing is declared."""
    try:
        made = get_type_hints(configurer.configure).get("return")
    except (NameError, TypeError, AttributeError):  # names that only a type checker imports
        return None
    return made if isinstance(made, type) and issubclass(made, RequestHandler) else None
