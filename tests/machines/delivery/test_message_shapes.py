"""A shape is checked once, and what is remembered is bounded."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.message_shapes import MAX_SHAPES, MessageShapes, shape_of

JSON = st.none() | st.booleans() | st.integers() | st.text(max_size=2)


def test_a_mapping_is_known_by_its_keys_and_their_classes_and_anything_else_by_its_class() -> None:
    shape = shape_of({"a": 1, "b": "x"})
    assert shape == shape_of({"a": 2, "b": ""})
    assert shape not in (shape_of({"a": 1}), shape_of({"a": "1", "b": "x"}), shape_of({"a": 1, "b": "x", "c": 3}))
    assert shape_of(1.5) == shape_of(2.5) != shape_of(1)


@given(st.lists(st.dictionaries(st.text(max_size=3), JSON, max_size=3), max_size=300))
def test_what_was_just_added_is_known_and_no_more_is_kept_than_allowed(messages: list[dict[str, object]]) -> None:
    shapes = MessageShapes()
    for message in messages:
        shapes.add(shape_of(message))
        assert shapes.is_known(shape_of(dict(message)))
        assert len(shapes._known) <= MAX_SHAPES
