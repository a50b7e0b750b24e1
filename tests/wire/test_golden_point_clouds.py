"""The golden point clouds: the same bytes from Python and to TypeScript."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mosaic_core.words.errors import WireError

point_cloud = pytest.importorskip("mosaic_sensors.point_cloud", reason="mosaic-sensors is not installed")

GOLDEN = json.loads((Path(__file__).parent / "payloads" / "point_clouds.json").read_text())
CLOUDS = [pytest.param(entry, id=entry["name"]) for entry in GOLDEN["clouds"]]


@pytest.mark.parametrize("entry", CLOUDS)
def test_the_bytes_of_a_golden_cloud_are_read_as_the_cloud(entry: dict[str, Any]) -> None:
    cloud = point_cloud.decoded(bytes.fromhex(entry["hex"]))
    wanted = entry["cloud"]
    assert np.allclose(cloud.xyz, np.asarray(wanted["xyz"]).reshape(-1, 3), atol=entry["resolution_m"] / 2 + 1e-9)
    assert (cloud.frame_id, cloud.captured_at_s) == (wanted["frame_id"], wanted["captured_at_s"])
    if wanted["intensity"] is None:
        assert cloud.intensity is None
    else:
        assert np.allclose(cloud.intensity, wanted["intensity"], atol=0.5)
    assert (None if cloud.rgb is None else cloud.rgb.tolist()) == wanted["rgb"]


@pytest.mark.parametrize("entry", CLOUDS)
def test_a_golden_cloud_is_encoded_to_its_bytes(entry: dict[str, Any]) -> None:
    from mosaic_sensors.point_cloud.compact_form import encoded

    wanted = entry["cloud"]
    intensity = wanted["intensity"]
    if intensity is not None and all(isinstance(one, int) for one in intensity):
        intensity = np.asarray(intensity, dtype=np.uint8)
    rgb = None if wanted["rgb"] is None else np.asarray(wanted["rgb"], dtype=np.uint8)
    more = {"frame_id": wanted["frame_id"], "captured_at_s": wanted["captured_at_s"]}
    form = encoded(point_cloud.cloud_of(wanted["xyz"], intensity=intensity, rgb=rgb, **more), entry["resolution_m"])
    if not entry["deflated"]:  # how deflate spells it may differ from one zlib to another
        assert form.plain().hex() == entry["hex"]


@pytest.mark.parametrize("text", GOLDEN["malformed_hex"])
def test_malformed_clouds_are_refused(text: str) -> None:
    with pytest.raises(WireError):
        point_cloud.decoded(bytes.fromhex(text))
