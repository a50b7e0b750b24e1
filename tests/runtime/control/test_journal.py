"""The journal: bounded, merged, and on disk if wanted."""

from __future__ import annotations

import json
import stat
import tracemalloc
from pathlib import Path

import pytest

from mosaic_core import Sender
from mosaic_core.machines.commands.gates import Gate, GateRefusal
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.runtime.control import journal as module
from mosaic_core.runtime.control.control_words import party_of, peer_info, stop_state
from mosaic_core.runtime.control.journal import MAX_ENTRIES, JournalFile, RobotJournal
from mosaic_core.words.control import JournalEntry

NO_LEASE = GateRefusal(Gate.LEASE, "lease.required")
ANN, BOB = Sender("ann", "a", name="Ann"), Sender("bob", "b")


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    it = Clock()
    monkeypatch.setattr(module, "time", it)
    return it


def whats(journal: RobotJournal) -> list[tuple[str, str, str]]:
    return [(entry.what, entry.who, entry.message) for entry in reversed(journal.newest(200))]


def test_it_keeps_the_newest_and_numbers_all() -> None:
    journal = RobotJournal()
    for _ in range(MAX_ENTRIES + 5):
        journal.note("stop")
    assert journal.newest(1)[0].number == MAX_ENTRIES + 5
    assert len(journal.newest(10 * MAX_ENTRIES)) == MAX_ENTRIES
    assert [entry.number for entry in journal.newest(2, before=11)] == [10, 9]
    assert [entry.number for entry in journal.newest(9, before=8)] == [7, 6]
    assert journal.newest(9, before=6) == journal.newest(9, before=-(10**30)) == ()
    assert [entry.number for entry in journal.newest(1, before=10**30)] == [MAX_ENTRIES + 5]


def test_what_is_kept_reads_as_it_was_written() -> None:
    written: list[JournalEntry] = []
    journal = RobotJournal(written.append)
    journal.note("peer.closed", who='Änn "\u2028" 🤖', subject="drive", code="peer.timeout", message="a\nb" * 200)
    assert journal.newest(1) == tuple(written)


def test_a_full_journal_takes_at_most_a_megabyte() -> None:
    def note_all() -> None:
        for number in range(2 * MAX_ENTRIES):
            journal.note("peer.closed", who=f"operator-{number}@example.com", code="peer.closed", message="It left.")

    journal = RobotJournal()
    tracemalloc.start()
    try:
        note_all()
        size_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert size_bytes < 500 * MAX_ENTRIES


def test_the_same_refusal_is_written_at_once_and_then_counted(clock: Clock) -> None:
    journal = RobotJournal()
    for _ in range(4):
        journal.refused("drive", ANN, NO_LEASE)
    journal.refused("drive", BOB, NO_LEASE)
    clock.now_s += 6
    journal.flush(clock.now_s)
    clock.now_s += 6
    journal.flush(clock.now_s)
    journal.refused("drive", ANN, NO_LEASE)
    assert whats(journal) == [
        ("command.refused", "Ann", ""),
        ("command.refused", "bob", ""),
        ("command.refused", "Ann", "3 more"),
        ("command.refused", "Ann", ""),
    ]


def test_the_log_and_the_journal_have_the_sentence_that_the_operator_gets(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    journal = RobotJournal()
    journal.refused("drive", ANN, GateRefusal(Gate.SHAPE, "channel.invalid", "rpm: Field\nrequired"))
    journal.refused("drive", ANN, NO_LEASE)
    with_sentence, without = [record.getMessage() for record in caplog.records]
    assert with_sentence.endswith("at the gate shape (channel.invalid): 'rpm: Field\\nrequired'")
    assert without.endswith(")")
    assert any(message.startswith("rpm: Field") for _, _, message in whats(journal))


def test_refusals_of_many_kinds_stay_bounded(clock: Clock) -> None:
    journal = RobotJournal()
    for number in range(5000):
        journal.refused(f"label {number}", ANN, GateRefusal(Gate.SHAPE, "channel.invalid"))
    assert len(journal.newest(5000)) == module.MAX_MERGED


def test_the_first_command_and_the_first_after_a_pause_or_a_change_are_written(clock: Clock) -> None:
    journal = RobotJournal()
    for _ in range(3):
        journal.accepted("drive", ANN)
        clock.now_s += 1
    journal.accepted("drive", BOB)
    clock.now_s += 10
    journal.accepted("drive", BOB)
    journal.lease_changed()
    journal.accepted("drive", BOB)
    assert [who for _, who, _ in whats(journal)] == ["Ann", "bob", "bob", "bob"]


def test_a_file_gets_every_entry_as_a_line_that_only_its_owner_reads(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    file = JournalFile(path)
    journal = RobotJournal(file.write)
    journal.note("stop", who="Ann %s", message="look: 100 %")
    journal.note("stop.clear", who="Ann")
    file.close()
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [(line["what"], line["who"]) for line in lines] == [("stop", "Ann %s"), ("stop.clear", "Ann")]
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_file_that_cannot_be_opened_is_told_and_harms_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = JournalFile(tmp_path / "missing" / "journal.jsonl")
    journal = RobotJournal(file.write)
    journal.note("stop")
    file.close()
    assert len(journal.newest(1)) == 1
    assert "can't be written" in caplog.text


def test_every_entry_of_an_operator_carries_the_account_of_its_ticket(clock: Clock) -> None:
    journal, ann = RobotJournal(), Sender("ann", "a", "account-1", "Ann")
    journal.refused("drive", ann, NO_LEASE)
    journal.accepted("drive", ann)
    journal.note("stop", who="Ann", account="account-1")
    assert [entry.account for entry in journal.newest(10)] == ["account-1"] * 3
    journal.note("lease.ended", who="the robot")
    assert journal.newest(1)[0].account is None


def test_who_is_present_and_who_stopped_is_told_with_the_account_of_the_ticket() -> None:
    ann = Sender("ann", "a", "account-1", "Ann")
    assert peer_info(party_of(ann)).account == "account-1"
    latch = StopLatch()
    latch.stop("Ann", "a child", "s1", 1.0)
    assert stop_state(latch, account=ann.operator_id).by_account == "account-1"
