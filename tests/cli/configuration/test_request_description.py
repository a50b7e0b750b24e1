"""What `mosaic connectors show` says of a connector that answers requests."""

from __future__ import annotations

from mosaic_core import DataChannelConfigurer, Message, NoParams, Request, RequestHandler
from mosaic_core.cli.configuration.connector_description import param_tables, request_schemas
from mosaic_core.runtime.handlers.connection_check import ConnectionCheckConfigurer


class Ask(Message):
    n: int


class Told(Message):
    length_m: float


class Measure(RequestHandler[Ask, Told]):
    def answer(self, question: Ask, request: Request) -> Told:
        return Told(length_m=question.n)


class MeasureConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Measure:
        return Measure(self.label)


def test_question_and_answer_have_tables_of_their_own() -> None:
    tables = dict(param_tables(MeasureConfigurer))
    assert tables["question"] == [("n", "integer", "required", "", "")]
    assert tables["answer"] == [("length_m", "number", "required", "m", "")]


def test_other_connectors_have_none() -> None:
    assert request_schemas(ConnectionCheckConfigurer) == {}
