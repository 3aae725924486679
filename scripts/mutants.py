#!/usr/bin/env python3
"""Breaks the renderer in one place at a time and says which tests notice (verification.md, rung 8).

    python scripts/mutants.py [--only NAME]... [--json FILE] [--scratch DIR]
    python scripts/mutants.py --check

The mutants are in scripts/mutants.toml: a place in a file, and what stands there instead. A build takes minutes and the
tests that kill a mutant take seconds, so all mutants go into one build of a copy of the tree, each behind a switch:

    original  →  if crate::mutant::on(7) { mutated } else { original }

and each run of the tests turns one switch on (by the environment variable TYNDALL_MUTANT). First the same binaries run with
every switch off: all tests that the table names must pass. The tree itself is never written to.

A mutant is killed where a test of its list fails, where a test binary dies or hangs. Those that are marked `equivalent`
change nothing that a test could see, for the reason that stands there, and must survive. Exit code 1 where any
other mutant survives or an equivalent one is killed, 2 where the table does not fit the sources. `--check` only says
whether it fits, in a second: each place is in its file once.

Needs Python 3.11, cargo, and nothing else.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROFILE = "fast"
# Seconds after which a run is taken to hang. The slowest list of tests takes a minute on two busy cores.
TIMEOUT = 900

SWITCH = '''//! Which mutant is on: see scripts/mutants.py.

use std::sync::LazyLock;

static ON: LazyLock<Option<u32>> =
    LazyLock::new(|| std::env::var("TYNDALL_MUTANT").ok().and_then(|n| n.parse().ok()));

/// Whether mutant `number` is on.
#[inline]
pub fn on(number: u32) -> bool {
    *ON == Some(number)
}
'''


class Misfit(Exception):
    """A mutant whose place is not where the table says."""


def fail(message):
    print(f"mutants: {message}", file=sys.stderr)
    sys.exit(2)


@dataclass
class Mutant:
    number: int
    name: str
    file: str
    context: str
    tests: list
    equivalent: str = ""
    # Where the mutated text is in the file, and the two texts.
    begin: int = 0
    end: int = 0
    mutated: str = ""
    # What came of it.
    killed_by: list = field(default_factory=list)
    seconds: float = 0.0

    def locate(self, source):
        """Finds the place: the context, in which ⟦old ⇒ new⟧ stands for old, with any white space for white space."""
        parts = re.fullmatch(r"(.*)⟦(.*) ⇒ ?(.*)⟧(.*)", self.context.strip(), re.DOTALL)
        if not parts:
            raise Misfit(f"{self.name}: `at` has no ⟦old ⇒ new⟧")
        before, old, self.mutated, after = parts.groups()
        words = [r"\s+".join(re.escape(w) for w in re.split(r"\s+", t)) for t in (before, old, after)]
        found = list(re.finditer(f"{words[0]}({words[1]}){words[2]}", source))
        if len(found) != 1:
            raise Misfit(f"{self.name}: its place occurs {len(found)} times in {self.file}, not once")
        self.begin, self.end = found[0].span(1)

    def switched(self, original):
        """The original text with the mutated one beside it. What ends in a semicolon is a statement, else an expression."""
        both = f"if crate::mutant::on({self.number}) {{ {self.mutated} }} else {{ {original} }}"
        return both if original.rstrip().endswith(";") else f"({both})"


def read_table(path):
    table = tomllib.loads(path.read_text())
    groups = table["tests"]
    mutants = []
    for number, row in enumerate(table["mutant"]):
        unknown = set(row) - {"name", "file", "at", "by", "equivalent"}
        if unknown or row["by"] not in groups:
            fail(f"{row.get('name')}: unknown {unknown or row['by']}")
        mutants.append(
            Mutant(number, row["name"], row["file"], row["at"], groups[row["by"]], row.get("equivalent", ""))
        )
    names = [m.name for m in mutants]
    if len(set(names)) != len(names):
        fail("two mutants have one name")
    return mutants


def switch_all(source, begin, end, mutants):
    """The source from `begin` to `end` with all mutants in it, which lie apart or within each other."""
    out, position = [], begin
    while mutants:
        outer, *mutants = mutants
        inner = [m for m in mutants if m.begin < outer.end]
        mutants = mutants[len(inner) :]
        for m in inner:
            if m.end > outer.end:
                fail(f"{m.name} and {outer.name} overlap")
        out += [source[position : outer.begin], outer.switched(switch_all(source, outer.begin, outer.end, inner))]
        position = outer.end
    return "".join(out) + source[position:end]


def mutated_files(mutants):
    """The files that the mutants are in, with all switches, and the switches themselves."""
    by_file, misfits = {}, []
    for m in mutants:
        try:
            m.locate((ROOT / m.file).read_text())
        except (Misfit, OSError) as why:
            misfits.append(str(why))
        by_file.setdefault(m.file, []).append(m)
    if misfits:
        fail("\n".join(misfits))
    files = {"src/mutant.rs": SWITCH}
    for name in {"src/lib.rs", *by_file}:
        source = (ROOT / name).read_text()
        here = sorted(by_file.get(name, []), key=lambda m: (m.begin, -m.end))
        files[name] = switch_all(source, 0, len(source), here)
    files["src/lib.rs"] += "\npub mod mutant;\n"
    return {name: text.encode() for name, text in files.items()}


def copy_tree(scratch, changed):
    """Copies what git knows, or would add, to the scratch directory, with the changed files; keeps what is built there."""
    tree = scratch / "tree"
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, check=True,
    ).stdout.decode().split("\0")
    wanted = {name for name in listed if name and (ROOT / name).is_file()} | set(changed)
    for path in [p for p in tree.rglob("*") if p.is_file() and str(p.relative_to(tree)) not in wanted]:
        path.unlink()
    for name in wanted:
        path, data = tree / name, changed[name] if name in changed else (ROOT / name).read_bytes()
        # What is the same keeps its time, so that cargo builds no more than it has to.
        if not path.exists() or path.read_bytes() != data:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
    # Dependencies may be built already: start from those.
    target = scratch / "target"
    if not target.exists() and (ROOT / "target" / PROFILE / "deps").exists():
        shutil.copytree(ROOT / "target", target, ignore=shutil.ignore_patterns("incremental", "mutants"))
    return tree, target


def build(tree, target, kinds):
    """Builds the test binaries: `lib`, or the name of a file or folder in tests/. Returns their paths."""
    command = ["cargo", "test", "--profile", PROFILE, "--no-run", "--message-format", "json-render-diagnostics"]
    for kind in kinds:
        command += ["--lib"] if kind == "lib" else ["--test", kind]
    environment = dict(os.environ, CARGO_TARGET_DIR=str(target))
    # Not shown unless it fails: the switches leave parentheses and variables that a person would not write.
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        fail(f"the mutated tree does not compile\n{done.stderr}")
    binaries = {}
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message.get("profile", {}).get("test"):
            kind = "lib" if "lib" in message["target"]["kind"] else message["target"]["name"]
            binaries[kind] = message["executable"]
    return binaries


def run(binaries, tree, tests, number=None):
    """Runs the tests of a list, "KIND FILTER" each, until one fails. Returns the names of those that failed."""
    environment = dict(os.environ)
    environment.pop("TYNDALL_MUTANT", None)
    if number is not None:
        environment["TYNDALL_MUTANT"] = str(number)
    for test in tests:
        kind, *filters = test.split()
        try:
            done = subprocess.run(
                [binaries[kind], *filters], cwd=tree, env=environment, capture_output=True, text=True, timeout=TIMEOUT
            )
        except subprocess.TimeoutExpired:
            return [f"{test} (hangs)"]
        if done.returncode != 0:
            failed = re.findall(r"^test (\S+)(?: - should panic)? \.\.\. FAILED", done.stdout, re.MULTILINE)
            return [f"{kind}: {name}" for name in failed] or [f"{test} (dies)"]
        if not re.search(r"test result: ok\. [1-9]\d* passed", done.stdout):
            fail(f"no test is called {test}")
    return []


def verdict(m):
    if m.equivalent:
        return "killed, though equivalent" if m.killed_by else f"equivalent: {m.equivalent}"
    more = f" and {len(m.killed_by) - 2} more" if len(m.killed_by) > 2 else ""
    return ", ".join(m.killed_by[:2]) + more or "SURVIVED"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--only", action="append", metavar="NAME", help="this mutant; can be given again")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results there, too")
    parser.add_argument("--scratch", type=Path, metavar="DIR", help="build there and keep it, to be quick the next time")
    parser.add_argument("--check", action="store_true", help="only say whether the table fits the sources")
    options = parser.parse_args()

    mutants = read_table(ROOT / "scripts" / "mutants.toml")
    chosen = [m for m in mutants if not options.only or m.name in options.only]
    for name in set(options.only or []) - {m.name for m in mutants}:
        fail(f"no mutant is called '{name}'; there are {', '.join(m.name for m in mutants)}")

    if options.check:
        mutated_files(mutants)
        print(f"{len(mutants)} mutants fit the sources")
        return

    scratch = options.scratch or Path(tempfile.mkdtemp(prefix="tyndall-mutants-"))
    try:
        tree, target = copy_tree(scratch, mutated_files(mutants))
        tests = sorted({test for m in chosen for test in m.tests})
        binaries = build(tree, target, sorted({test.split()[0] for test in tests}))
        if failed := run(binaries, tree, tests):
            fail(f"fails without any mutant: {', '.join(failed)}")
        print(f"{len(tests)} groups of tests pass without a mutant; now {len(chosen)} mutants\n")
        for m in chosen:
            start = time.monotonic()
            m.killed_by = run(binaries, tree, m.tests, m.number)
            m.seconds = time.monotonic() - start
            print(f"{m.name:<52} {m.seconds:6.1f} s  {verdict(m)}", flush=True)
    finally:
        if not options.scratch:
            shutil.rmtree(scratch)

    if options.json:
        rows = [
            {"name": m.name, "file": m.file, "killed_by": m.killed_by, "equivalent": m.equivalent, "seconds": m.seconds}
            for m in chosen
        ]
        options.json.write_text(json.dumps(rows, indent=2) + "\n")
    wrong = [m.name for m in chosen if bool(m.killed_by) == bool(m.equivalent)]
    killed = sum(bool(m.killed_by) for m in chosen)
    print(f"\n{killed} of {len(chosen)} killed, {sum(bool(m.equivalent) for m in chosen)} equivalent")
    if wrong:
        print(f"not as they should be: {', '.join(wrong)}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
