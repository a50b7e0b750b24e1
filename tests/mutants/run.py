"""Changes one thing in a module and asks its tests whether they notice.

``mutants.toml`` says which modules and which tests, ``equivalent.toml`` which changes no test can notice, and why.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import random
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TextIO

from collected import Collected, tried, with_collected
from equivalents import Equivalents
from mutant_results import SAMPLE, digest, note
from mutation import ROOT, Mutant, Name, mutants_of
from new_code import changes_functions, functions_of, swapped
from trial import Limits, Trial, forked, limits_after, module_name, preload

HERE = Path(__file__).parent
ALIVE = HERE / ".alive.json"
ELSEWHERE = SAMPLE
ENOUGH = 0.85
"""The share of a random sample elsewhere that tests must notice."""

MutantsByModule = Mapping[str, list[Mutant]]


@dataclass(slots=True)
class Found:
    """What became of one module's mutants."""

    module: str
    counts: Counter[str] = field(default_factory=Counter)
    alive: list[Mutant] = field(default_factory=list)


def main(words: list[str]) -> int:
    options = _options(words)
    settings = tomllib.loads((HERE / "mutants.toml").read_text())
    table: dict[str, dict[str, list[str]]] = settings["parts"] | {ELSEWHERE: settings[ELSEWHERE]}
    if unknown := [part for part in options.parts if part not in table]:
        print(f"no part {', '.join(unknown)} in mutants.toml; there are: {', '.join(table)}")
        return 2
    parts = options.parts or ([ELSEWHERE] if options.sample else list(settings["parts"]))
    tests_of = {module: tests for part in parts for module, tests in table[part].items() if options.module in module}
    chosen = _chosen({module: mutants_of(module, settings["operators"]) for module in tests_of}, options)
    if options.list:
        for module, mutants in chosen.items():
            print(f"{module}: {len(mutants)}", *map(_shown, mutants), sep="\n")
        return 0
    equivalents = Equivalents.read(HERE / "equivalent.toml")
    is_whole = not (options.sample or options.again)
    guarded = {module for part in settings["parts"].values() for module in part} if is_whole else set()
    digests = {module: digest((ROOT / module).read_text()) for module in chosen if module in guarded}
    found = [_judged(module, tests_of[module], mutants, equivalents, digests) for module, mutants in chosen.items()]
    _remember(found)
    if parts == [ELSEWHERE] and options.sample and not options.module:
        note(SAMPLE, **_numbers(found), seed=options.seed)
    stale = equivalents.stale(one.module for one in found) if is_whole else []
    return _report(found, stale, enough=ENOUGH if options.sample else 1.0)


def _options(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="nox -s mutants --", description=__doc__)
    parser.add_argument("parts", nargs="*", help="parts of mutants.toml; all but `elsewhere` if none is named")
    parser.add_argument("--sample", type=int, default=0, metavar="N", help="N mutants drawn at random, of `elsewhere`")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws another sample")
    parser.add_argument("--module", default="", metavar="WORD", help="only modules with this word in their path")
    parser.add_argument("--again", action="store_true", help="only those that were alive in the last run")
    parser.add_argument("--list", action="store_true", help="print the mutants and run nothing")
    return parser.parse_args(words)


def _chosen(mutants: MutantsByModule, options: argparse.Namespace) -> MutantsByModule:
    if options.again:
        names = {tuple(name) for of_module in _remembered().values() for name in of_module}
    elif options.sample:
        everything = sorted({mutant.name for of_module in mutants.values() for mutant in of_module})
        names = set(random.Random(options.seed).sample(everything, min(options.sample, len(everything))))
        print(f"{len(names)} of {len(everything)} mutants, seed {options.seed}")
    else:
        return mutants
    chosen = {module: [one for one in of_module if one.name in names] for module, of_module in mutants.items()}
    return {module: of_module for module, of_module in chosen.items() if of_module}


def _judged(
    module: str, tests: list[str], mutants: list[Mutant], equivalents: Equivalents, digests: Mapping[str, str]
) -> Found:
    """Its result is written at once where it has a digest: a run that is cut short leaves what it has found."""
    print(f"\n{module}: {len(mutants)} mutants", flush=True)
    found, start_s = Found(module), time.monotonic()
    for place, (mutant, trial) in enumerate(_trials(module, tests, mutants)):
        verdict: str = trial.verdict
        if verdict == "alive" and equivalents.excuses(mutant):
            verdict = "equivalent"
        found.counts[verdict] += 1
        if verdict in ("alive", "unreached"):
            found.alive.append(mutant)
            print(_shown(mutant), flush=True)
        elif sys.stdout.isatty():
            print(f"  {place + 1}/{len(mutants)}", end="\r", flush=True)
    print(f"  {dict(found.counts)} in {time.monotonic() - start_s:.0f} s", flush=True)
    if module in digests:
        note(module, **_numbers([found]), digest=digests[module])
    return found


def _shown(mutant: Mutant) -> str:
    return f"  {mutant.line} {mutant.function}\n    - {mutant.original}\n    + {mutant.mutated}"


def _trials(module: str, tests: list[str], mutants: list[Mutant]) -> Iterator[tuple[Mutant, Trial]]:
    """What lives with new code in the functions that are there is tried once more in a process that imports it: a
    function may be called while its module is imported."""
    lived = []
    for mutant, trial in _trials_in_child(module, tests, mutants, swaps=True):
        if trial.verdict in ("alive", "unreached"):
            lived.append(mutant)
        else:
            yield mutant, trial
    if lived:
        yield from _trials_in_child(module, tests, lived, swaps=False)


def _trials_in_child(
    module: str, tests: list[str], mutants: list[Mutant], *, swaps: bool
) -> Iterator[tuple[Mutant, Trial]]:
    """In a process of its own, because what it imports before it forks differs from module to module."""
    reading, writing = os.pipe()
    with forked() as is_child:
        if is_child:
            os.close(reading)
            with os.fdopen(writing, "w") as answers:
                _try_here(module, tests, mutants, answers, swaps=swaps)
            return
        os.close(writing)
        with os.fdopen(reading) as answers:
            for line in answers:
                place, told = json.loads(line)
                yield mutants[place], Trial(**told)


def _try_here(module: str, tests: list[str], mutants: list[Mutant], answers: TextIO, *, swaps: bool) -> None:
    """First, in processes that import it anew, what changes a module as it is imported, then what changes functions;
    without ``swaps`` all of it is imported."""
    path, name = ROOT / module, module_name(module)
    original = path.read_text()

    def answer(mutant: Mutant, trial: Trial) -> None:
        told = asdict(trial) | {"output": "", "imports": [], "durations_s": {}}
        print(json.dumps([mutants.index(mutant), told]), file=answers, flush=True)

    of_functions = [one for one in mutants if swaps and changes_functions(path, original, one.source)]
    others = [mutant for mutant in mutants if mutant not in of_functions]
    baseline = tried(path, name, original, tests, Limits())
    if baseline.verdict != "alive":
        print(f"{module}: {baseline.verdict} without a mutant, by {' '.join(tests)}\n{baseline.output}")
        raise SystemExit
    preload(baseline.imports)
    limits = limits_after(baseline)
    for mutant in others:
        answer(mutant, tried(path, name, mutant.source, tests, limits))

    def try_functions(collected: Collected) -> None:
        collected.tried([], limits)
        live = functions_of(path)
        gc.freeze()
        for mutant in of_functions:
            codes = swapped(path, live, original, mutant.source)
            answer(mutant, collected.tried(codes, limits) if codes else Trial("unreached", 0.0, 0.0, ""))

    if of_functions and (trouble := with_collected(tests, try_functions)):
        print(trouble)
        raise SystemExit


def _remembered() -> dict[str, list[Name]]:
    return json.loads(ALIVE.read_text()) if ALIVE.exists() else {}


def _remember(found: list[Found]) -> None:
    """For ``--again``."""
    alive = {one.module: [mutant.name for mutant in one.alive] for one in found}
    ALIVE.write_text(json.dumps(_remembered() | alive, indent=1))


def _numbers(found: list[Found]) -> dict[str, int]:
    """In the order of the columns."""
    total = sum(one.counts.total() for one in found)
    equivalent = sum(one.counts["equivalent"] for one in found)
    alive = sum(len(one.alive) for one in found)
    return {"mutants": total, "killed": total - equivalent - alive, "equivalent": equivalent, "alive": alive}


def _report(found: list[Found], stale: list[str], *, enough: float) -> int:
    width = max((len(one.module) for one in found), default=6)
    print(f"\n{'module':{width}}  mutants  killed  equivalent  alive")
    for one in found:
        numbers = _numbers([one])
        print(f"{one.module:{width}}", *(f"{count:{len(word)}}" for word, count in numbers.items()), sep="  ")
    everything = _numbers(found)
    real = everything["mutants"] - everything["equivalent"]
    share = everything["killed"] / real if real else 1.0
    print(f"\n{share:.0%} of {real} mutants are noticed; {everything['equivalent']} more cannot be", *stale, sep="\n")
    return 0 if share >= enough and not stale else 1


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    os.chdir(ROOT)
    sys.exit(main(sys.argv[1:]))
