"""Writes the YAML file of the demo's robot, with one's own connectors beside the simulated ones, which it can find."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from mosaic_core.runtime.configuration.config_env import masked, unmasked
from mosaic_core.testing.distributions import write_distribution
from mosaic_core.words.codes import reason
from mosaic_sim.demo.demo_robot import YARD, DemoRobot
from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.own_plugin import Entry, OwnEntry, OwnPlugin
from mosaic_sim.demo.plugin_process import plugin_process
from mosaic_sim.demo.server import Seed, robot_environment

_NOBODY = Seed("", "", "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11", "nobody")

_HEAD = "\nconnectors:\n"
_MISSING = re.compile(r"(?:No module named|needs) '([\w.]+)'")
_BROKEN = ("config.broken_plugin", "config.broken_local")
_OF_ANY_PLUGIN = tuple(reason(code).cure for code in _BROKEN)
"""For whoever has installed one."""
_INDEX = re.compile(r"^connectors\[(\d+)\]")
_PART = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")


@dataclass(frozen=True, slots=True)
class OwnConnector:
    """One connector of the demo's robot; ``source``: the distribution that it is from."""

    label: str
    type: str
    source: str


@dataclass(frozen=True, slots=True)
class RobotFile:
    """The file of the demo's robot, and where its process finds what the file names."""

    path: Path
    python_path: str = ""
    own: tuple[OwnConnector, ...] = ()
    notes: tuple[str, ...] = ()
    """What was changed in the plugins' own entries, for people."""
    simulated: tuple[OwnConnector, ...] = ()
    """The robot without them."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Of what ``--with`` has brought."""
        return tuple(one.label for one in self.own)

    @property
    def environment(self) -> dict[str, str]:
        """What the robot's process needs beside what every one has, and the server's, which serves its widgets."""
        return {"PYTHONPATH": self.python_path} if self.python_path else {}


def robot_file(
    folder: Path, plugins: Sequence[OwnPlugin], robot: DemoRobot = YARD, *, on_trial: bool = False
) -> RobotFile:
    """Write the file of ``robot`` into ``folder``. With ``plugins`` it is checked: raises :class:`DemoFailed` with what
    is wrong.

    ``on_trial``: connectors get the ``trial`` of their class, which needs no device, instead of the params of their own
    file. Those that no file names get it in any case.
    """
    text = robot.text()
    path = folder / "robot.yaml"
    entries_before = yaml.safe_load(masked(text))["connectors"]
    simulated = tuple(OwnConnector(str(one["label"]), str(one["type"]), robot.distribution) for one in entries_before)
    if not plugins:
        path.write_text(text, "utf-8")
        return RobotFile(path, simulated=simulated)
    python_path = _python_path(folder / "plugins", plugins)
    entries, own, notes = _entries(plugins, [one.label for one in simulated])
    environment = {**robot_environment("http://127.0.0.1", _NOBODY), "PYTHONPATH": python_path}
    with plugin_process(plugins, environment) as process:
        entries, told = _with_trials(entries, process.trials(), on_trial=on_trial)
        path.write_text(_with_entries(text, entries), "utf-8")
        made = RobotFile(path, python_path, own, (*notes, *told), simulated)
        problems = process.problems(path)
    if problems:
        cures = dict.fromkeys(filter(None, (_cure(one, plugins) for one in problems)))
        raise DemoFailed("\n".join(_told(one, made, plugins) for one in problems), "; ".join(cures))
    return made


def _with_entries(text: str, entries: Sequence[Entry]) -> str:
    """Before the simulated ones, so that the page shows them where one looks first."""
    added = unmasked(yaml.safe_dump(entries, sort_keys=False, allow_unicode=True, default_flow_style=False, width=1000))
    lines = "".join(f"  {line}\n" for line in added.splitlines())
    return text.replace(_HEAD, f"{_HEAD}  # What --with has brought.\n{lines}\n", 1)


def _entries(
    plugins: Sequence[OwnPlugin], simulated: Sequence[str]
) -> tuple[list[Entry], tuple[OwnConnector, ...], tuple[str, ...]]:
    """The entries of all plugins, what to tell of them, and whose label was taken."""
    taken = dict.fromkeys(simulated, "the simulated robot")
    entries: list[Entry] = []
    own: list[OwnConnector] = []
    notes: list[str] = []
    for plugin, entry in [(one, its.entry) for one in plugins for its in one.entries]:
        label = _free(entry["label"], taken)
        if label != entry["label"]:
            notes.append(f"the label '{entry['label']}' is taken by {taken[entry['label']]}: '{label}' instead")
        taken[label] = plugin.source
        own.append(OwnConnector(label, entry["type"], plugin.source))
        entries.append({**entry, "label": label})
    return entries, tuple(own), tuple(notes)


def _with_trials(
    entries: Sequence[Entry], trials: Mapping[str, Any], *, on_trial: bool
) -> tuple[list[Entry], tuple[str, ...]]:
    """The entries with the params of their trials, and what to tell of those whose own params give way."""
    made, told = list[Entry](), list[str]()
    for entry in entries:
        trial, is_named = trials.get(entry["type"]), bool(entry.get("params"))
        if trial is None or (is_named and not on_trial):
            made.append(entry)
            continue
        made.append({**entry, "params": trial})
        if is_named and entry["params"] != trial:
            told.append(f"'{entry['label']}' runs with the `trial` of its class instead of the params of its file")
    return made, tuple(told)


def _free(label: str, taken: dict[str, str]) -> str:
    number, free = 1, label
    while free in taken:
        number += 1
        free = f"{label}_{number}"
    return free


def _python_path(folder: Path, plugins: Sequence[OwnPlugin]) -> str:
    """Folders for this demo alone: their metadata stands before that of an installed version, as their code does."""
    for plugin in plugins:
        write_distribution(
            folder, plugin.name, version=plugin.version, modules=plugin.modules, entry_points=plugin.entry_points
        )
    roots = [str(folder), *(str(one.import_from) for one in plugins if one.import_from)]
    return os.pathsep.join([*dict.fromkeys(roots), *filter(None, [os.environ.get("PYTHONPATH")])])


def _told(problem: Mapping[str, Any], made: RobotFile, plugins: Sequence[OwnPlugin]) -> str:
    """By label and place in the plugin's own file instead of that in the robot's, which nobody has written."""
    labels = [*made.labels, *(one.label for one in made.simulated)]
    path, at = str(problem["path"]), f"{problem['file']}:{problem['line']}"
    if problem["file"] == str(made.path):
        at = _own_line(path, [entry for plugin in plugins for entry in plugin.entries])
    path = _INDEX.sub(lambda found: labels[int(found[1])], path)
    return f"{path}: {problem['message']}" + (f" ({at})" if at else "")


def _own_line(path: str, entries: Sequence[OwnEntry]) -> str:
    """They are the first of the robot's file."""
    index = _INDEX.match(path)
    if index is None or int(index[1]) >= len(entries):
        return ""
    below = tuple(int(item) if item else key for key, item in _PART.findall(path[index.end() :]))
    return entries[int(index[1])].line_of(below)


def _cure(problem: Mapping[str, Any], plugins: Sequence[OwnPlugin]) -> str:
    """For whoever writes the plugin, not for whoever has installed it."""
    message, cure = str(problem["message"]), str(problem["cure"])
    plugin = next((one for one in plugins if one.source in message), plugins[0])
    missing = _MISSING.search(message)
    if missing is None or problem["code"] not in _BROKEN:
        return cure if cure not in ("", *_OF_ANY_PLUGIN) else "mend it, and start the demo again"
    if not plugin.modules:
        return f"pip install -e {plugin.path}, which installs the dependencies that its pyproject.toml names"
    if plugin.path.with_name(f"{missing[1]}.py").is_file():
        return f"for the file beside it write `from .{missing[1]} import …`"
    return f"pip install the distribution that has the module {missing[1]}"
