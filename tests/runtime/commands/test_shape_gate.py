"""Which gate refuses what the connector does not take: ``shape``, unless only the limits made it so."""

from __future__ import annotations

import pytest
from pydantic import BaseModel, Field

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.machines.commands.admission import refusal_on_acting
from mosaic_core.machines.commands.gates import Gate
from mosaic_core.machines.commands.slow_down import Measures
from mosaic_core.runtime.commands.command_shaper import CommandShaper
from mosaic_core.runtime.commands.command_turn import CommandTurn
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.limits import FieldLimit


class Spin(BaseModel):
    rpm: float = Field(ge=0.5)
    tool: str


class Spinner(DataChannelReceivable[Spin]):
    def handle_data(self, data: Spin) -> None:
        raise AssertionError("only shaped here")


LIMITED = ReceiverSafety(limits=(FieldLimit(("rpm",), 0.0, 0.25),), motion_fields=("rpm",))


@pytest.mark.parametrize(
    ("safety", "payload", "gate", "field"),
    [
        (ReceiverSafety(), b'{"rpm": 1}', Gate.SHAPE, "tool"),
        (LIMITED, b'{"rpm": 1}', Gate.SHAPE, "tool"),
        (LIMITED, b'{"rpm": 1, "tool": "saw"}', Gate.ENVELOPE, "rpm"),
    ],
)
def test_what_fits_no_better_before_the_limits_is_refused_at_the_gate_shape(
    safety: ReceiverSafety, payload: bytes, gate: Gate, field: str
) -> None:
    shaper = CommandShaper(Spinner("spinner"), safety, lambda: 0)
    refusal = refusal_on_acting(CommandTurn(payload, shaper, safety, Measures, lambda command: None))
    assert refusal is not None
    assert (refusal.gate, refusal.code) == (gate, "channel.invalid")
    assert refusal.message.startswith(f"{field}: ")
