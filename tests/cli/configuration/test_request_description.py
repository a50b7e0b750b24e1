"""What `mosaic connectors show` says of a connector that answers requests."""

from __future__ import annotations

from mosaic_core import DataChannelConfigurer, Message, NoParams, Request, RequestHandler
from mosaic_core.cli.configuration.connector_defaults import defaults_of, lines_of
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


def test_what_bounds_motion_is_not_offered_and_what_bounds_an_answer_is_told() -> None:
    offered = {row[0] for row in dict(param_tables(MeasureConfigurer))["safety"]}
    assert "requires_lease" in offered
    assert not offered & {"timeout_s", "on_timeout", "limits"}
    (channel,) = defaults_of("measure", MeasureConfigurer)
    lines = dict(lines_of(channel))
    assert lines["answers"] == "within 30 s (answer_within_s), 4 at once (at_once)"
    assert lines["lease"] == "none is needed"
    assert not lines.keys() & {"time-out", "safe action", "limits"}
