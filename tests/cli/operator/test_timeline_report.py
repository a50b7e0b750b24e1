"""The timeline on a terminal: a row per moment, a bar for each, the end in words."""

from __future__ import annotations

import io

from rich.console import Console

from mosaic_core.cli.operator.operator_session import BAR_CELLS, timeline_table
from mosaic_core.machines.peers.connection_timeline import ConnectionTimeline


def printed(timeline: ConnectionTimeline) -> list[str]:
    output = io.StringIO()
    Console(file=output, width=160, highlight=False, markup=False).print(timeline_table(timeline))
    return output.getvalue().splitlines()


def test_a_failed_connection_shows_how_far_it_got() -> None:
    it = ConnectionTimeline(0.0)
    it.mark("asked", 0.0)
    it.mark("answered", 1.0, "in time")
    it.end("ice.timeout", 16.0)
    asked, answered, ended = printed(it)
    assert asked.startswith("Asked the server")
    assert "1000 ms" in answered
    assert "in time" in answered
    assert ended.startswith("Ended")
    assert "ice.timeout: No network path to the other side was found in time." in ended
    assert ended.count("█") > answered.count("█")
    assert all(line.count("█") <= BAR_CELLS for line in (asked, answered, ended))


def test_an_end_on_purpose_is_no_failure_and_an_empty_one_no_error() -> None:
    it = ConnectionTimeline(0.0)
    assert printed(it) == []
    it.end("peer.closed", 1.0)
    assert printed(it) == []
