"""A receiver in which nothing reads what operators send is refused before anything starts."""

from __future__ import annotations

from typing import Any

import pytest
from support.refused_start import problems_at_start

from mosaic_core import (
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelJsonReceivable,
    DataChannelSendable,
    Handler,
    NoParams,
    Request,
    RequestHandler,
)
from mosaic_core.testing import connector, joined


class Deaf(DataChannelJsonReceivable):
    """Has no body."""


class DeafBothWays(DataChannelBidirectional[dict[str, Any]]):
    """Has no body."""


class Mute(RequestHandler[dict[str, Any], dict[str, Any]]):
    """Has no answer."""


class Hears(DataChannelJsonReceivable):
    def handle_data(self, data: dict[str, Any]) -> None:
        """Hears it."""


class HearsBelow(Hears):
    """Its base reads."""


class Answers(RequestHandler[dict[str, Any], dict[str, Any]]):
    def answer(self, question: dict[str, Any], request: Request) -> dict[str, Any]:
        return {}


class Pushes(DataChannelSendable[str]):
    """Sends from elsewhere, and takes nothing."""


def configurer_of(kind: type[Handler]) -> Any:
    class OneConfigurer(DataChannelConfigurer[NoParams]):
        connector_type = "one"

        def configure(self) -> Handler:
            return kind(self.label)

    return OneConfigurer


@pytest.mark.parametrize(
    ("kind", "name", "cure"),
    [
        (Deaf, "handle_data", "write handle_data(self, data) in Deaf"),
        (DeafBothWays, "handle_data", "write handle_data(self, data) in DeafBothWays"),
        (Mute, "answer", "write answer(self, question, request) in Mute"),
    ],
)
def test_a_receiver_without_a_body_is_refused(kind: type[Handler], name: str, cure: str) -> None:
    (problem,) = problems_at_start(configurer_of(kind), label="it")
    assert f"{kind.__name__} has no {name}: nothing reads them" in problem.message
    assert problem.cure == cure


@pytest.mark.parametrize("kind", [Hears, HearsBelow, Answers, Pushes])
async def test_what_is_read_or_only_sent_is_taken(kind: type[Handler]) -> None:
    async with joined(connector(configurer_of(kind), label="it")) as link:
        assert type(link.configured.connectors[0].handlers[0]) is kind
