"""Which microphone and loudspeaker goes on which audio line of an offer."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.adapters.peers.offer_vetting import OfferedLine, lines_for_labels, sound_lines
from mosaic_core.runtime.transport.media_transport import SoundLabels

LINES = (
    OfferedLine("0", "video", True),
    OfferedLine("1", "audio", True),
    OfferedLine("2", "audio", False, True),
    OfferedLine("3", "audio", True, True),
    OfferedLine("4", "audio", False, False),
)
SOUND = SoundLabels(["cabin", "outside"], ["horn", "bell"])


def test_lines_are_given_by_name_and_direction() -> None:
    assert sound_lines(LINES, SOUND, {"1": "cabin", "2": "horn"}) == ({"1": "cabin"}, {"2": "horn"})
    assert sound_lines(LINES, SOUND, {"1": "horn", "2": "cabin"}) == ({}, {})


def test_a_line_for_both_ways_is_used_for_what_it_is_named_after() -> None:
    assert sound_lines(LINES, SOUND, {"3": "cabin"}) == ({"3": "cabin"}, {})
    assert sound_lines(LINES, SOUND, {"3": "horn"}) == ({}, {"3": "horn"})


def test_an_offer_that_names_nothing_is_given_no_sound() -> None:
    assert sound_lines(LINES, SOUND, None) == ({}, {})


@given(
    st.lists(st.tuples(st.sampled_from(["audio", "video"]), st.booleans(), st.booleans()), max_size=6),
    st.dictionaries(st.sampled_from("012345"), st.sampled_from(["cabin", "outside", "horn", "bell", "front", "x"])),
)
def test_whatever_is_offered_no_line_and_no_label_is_given_twice(
    kinds: list[tuple[str, bool, bool]], tracks: dict[str, str]
) -> None:
    lines = [OfferedLine(str(mid), *kind) for mid, kind in enumerate(kinds)]
    pictures = lines_for_labels(lines, ["front"], tracks)
    heard, spoken = sound_lines(lines, SOUND, tracks)
    mids = [*pictures, *heard, *spoken]
    labels = [*pictures.values(), *heard.values(), *spoken.values()]
    assert len(set(mids)) == len(mids)
    assert len(set(labels)) == len(labels)
    assert set(heard.values()) <= set(SOUND.microphones)
    assert set(spoken.values()) <= set(SOUND.speakers)
    assert all(lines[int(mid)].is_wanted for mid in heard)
    assert all(lines[int(mid)].is_sending for mid in spoken)
