"""Widgets that installed plugins ship are served by their hash, and nothing else is; one setting ends it."""

from __future__ import annotations

import base64
import gzip
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_server.settings import Settings
from mosaic_server.web.accepted_encoding import accepts
from mosaic_server.web.guards import content_security_policy
from mosaic_server.web.import_map import import_map_sources
from mosaic_server.widget_shelf import installed_widgets

MODULE = b"export const apiVersion = 1\nexport const Panel = () => '\xc3\xa9t\xc3\xa9'\n" + b"// more\n" * 200
SHA256 = hashlib.sha256(MODULE).hexdigest()
StartServer = Callable[..., Any]


@pytest.fixture
def module_file(install_distribution: InstallDistribution) -> Path:
    """acme-panels 1.2.0 is installed, and acme-broken, whose file is missing."""
    site = install_distribution(
        "acme-panels", version="1.2.0", entry_points={"mosaic.widgets": {"acme": "acme.widgets"}}
    )
    install_distribution("acme-broken", entry_points={"mosaic.widgets": {"broken": "acme_broken.widgets"}})
    path = site / "acme" / "widgets" / "acme.js"
    path.parent.mkdir(parents=True)
    path.write_bytes(MODULE)
    return path


@pytest.fixture
def server(module_file: Path, settings: Settings, start_server: StartServer) -> Iterator[Any]:
    with start_server(settings) as running:
        running.account()
        yield running


def test_an_operator_reads_which_modules_there_are(server: Any, module_file: Path) -> None:
    offer = server.get("/api/v1/widgets", server.log_in()).json()["resultData"]
    mine = [one for one in offer["modules"] if one["name"] in ("acme", "broken")]
    size = len(MODULE)
    assert offer["isOn"] is True
    assert mine == [
        {"name": "acme", "distribution": "acme-panels", "version": "1.2.0", "sha256": SHA256, "sizeBytes": size}
    ]


def test_strangers_do_not_read_what_is_installed(server: Any) -> None:
    assert server.http.get("/api/v1/widgets").status_code == 401


@pytest.mark.parametrize(("encoding", "content"), [("identity", None), ("gzip", "gzip")])
def test_a_module_is_served_by_its_hash_as_javascript_for_ever(server: Any, encoding: str, content: str | None) -> None:
    answer = server.http.get(f"/widgets/{SHA256}.js", headers={"Accept-Encoding": encoding})
    assert (answer.status_code, answer.content) == (200, MODULE)
    assert answer.headers["content-type"] == "text/javascript; charset=utf-8"
    assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["vary"] == "Accept-Encoding"
    assert answer.headers.get("content-encoding") == content


def test_a_file_that_changes_while_the_server_runs_is_served_as_it_was(server: Any, module_file: Path) -> None:
    module_file.write_text("export const apiVersion = 2")
    assert server.http.get(f"/widgets/{SHA256}.js").content == MODULE


@pytest.mark.parametrize(
    "path",
    [
        "",
        "acme.js",
        SHA256,
        f"{SHA256}.js.map",
        f"{SHA256.upper()}.js",
        f"{'0' * 64}.js",
        f"x/{SHA256}.js",
        "%2e%2e/index.html",
        "..%2f..%2fsettings.py",
        "%2fetc%2fpasswd",
        "%00.js",
    ],
)
def test_nothing_else_is_there(server: Any, path: str) -> None:
    assert server.http.get(f"/widgets/{path}").status_code == 404


def test_one_setting_switches_it_off(module_file: Path, settings: Settings, start_server: StartServer) -> None:
    with start_server(replace(settings, serves_widgets=False)) as running:
        running.account()
        offer = running.get("/api/v1/widgets", running.log_in()).json()["resultData"]
        assert offer == {"isOn": False, "modules": []}
        assert running.http.get(f"/widgets/{SHA256}.js").status_code == 404


def test_a_module_that_is_missing_is_logged_with_who_and_where(
    module_file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    installed_widgets(is_open=True)
    assert "a widget is not served: acme-broken 1.0.0 has no file" in caplog.text


def test_what_is_compressed_is_the_same_on_every_server(module_file: Path) -> None:
    one, other = (installed_widgets(is_open=True).module(SHA256) for _ in range(2))
    assert one is not None
    assert other is not None
    assert one.gzipped == other.gzipped
    assert gzip.decompress(one.gzipped) == MODULE


def test_the_policy_allows_the_import_map_of_the_page_and_no_other_script_in_it(tmp_path: Path) -> None:
    text = '{"imports":{"react":"/shared/react.js"}}'
    (tmp_path / "index.html").write_text(f'<script type="importmap">{text}</script><script>alert(1)</script>')
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    sources = import_map_sources(tmp_path)
    assert sources == f" 'sha256-{digest}'"
    policy = content_security_policy("rover", sources)
    assert f"script-src 'self' 'wasm-unsafe-eval' 'sha256-{digest}';" in policy
    assert "'unsafe-inline'" not in policy.partition("script-src")[2].partition(";")[0]


def test_a_server_sends_that_policy(settings: Settings, tmp_path: Path, start_server: StartServer) -> None:
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "index.html").write_text('<script type="importmap">{}</script>')
    with start_server(replace(settings, dashboard_dir=tmp_path / "page")) as running:
        policy = running.http.get("/").headers["content-security-policy"]
    assert import_map_sources(tmp_path / "page") in policy


def test_without_a_page_the_policy_allows_no_script_inside_it(tmp_path: Path) -> None:
    assert import_map_sources(tmp_path) == ""
    assert "script-src 'self' 'wasm-unsafe-eval'; " in content_security_policy("rover")


@pytest.mark.parametrize(
    ("header", "is_accepted"),
    [
        ("gzip", True),
        ("br, GZIP;q=0.5", True),
        ("gzip;q=0", False),
        ("gzip; q=0.000", False),
        ("br", False),
        ("", False),
    ],
)
def test_an_encoding_is_used_where_it_is_accepted(header: str, is_accepted: bool) -> None:
    assert accepts(header, "gzip") is is_accepted
