"""What ``mosaic bench`` computes and says, and one short run of it."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.bench.figures import FREEZE_S, Figures, Seen, figures, freezes, rank
from mosaic_core.bench.table import COLUMNS, cells, markdown_table
from mosaic_core.bench.time_stripe import burn, read_age_ms


@given(
    at_s=st.floats(0, 1e6),
    age_s=st.floats(0, 60),
    size=st.sampled_from([(480, 640), (240, 320), (120, 160), (360, 640)]),
    noise=st.integers(0, 60),
)
def test_the_burnt_in_time_survives_coding_and_scaling(
    at_s: float, age_s: float, size: tuple[int, int], noise: int
) -> None:
    image = np.full((480, 640, 3), 127, np.uint8)
    burn(image, at_s)
    height, width = size
    luma = image[:: 480 // height, :: 640 // width, 0][:height].astype(np.int16)
    luma += np.random.default_rng(noise).integers(-noise, noise + 1, luma.shape).astype(np.int16)
    age_ms = read_age_ms(np.clip(luma, 0, 255).astype(np.uint8), at_s + age_s)
    assert age_ms is not None
    assert -1.1 < age_ms - 1000 * age_s < 1.1 or age_ms > 1e7


@pytest.mark.parametrize("level", [0, 127, 255])
def test_a_picture_without_a_time_has_no_age(level: int) -> None:
    assert read_age_ms(np.full((480, 640), level, np.uint8), 5.0) is None


@given(values=st.lists(st.floats(0, 1e3), min_size=1), share=st.floats(0.01, 1))
def test_a_rank_is_one_of_the_values_and_splits_them(values: list[float], share: float) -> None:
    found = rank(values, share)
    assert found in values
    assert sum(value <= found for value in values) >= share * len(values) - 1e-6


def test_a_freeze_is_a_gap_and_the_ends_count() -> None:
    steady = [0.03 * number for number in range(100)]
    assert freezes(steady, 0.0, 3.0) == 0
    assert freezes([], 0.0, 3.0) == 1
    assert freezes(steady, -FREEZE_S - 0.01, 3.0) == 1
    assert freezes([*steady, 3.5], 0.0, 4.0) == 2


def test_a_row_of_a_run() -> None:
    seen = Seen(0.0, 2.0, [0.1 * number for number in range(20)], [50.0] * 20, 4, [10.0, 20.0, 30.0], 250_000)
    row = figures("4g", 0.5, 0.7, seen, 1.25)
    assert (row.command_p50_ms, row.command_p95_ms, row.commands_lost) == (20.0, 30.0, 0.25)
    assert (row.pictures_per_s, row.freezes_per_min, row.to_operator_mbps) == (10.0, 0.0, 1.0)
    assert cells(row) == ["4g", "20 / 30", "25.0%", "50 / 50", "10.0", "0.0", "1.00", "1.2", "0.50", "0.70"]


def test_what_was_not_seen_has_no_figure_and_a_failure_has_its_code() -> None:
    table = markdown_table([Figures("severe"), Figures("4g", failure="ice.timeout")]).splitlines()
    assert table[2].startswith("| severe | – / – |")
    assert table[3].startswith("| 4g | ice.timeout |")
    assert {line.count("|") for line in table} == {len(COLUMNS) + 1}


def mosaic(*words: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "mosaic_core.cli.main", "bench", *words]
    return subprocess.run(line, capture_output=True, text=True, timeout=90)


@pytest.mark.parametrize(
    ("words", "hint"), [(["--profile", "wifi"], "did you mean 'wifi-walls'"), (["--nat", "cone"], "full-cone")]
)
def test_an_unknown_network_gets_the_nearest_name(words: list[str], hint: str) -> None:
    done = mosaic(*words)
    assert done.returncode == 2
    assert hint in done.stderr


@pytest.mark.webrtc
def test_one_command_measures_a_network() -> None:
    done = mosaic("--profile", "starlink", "--seconds", "1", "--json")
    assert done.returncode == 0, done.stderr
    row = json.loads(done.stdout)
    assert row["profile"] == "starlink"
    assert row["failure"] == ""
    assert 20 < row["command_p50_ms"] < 2000
    assert 30 < row["picture_p50_ms"] < 5000
    assert 0 < row["connect_s"] < 30
    assert 0 < row["first_picture_s"] < 30
    assert row["recovery_s"] is not None
