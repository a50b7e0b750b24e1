"""Why no picture is shown: the three causes, told apart by what arrived."""

from __future__ import annotations

import pytest

from mosaic_core.machines.media.first_frame import ReceivedSoFar, first_frame_code
from mosaic_core.words.codes import REASONS


@pytest.mark.parametrize(
    ("received", "code"),
    [
        (None, "media.no_first_frame"),
        (ReceivedSoFar(0, 0, None), "media.not_sent"),
        (ReceivedSoFar(0, 0, 0), "media.not_sent"),
        (ReceivedSoFar(0, 0, 250), "media.no_packets"),
        (ReceivedSoFar(250, 0, 250), "media.not_decoded"),
        (ReceivedSoFar(250, 0, None), "media.not_decoded"),
        (ReceivedSoFar(250, 3, 250), ""),
    ],
)
def test_what_arrived_tells_the_cause(received: ReceivedSoFar | None, code: str) -> None:
    assert first_frame_code(received) == code
    assert not code or REASONS[code].cure
