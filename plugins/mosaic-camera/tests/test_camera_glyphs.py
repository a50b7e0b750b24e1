"""The letters of the test pattern."""

import cv2
import numpy as np
import pytest

from mosaic_camera.glyphs import COLUMNS, GLYPHS, ROWS, text_mask, write_text
from mosaic_camera.pattern import PatternPainter


def test_a_digit_looks_like_itself() -> None:
    shown = ["".join("#" if square else "." for square in row) for row in text_mask("7")]
    assert shown == ["#####.", "....#.", "...#..", "..#...", ".#....", ".#....", ".#...."]


def test_every_glyph_fills_its_rows_and_no_two_are_alike() -> None:
    masks = [text_mask(sign) for sign in GLYPHS]
    assert {mask.shape for mask in masks} == {(ROWS, COLUMNS + 1)}
    assert not any(mask[:, COLUMNS:].any() for mask in masks)
    assert len({mask.tobytes() for mask in masks}) == len(GLYPHS)


def test_what_the_pattern_writes_has_glyphs() -> None:
    assert set("MOSAIC  640x480  29.97 fps frame 0123456789 12:34:56.789") - {" "} <= set(GLYPHS)


def test_text_is_white_where_it_was_asked_for_and_cut_off_at_the_edge() -> None:
    image = np.zeros((20, 30, 3), np.uint8)
    write_text(image, "11é", left=10, top=8, square=2)
    assert image[8:20, 10:].any()
    assert not image[:8].any()
    assert not image[:, :10].any()
    assert set(np.unique(image)) == {0, 255}


def test_the_pattern_writes_its_number() -> None:
    painter = PatternPainter(640, 480, 30)
    first, second = painter.draw(11111111, 1.0), painter.draw(77777777, 1.0)
    assert (first[260:320] != second[260:320]).any()


def test_the_pattern_unpacks_no_font(monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenCV's first text costs the process 8 MB, which it keeps."""
    monkeypatch.delattr(cv2, "putText")
    PatternPainter(160, 120, 9).draw(1, 1)
