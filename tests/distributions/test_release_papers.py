"""What goes beside a release is right: licences, sizes, checksums, what it consists of, and what an audit may claim."""

from __future__ import annotations

import json
import re
import tarfile
import tomllib
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import pytest

from release import checksums, notes
from release.audit import of_dashboard, of_python
from release.bill_of_materials import FOLDER, shipped
from release.licences import Rules, full_name, is_allowed, without_text, wrong
from release.requirements import LOCKS, PROJECTS, ROOT, normal, read
from release.sizes import BUDGETS, too_large

RULES = Rules(
    frozenset({"MIT", "ISC"}),
    {"License :: MIT": "MIT"},
    {"silent": {"licence": "GPL-3.0-only OR MIT", "where": "its LICENSE"}},
    {"font": {"licence": "OFL-1.1", "reason": "a font"}},
    {},
)
SILENT = {"name": "silent"}
FONT = {"name": "font", "licenses": [{"license": {"id": "OFL-1.1"}}]}


def component(*licences: str, name: str = "one") -> dict[str, Any]:
    return {"name": name, "licenses": [{"expression": text} for text in licences]}


@pytest.mark.parametrize(
    ("expression", "answer"),
    [
        ("MIT", True),
        ("GPL-3.0-only", False),
        ("MIT OR GPL-3.0-only", True),
        ("MIT AND GPL-3.0-only", False),
        ("GPL-3.0-only OR MIT AND ISC", True),
        ("(GPL-3.0-only OR MIT) AND ISC", True),
        ("(GPL-3.0-only OR MIT) AND BSD-3-Clause", False),
        ("((MIT))", True),
        ("", False),
    ],
)
def test_an_expression_is_allowed_where_one_choice_is_wholly(expression: str, answer: bool) -> None:
    assert is_allowed(expression, {"MIT", "ISC"}) is answer


def test_a_licence_that_is_not_on_the_list_is_told() -> None:
    assert list(wrong([SILENT, FONT, component("AGPL-3.0-only")], RULES)) == [
        "one is under AGPL-3.0-only, which is not allowed"
    ]
    assert list(wrong([SILENT, FONT, {"name": "one"}], RULES)) == ["one names no licence"]


def test_each_of_two_named_licences_must_be_allowed_and_other_names_are_understood() -> None:
    classifier = {"name": "one", "licenses": [{"license": {"id": "MIT"}}, {"license": {"name": "License :: MIT"}}]}
    assert list(wrong([SILENT, FONT, classifier], RULES)) == []
    assert list(wrong([SILENT, FONT, component("MIT", "GPL-2.0-only")], RULES))


def test_an_exception_holds_for_its_package_and_licence_alone_and_goes_when_it_is_not_needed() -> None:
    assert list(wrong([SILENT, FONT], RULES)) == []
    assert list(wrong([SILENT, FONT, component("OFL-1.1")], RULES)) == ["one is under OFL-1.1, which is not allowed"]
    assert list(wrong([SILENT, component("GPL-2.0-only", name="font")], RULES))
    assert list(wrong([SILENT, component("MIT", name="font")], RULES)) == [
        "font is now under MIT: take its exception away"
    ]
    assert list(wrong([SILENT], RULES)) == ["font has an exception and is not there any more"]


def test_a_licence_that_was_found_in_the_files_of_a_package_stands_for_what_it_does_not_say() -> None:
    assert list(wrong([FONT], RULES)) == ["silent has a licence found for it and is not there any more"]
    assert list(wrong([FONT, component("GPL-3.0-only", "MIT", name="silent")], RULES)) == []
    assert list(wrong([FONT, component("MIT", name="silent")], RULES)) == [
        "silent now names MIT itself: take away what was found"
    ]


def test_our_react_is_not_facebooks() -> None:
    assert full_name({"name": "react", "purl": "pkg:npm/%40mosaic/react@0.1.0"}) == "@mosaic/react"
    assert full_name({"name": "react", "purl": "pkg:npm/react@19.3.1"}) == "react"


@pytest.mark.parametrize("project", PROJECTS, ids=lambda project: project.name)
def test_each_distribution_carries_the_text_of_its_licence(project: Path) -> None:
    assert (project / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()
    said = tomllib.loads((project / "pyproject.toml").read_text())["project"]
    assert (said["license"], said["license-files"]) == ("Apache-2.0", ["LICENSE"])


def test_what_is_built_without_the_text_of_its_licence_is_told(tmp_path: Path) -> None:
    for name, inside in (
        ("good-1-py3-none-any.whl", "good-1.dist-info/licenses/LICENSE"),
        ("bad-1-py3-none-any.whl", "bad/LICENSES.py"),
    ):
        with zipfile.ZipFile(tmp_path / name, "w") as wheel:
            wheel.writestr(inside, "text")
    for name, inside in (("good-1.tar.gz", "good-1/LICENSE"), ("bad-1.tar.gz", "bad-1/README.md")):
        with tarfile.open(tmp_path / name, "w:gz") as sources:
            sources.addfile(tarfile.TarInfo(inside))
    (tmp_path / "SHA256SUMS").write_text("")
    assert list(without_text(tmp_path)) == ["bad-1-py3-none-any.whl", "bad-1.tar.gz"]


def test_every_exception_of_ours_has_its_reason() -> None:
    rules = Rules.read()
    assert all(exception["reason"] for exception in rules.exceptions.values())
    assert all(found["where"] for found in rules.found.values())
    assert "x264" in rules.inside["av"]


def installed_components() -> Iterator[dict[str, Any]]:
    """What is locked for robots and servers and is installed here, as a bill of materials would have it, nearly."""
    for name in re.findall(r"^([\w.-]+)==", (LOCKS / "runtime.txt").read_text(), re.MULTILINE):
        try:
            metadata = distribution(name).metadata
        except PackageNotFoundError:
            continue  # for another platform
        classifiers = [one for one in metadata.get_all("Classifier", []) if re.match("License :: .* ::", one)]
        said = metadata.get("License-Expression")
        yield component(*([said] if said else classifiers or [str(metadata.get("License"))]), name=name)


def test_the_licence_of_a_new_dependency_is_looked_at_before_a_release_is_built() -> None:
    rules = Rules.read()
    excepted = rules.exceptions.keys() | rules.found.keys()
    components = [one for one in installed_components() if one["name"] not in excepted]
    assert len(components) > 50
    assert list(wrong(components, replace(rules, exceptions={}, found={}))) == []


def test_what_is_for_development_alone_is_not_said_to_be_shipped() -> None:
    lock = {
        "": {"version": "1"},
        "node_modules/react": {"version": "19"},
        "node_modules/vite": {"version": "8", "dev": True},
        "node_modules/@types/react": {"version": "19", "devOptional": True},
        "packages/app": {"name": "@mosaic/app", "version": "1"},
    }
    refs = ["react@19", "vite@8", "@types/react@19", "@mosaic/app@1"]
    bill = {
        "metadata": {"component": {"bom-ref": "root@1"}},
        "components": [{"bom-ref": ref} for ref in refs],
        "dependencies": [{"ref": "@mosaic/app@1", "dependsOn": ["react@19", "vite@8"]}, {"ref": "vite@8"}],
    }
    left = shipped(bill, lock)
    assert [one["bom-ref"] for one in left["components"]] == ["react@19", "@mosaic/app@1"]
    assert left["dependencies"] == [{"ref": "@mosaic/app@1", "dependsOn": ["react@19"]}]


def test_a_bill_does_not_tell_where_it_was_made() -> None:
    assert FOLDER.sub("", '"url": "file:///home/me/dist/mosaic_core-1.whl"') == '"url": "mosaic_core-1.whl"'


def test_silence_is_never_taken_for_innocence() -> None:
    unknown = json.dumps({"dependencies": [{"name": "one", "skip_reason": "not found"}]})
    for answer in (of_python("dev", "", "no route"), of_python("dev", unknown, ""), of_dashboard("", "405")):
        assert not answer.is_complete
        assert "not checked: no answer" in str(answer)
        assert "no known hole" not in str(answer)
    refused = json.dumps({"message": "request failed", "error": {}})
    assert not of_dashboard(refused, "npm error audit endpoint").is_complete


def test_a_hole_is_told_with_the_version_that_mends_it() -> None:
    hole = {"id": "CVE-1", "fix_versions": ["2"]}
    packages = [{"name": "one", "version": "1", "vulns": [hole]}, {"name": "two", "version": "1", "vulns": []}]
    answer = of_python("dev", json.dumps({"dependencies": packages}), "")
    assert answer.is_complete
    assert answer.holes == ["one 1: CVE-1, mended in 2"]
    assert "no known hole" not in str(answer)
    report = {"metadata": {"dependencies": {"total": 2}}, "vulnerabilities": {"a": {"range": "<2", "severity": "high"}}}
    assert of_dashboard(json.dumps(report), "").holes


def test_only_what_was_looked_at_is_said_to_be_sound() -> None:
    packages = [{"name": "one", "version": "1", "vulns": []}, {"name": "two", "skip_reason": "not found"}]
    said = str(of_python("dev", json.dumps({"dependencies": packages}), ""))
    assert "no known hole in 1 packages" in said
    assert "no answer about 1 packages (two)" in said


def test_a_wheel_beyond_its_budget_is_told_and_a_source_distribution_has_none() -> None:
    budgets = {
        "wheels": {"mosaic_core": 10},
        "any_other_wheel": 5,
        "packages": {"mosaic-widgets": 3},
        "any_other_package": 1,
    }
    files = {
        "mosaic_core-1-py3-none-any.whl": 10,
        "mosaic_sim-1-py3-none-any.whl": 6,
        "mosaic-widgets-1.tgz": 4,
        "mosaic_core-1.tar.gz": 99,
    }
    assert [line.split()[0] for line in too_large(files, budgets)] == [
        "mosaic-widgets-1.tgz",
        "mosaic_sim-1-py3-none-any.whl",
    ]


def test_budgets_are_of_distributions_that_there_are() -> None:
    names = {normal(read(project)["project"]["name"]).replace("-", "_") for project in PROJECTS}
    assert json.loads(BUDGETS.read_text())["wheels"].keys() <= names


def test_the_locked_set_of_a_release_has_its_own_wheels_by_hash(tmp_path: Path) -> None:
    for project in PROJECTS:
        table = read(project)["project"]
        (tmp_path / f"{table['name'].replace('-', '_')}-{table['version']}-py3-none-any.whl").write_bytes(b"wheel")
    assert checksums.main(tmp_path) == 0
    text = (tmp_path / checksums.REQUIREMENTS).read_text()
    for project in PROJECTS:
        table = read(project)["project"]
        name = f"{table['name']}=={table['version']}"
        assert f"{name} \\\n    --hash=sha256:{checksums.hashlib.sha256(b'wheel').hexdigest()}\n" in text
    listed = [line.split("  ")[1] for line in (tmp_path / checksums.SUMS).read_text().splitlines()]
    assert checksums.REQUIREMENTS in listed
    assert len(listed) == len(PROJECTS) + 1


def test_a_release_without_one_of_its_wheels_is_none(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="no wheel of mosaic-core"):
        checksums.main(tmp_path)


CHANGELOG = "# Changelog\n\n## 1.2.0 (2027-01-01)\n\n### Added\n\n- One.\n\n## 1.1.0 (2026-01-01)\n\n- Two.\n"


def test_the_notes_of_a_release_are_its_section_of_the_changelog() -> None:
    assert notes.of("1.2.0", CHANGELOG) == "### Added\n\n- One."
    assert notes.of("1.1.0", CHANGELOG) == "- Two."
    assert notes.of("1.2", CHANGELOG) == ""


def test_a_tag_that_does_not_fit_is_refused_before_anything_is_published() -> None:
    assert list(notes.wrong("v1.2.0", {"mosaic-core": "1.2.0"}, CHANGELOG, [])) == []
    assert "mosaic-core is 1.1.0" in next(notes.wrong("v1.2.0", {"mosaic-core": "1.1.0"}, CHANGELOG, []))
    assert "2 changes" in next(notes.wrong("v1.2.0", {}, CHANGELOG, ["+a.added.md", "+b.fixed.md"]))
    assert "no section of 1.3.0" in next(notes.wrong("v1.3.0", {}, CHANGELOG, []))
