"""Chunks become the same messages, and the same ones are forgotten, in Python and in TypeScript."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.machines.delivery.framing import FrameReader
from mosaic_core.machines.delivery.reassembly import PARTIALS_BYTES, Partials
from mosaic_core.words.errors import WireError

GOLDEN = json.loads((Path(__file__).parent / "reassembly.json").read_text())


def read(reader: FrameReader, step: dict[str, Any]) -> dict[str, str]:
    try:
        frame = reader.read(bytes.fromhex(step["message_hex"]), step["at_s"])
    except WireError as error:
        return {"refused": error.code}
    return {} if frame is None else {"completes_hex": frame.payload.hex()}


@pytest.mark.parametrize("scenario", [pytest.param(one, id=one["name"]) for one in GOLDEN["scenarios"]])
def test_a_golden_scenario_is_reassembled_as_written(scenario: dict[str, Any]) -> None:
    shared = Partials(scenario.get("limit_bytes", PARTIALS_BYTES))
    readers = {
        name: FrameReader(is_lossy=kind["is_lossy"], partials=shared) for name, kind in scenario["readers"].items()
    }
    for step in scenario["steps"]:
        if step.get("expire"):
            shared.expire(step["at_s"])
        else:
            expected = {key: step[key] for key in ("completes_hex", "refused") if key in step}
            assert read(readers[step["reader"]], step) == expected, step
        told = {name: seqs for name, reader in readers.items() if (seqs := reader.chunks.take_forgotten())}
        assert (told, shared.size_bytes) == (step.get("forgotten", {}), step["kept_bytes"]), step
