"""``feeler active``: how to move an antenna in order to know what it touches.

Examples:

  feeler active --out out/active

  feeler active --out out/mine --policy fixed:0.3 --policy slow-after-contact:1.2,0.12 --policy \
mine.py:policy --sets 2

A policy is a rule for moving: fixed:SPEED, fast-then-slow:FAST,SLOW,AFTER, \
slow-after-contact:FAST,SLOW, random:SEED, greedy:HOLD
(speeds in m/s, times in ms), or file.py:function, where the function gets \
what is known so far and returns
the speed. After Ctrl-C the same command goes on where it stopped.
"""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.options import Json, report_interrupt, say, try_movie
from feeler.progress import ProgressBar


def active(
    out: Annotated[Path, typer.Option(help="folder for page, figure, movies, CSV and JSON")],
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help="rule for moving, as in the examples, more than once; default: all but greedy"
        ),
    ] = None,
    antenna: Annotated[str, typer.Option(help="preset or antenna file (TOML)")] = "exponential",
    sets: Annotated[int, typer.Option(min=1, help="how often the touches are drawn")] = 2,
    copies: Annotated[
        int, typer.Option(min=1, help="how often each touch is repeated, with other noise")
    ] = 4,
    noise: Annotated[
        str,
        typer.Option(
            help="of the sensors: common:SIZE [rad], or relative:SIZE (share of a peak)"
        ),
    ] = "common:0.03",
    movie: Annotated[
        bool, typer.Option(help="write a movie of the first and the last policy")
    ] = True,
    log_json: Annotated[
        bool, typer.Option("--log-json", help="progress as JSON on stderr")
    ] = False,
    as_json: Json = False,
) -> None:
    """Compare rules for moving an antenna.

    How often an ideal observer classifies the object correctly by each deadline, the work, and
    what steering gains.
    """
    from feeler.active.contests import load_contest, write_active
    from feeler.active.policies import film_policy, parse_policy, write_film
    from feeler.cli.choose import choose_antenna
    from feeler.provenance import describe_versions

    contest = load_contest(sets=sets, copies=copies, noise=noise)
    names = policy or [*contest.fixed, *contest.steered]
    chosen = choose_antenna(antenna)
    for name in names:
        parse_policy(name)  # a wrong name leaves no folder
    out.mkdir(parents=True, exist_ok=True)
    journal = out / "policies.jsonl"
    with (
        ProgressBar("policies and sets", log_json=log_json) as progress,
        report_interrupt(f"finished sets are in {journal}"),
    ):
        measured = contest.run(chosen, names, journal=journal, progress=progress)
    films: dict[str, Path] = {}
    if movie:
        observer = contest.make_observer(chosen, 0)
        for number, name in enumerate(dict.fromkeys((names[0], names[-1]))):
            write = partial(write_film, film_policy(observer, parse_policy(name)))
            film = try_movie(write, out / f"policy{number + 1}.mp4")
            films |= {} if film is None else {name: film}
    often = "once" if copies == 1 else f"{copies} times"
    conditions = (
        f"{sets} set{'s' * (sets > 1)} of {contest.known} touches, each felt {often}, noise"
        f" {noise}. {describe_versions()}"
    )
    page = write_active(measured, contest, out, films, conditions)
    say(as_json, {**measured.to_dict(), "page": page}, [f"page: {page}"])
