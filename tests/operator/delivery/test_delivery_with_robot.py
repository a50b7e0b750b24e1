"""How data travels, as robot and operator both count it, in one process's memory."""

from __future__ import annotations

from typing import Any

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.laboratory.joining import connector, joined, until
from mosaic_core.machines.delivery.framing import Frame, PayloadKind, encode_frame
from mosaic_core.words.control import Refusal


class Values(DataChannelSendable[dict[str, int]]):
    pass


class ValuesConfigurer(DataChannelConfigurer[Params]):
    def configure(self) -> Values:
        return Values(self.label)


class Notes(DataChannelReceivable[dict[str, int]]):
    def handle_data(self, data: dict[str, int]) -> None:
        return


class NotesConfigurer(DataChannelConfigurer[Params]):
    def configure(self) -> Notes:
        return Notes(self.label)


async def test_a_thinned_connector_sends_the_newest_and_the_operator_learns_of_the_rest() -> None:
    thinned = connector(ValuesConfigurer, label="values", delivery={"mode": "latest", "max_rate_hz": 10})
    async with joined(thinned) as link:
        values = link.connection.receivable("values")
        await values.wait_open(5)
        seen: list[int] = []
        values.subscribe(lambda data: seen.append(int(data.decode().partition(":")[2].strip("}"))))
        handler: Any = link.configured.connectors[0].handlers[0]
        for n in range(100):
            handler.send_json({"n": n})
        await until(lambda: seen[-1:] == [99])
        row = (await link.connection.delivery.next_report())["values"]
        assert (row.delivery, row.messages, row.thinned) == ("latest", len(seen), 100 - len(seen))
        assert (values.counters.received, values.counters.arrivals.missed) == (len(seen), 0)


async def test_an_event_of_before_counts_as_sent_once_somebody_comes_for_it() -> None:
    async with joined(connector(ValuesConfigurer, label="values", delivery="reliable")) as link:
        handler: Any = link.configured.connectors[0].handlers[0]
        assert handler.send_json({"n": 1}) is False
        values = link.connection.receivable("values")
        seen: list[bytes] = []
        values.subscribe(seen.append)
        await until(lambda: seen == [b'{"n":1}'])
        assert link.robot.snapshot().connectors[0].messages == 1


async def test_an_operator_hears_of_a_message_that_came_in_part_only() -> None:
    async with joined(connector(NotesConfigurer, label="notes", delivery="latest")) as link:
        notes = link.connection.sendable("notes")
        await notes.wait_open(5)
        refusals: list[Refusal] = []
        link.connection.on_refusal(refusals.append)
        peer = next(iter(link.robot._running.peers))
        reader = peer._channels._ports["notes"].reader
        reader.chunks.timeout_s = 0.05
        first, *_ = encode_frame(Frame(PayloadKind.JSON, b"0123456789", seq=7), 4)
        on_message = peer._channels._ports["notes"].channel.on_message
        assert on_message is not None
        on_message(first)
        await until(
            lambda: [(one.label, one.seq, one.code) for one in refusals] == [("notes", 7, "channel.incomplete")]
        )
        assert link.robot.snapshot().connectors[0].refused == 1
