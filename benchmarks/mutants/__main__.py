"""``make mutants ROOM=dispersion MINUTES=10``: plant small mistakes, one at a time, and see which
the room's tests notice.

``ROOM=planted``, ``ROOM=hand`` and ``ROOM=fresh`` plant the mistakes of those files, which were
made by hand, and run the tests named there; rates by area follow. ``ROOM=report`` swaps, doubles
and mislabels what the report shows.
"""

import argparse
import shutil
import tempfile
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path

from child import Run, import_packages, run_tests
from draw import Mutant, draw_mutants
from rates import read_first, tabulate, write_rate
from report import judge_report

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BY_HAND = ("planted", "hand", "fresh")
PARTS = {
    "measures": (
        "encoding",
        "entropy sparseness bases",
        "test_measures.py test_sparseness.py test_updates.py test_model.py",
    ),
    "tensors": (
        "tensors",
        "contract scaling quantities posture",
        "test_contract.py test_quantities.py test_posture.py",
    ),
    "paper": (
        "paper",
        "claims verdicts stage findings window",
        (
            "test_claims.py test_findings.py test_section.py test_stage.py test_window.py"
            " test_choices.py"
        ),
    ),
}
"""A part of a room, by a name of its own: the room, its modules, its files of tests."""


def main() -> None:
    """Print each mistake that went unnoticed, and how many did not."""
    said = _parse()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder) / "feeler"
        shutil.copytree(
            ROOT,
            copy,
            ignore=shutil.ignore_patterns(".git", ".venv", "out", "site", ".*_cache"),
        )
        if said.room in BY_HAND:
            _judge_planted(copy, list(_read_list("mistake", said.room)), said.only)
        elif said.room == "report":
            _say_rate("report", *judge_report(copy, said.seed, said.number))
        else:
            _judge_room(copy, said)


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="mutants", description=__doc__)
    parser.add_argument("room")
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--number", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--printed",
        action="store_true",
        help="numbers and units that a person reads, and no others",
    )
    parser.add_argument(
        "--tests", default="", help="files or folders of tests in place of the room's own"
    )
    parser.add_argument(
        "--only", nargs="*", default=[], help="planted mistakes by their names, or files"
    )
    return parser.parse_args()


def _judge_room(copy: Path, said: argparse.Namespace) -> None:
    end = time.monotonic() + 60 * said.minutes
    whole = (said.room, "", "")
    room, modules, files = whole if said.printed else PARTS.get(said.room, whole)
    tests = (
        said.tests.split()
        or [f"tests/{room}/{name}" for name in files.split()]
        or [f"tests/{room}"]
    )
    paths = [
        path
        for path in sorted((copy / "src/feeler" / room).rglob("*.py"))
        if path.stem != "__init__"
    ]
    paths = [
        path.relative_to(copy) for path in paths if not modules or path.stem in modules.split()
    ]
    paths = [path for path in paths if not said.only or path.stem in said.only]
    equal = {(known["file"], known["line"]) for known in _read_list("equivalent")}
    first = _run_first(copy, tests)
    noticed = tried = 0
    for mutant in draw_mutants(copy, paths, said.seed, printed=said.printed):
        if tried == said.number or time.monotonic() > end:
            break
        if (str(mutant.path.relative_to("src/feeler")), mutant.before) in equal:
            continue
        tried += 1
        found = _judge(copy, mutant, tests, first)
        noticed += bool(found.failed)
        if not found.failed:
            print(
                f"UNNOTICED {mutant.path}:{mutant.line}\n  - {mutant.before}\n  + {mutant.after}",
                flush=True,
            )
    _say_rate(said.room, noticed, tried)


def _say_rate(room: str, noticed: int, tried: int) -> None:
    rate, interval = write_rate(noticed, tried)
    print(f"{room}: {rate} noticed (95 %: {interval})")


def _judge_planted(copy: Path, mistakes: list[dict[str, str]], only: list[str]) -> None:
    noticed = {}
    _run_first(copy, ["tests/response/test_measures.py"])
    for mistake in mistakes:
        if (not only or mistake["name"] in only) and "tests" in mistake:
            said = _plant(copy, mistake)
            noticed[mistake["name"]] = bool(said)
            print(f"{mistake['name']}: {said or 'UNNOTICED'}", flush=True)
    if first := read_first(mistakes):
        print(f"\nbefore any law was written for them:\n{tabulate(mistakes, first)}\n\nnow:")
    if all("area" in mistake for mistake in mistakes):
        print(tabulate(mistakes, noticed))
    unnoticed = [name for name, red in noticed.items() if not red]
    raise SystemExit(f"unnoticed: {', '.join(unnoticed)}" if unnoticed else 0)


def _plant(copy: Path, mistake: dict[str, str]) -> str:
    """The test that notices it; empty: none, or the line that it changes is gone."""
    path = Path("src/feeler") / mistake["file"]
    source = (copy / path).read_text(encoding="utf-8")
    if (found := source.count(mistake["before"])) != 1:
        print(f"{mistake['name']}: {path} holds {mistake['before']!r} {found} times")
        return ""
    mutant = Mutant(path, 0, "", "", source.replace(mistake["before"], mistake["after"]))
    return _judge(copy, mutant, mistake["tests"].split(), Run(seconds={"": 0.0})).failed


def _judge(copy: Path, mutant: Mutant, tests: list[str], first: Run) -> Run:
    path = copy / mutant.path
    source = path.read_text(encoding="utf-8")
    path.write_text(mutant.code, encoding="utf-8")
    try:
        return run_tests(
            copy, tests, seconds=first.seconds, limit=60 + 3 * sum(first.seconds.values())
        )
    finally:
        path.write_text(source, encoding="utf-8")


def _run_first(copy: Path, tests: list[str]) -> Run:
    first = run_tests(copy, tests)
    if first.failed:
        raise SystemExit(f"without any mistake: {first.failed} fails")
    import_packages(first.packages)
    return first


def _read_list(kind: str, file: str = "planted") -> Iterator[dict[str, str]]:
    return iter(
        tomllib.loads((HERE / f"{file}.toml").read_text(encoding="utf-8")).get(kind, [])
    )


main()
