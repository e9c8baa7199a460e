"""Does it pay to steer? Policies against each other as contests.toml says, in pieces that a run can
be ended between: ``python -m studies.active.measure PART …``

    compare     # every policy and set that the journal lacks
    confirm     # the policies chosen, on fresh sets
    confirm_learned  # the learned ones too, a quarter of an hour
    speed       # steps of 64 environments per second
    places      # where to touch next
    learn       # recurrent PPO, a quarter of an hour a seed (sb3-contrib)
    judge store_learned  # the learned policies under the exact observer
    walls       # wall following as a closed loop
    write       # results/active.json of the journal

The others write their own parts of it. What they need beside the library stands in
learning.py, places.py and wall_loop.py.
"""

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from benchmarks.kept import write_kept
from feeler.active import TouchTask, make_learned, parse_policy
from feeler.active.contests import (
    Contest,
    confirm_steering,
    judge_energy,
    judge_learned,
    judge_steering,
    load_contest,
)
from feeler.presets import cockroach
from feeler.provenance import to_json
from feeler.tradeoff import average_sets

ROOT = Path(__file__).parents[2]
STORED = Path(__file__).with_name("results.json")  # for the report
RESULTS = ROOT / "benchmarks" / "results" / "active.json"
JOURNAL = ROOT / "build" / "active.jsonl"  # of one state of the code, so not kept


def keep(**values: object) -> None:
    """Add to the results, and to what the report shows, what was measured."""
    found = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    write_kept(RESULTS, json.dumps(to_json(found | values), indent=1, sort_keys=True) + "\n")
    store()


def compare() -> None:
    """Fill the journal, the cheap policies first."""
    JOURNAL.parent.mkdir(exist_ok=True)
    comparison = load_contest()
    for names in ((*comparison.fixed, *comparison.steered), comparison.ahead):
        began = time.process_time()
        comparison.run(
            cockroach(),
            names,
            journal=JOURNAL,
            progress=lambda *done: print(*done, flush=True),
        )
        print(f"{time.process_time() - began:.0f} s CPU", flush=True)


def write() -> None:
    """What the journal holds, judged."""
    comparison = load_contest()
    measured = comparison.run(cockroach(), journal=JOURNAL)
    verdict, energy = judge_steering(measured, comparison), judge_energy(measured, comparison)
    keep(
        steering=verdict.to_dict(),
        energy=energy,
        measured=measured.to_dict(),
        declared=comparison.to_plain(),
    )
    print(verdict.to_dataframe().to_string())


def meet_again() -> tuple[Contest, xr.Dataset, xr.Dataset]:
    """The contest with the fresh sets, what was chosen before, and how that does on every set."""
    comparison, results = load_contest(), json.loads(RESULTS.read_text())
    verdict = xr.Dataset.from_dict(results["steering"])
    more = comparison.replace(sets=comparison.confirm["first"] + comparison.confirm["sets"])
    names = [
        *dict.fromkeys(
            str(name) for kind in ("fixed", "steered") for name in verdict[kind].values
        )
    ]
    JOURNAL.parent.mkdir(exist_ok=True)
    tell: dict[str, Any] = {
        "journal": JOURNAL,
        "progress": lambda *done: print(*done, flush=True),
    }
    return more, verdict, more.run(cockroach(), names, **tell)


def confirm() -> None:
    """The chosen pairs on fresh sets."""
    comparison, verdict, measured = meet_again()
    found = confirm_steering(measured, verdict, comparison.confirm["first"])
    print(found.to_dataframe().round(2).to_string())
    keep(confirmed=found.to_dict() | {"attrs": {"sets": comparison.confirm["sets"]}})


def confirm_learned() -> None:
    """The learned policies on the same fresh sets, beside the pairs."""
    comparison, verdict, measured = meet_again()
    first, deadlines = comparison.confirm["first"], comparison.confirm["learned"]
    seeds, rows = comparison.learning["seeds"], {}
    found = np.array(
        [run_learned(comparison, number) for number in range(first, comparison.sets)]
    )
    for own, deadline in zip(np.moveaxis(found, 1, 0), deadlines, strict=True):  # (set, seed)
        row = {
            "learned": float(own.mean()),
            "seeds": dict(zip(map(str, seeds), own.mean(axis=0), strict=True)),
        }
        for kind in ("fixed", "steered"):
            name = str(verdict[kind].sel(deadline=deadline).values)
            other = (
                100 * measured["accuracy"].sel(policy=name, deadline=deadline).values[first:]
            )
            gain = average_sets(xr.DataArray(own.mean(axis=1) - other, dims="set"))
            row |= {f"{kind}_gain": float(gain["mean"]), f"{kind}_half": float(gain["half"])}
        rows[f"{deadline:g}"] = row
    print(rows)
    keep(confirmed_learned=rows)


def run_learned(comparison: Contest, number: int) -> list[list[float]]:
    """Right answers [%] on one set, (deadline, seed)."""
    observer = comparison.make_observer(cockroach(), number)
    print("set", number, flush=True)
    return [
        [
            100
            * float(
                observer.run(
                    make_learned(seed, float(d)), comparison.copies, float(d)
                ).accuracy[-1]
            )
            for seed in comparison.learning["seeds"]
        ]
        for d in comparison.confirm["learned"]
    ]


def store() -> None:
    """What the report shows, kept with the package."""
    found = json.loads(RESULTS.read_text())
    kept = {
        name: found[name]
        for name in (
            "measured",
            "learned",
            "confirmed",
            "confirmed_learned",
            "declared",
            "places",
            "wall",
        )
        if name in found
    }
    write_kept(STORED, json.dumps(kept, sort_keys=True) + "\n")


def store_learned() -> None:
    """The learned policies beside the others, and how far practice is off the exact observer
    [points].
    """
    comparison, results = load_contest(), json.loads(RESULTS.read_text())
    found, measured = (
        results["learning"],
        xr.Dataset.from_dict(results["measured"]).map(lambda v: v.astype(float)),
    )
    seeds = comparison.learning["seeds"]
    sets = [
        n
        for n in range(1, comparison.sets, 2)
        if f"practice {n}" in found
        and all(
            len(found.get(f"seed {s} set {n}", {})) == len(comparison.deadlines) for s in seeds
        )
    ]
    runs = [
        [[found[f"seed {s} set {n}"][f"{d:g}"] for d in comparison.deadlines] for n in sets]
        for s in seeds
    ]
    fields = {
        name: (
            ("seed", "set", "deadline"),
            [[[one[name] for one in row] for row in rows] for rows in runs],
        )
        for name in ("accuracy", "hits", "work")
    }
    learned = xr.Dataset(
        fields, {"seed": seeds, "set": [*sets], "deadline": [*comparison.deadlines]}
    )
    practised = np.array(
        [
            [found[f"practice {n}"][p] for n in sets]
            for p in (*comparison.fixed, *comparison.steered)
        ]
    )
    exact = (
        measured["accuracy"]
        .sel(policy=[*comparison.fixed, *comparison.steered])
        .isel(set=[*sets])
    )
    off = 100 * (practised - exact)
    judged = judge_learned(learned, measured, comparison)
    rms = {"fixed": float((off[: len(comparison.fixed)] ** 2).mean() ** 0.5),
           "steered": float((off[len(comparison.fixed) :] ** 2).mean() ** 0.5)}  # fmt: skip
    declared = results["declared"] | {
        "learning": dict(comparison.learning)
    }  # what the policies beside were declared with stays
    practice = {"rms": rms, "mean": float(off.mean())}
    keep(
        learned=learned.to_dict(), judged=judged.to_dict(), practice=practice, declared=declared
    )
    print(judged.to_dataframe().round(2).to_string(), rms)


def speed() -> None:
    """Steps of 64 environments with other speeds at every step, by wall clock and by processor, for
    one and two threads.
    """
    from feeler.active.environment import TouchVectorEnv

    task, rng, n, steps = TouchTask(), np.random.default_rng(0), 64, 600
    found = {}
    for workers in (1, 2):
        envs = TouchVectorEnv(task, n, workers=workers)
        envs.reset(seed=0)
        began, spent = time.perf_counter(), time.process_time()
        for _ in range(steps):
            moves = np.stack([rng.uniform(0, 1.2, n), np.zeros(n)], axis=1)
            envs.step({"action": moves, "prediction": np.zeros((n, task.n_outputs))})
        taken = time.perf_counter() - began, time.process_time() - spent
        found[f"threads {workers}"] = dict(
            zip(("per_second", "per_core_second"), (n * steps / t for t in taken), strict=True)
        )
    keep(speed={"environments": n, "steps": steps} | found)
    print(found)


def places() -> None:
    """How many touches until sure, by who chooses them."""
    from feeler.objects.shapes import Ball, Box
    from studies.active.places import search_places, simulate_places

    asked = load_contest().places
    half_width, half_height, rounding = asked["box"]
    shapes = [
        Ball(radius=asked["ball"]),
        Box(half_width=half_width, half_height=half_height, rounding=rounding),
    ]
    known, found = simulate_places(cockroach(), shapes), {}
    for noise in asked["noise"]:
        for name in ("random", "grid", "greedy"):
            one = search_places(
                known,
                name,
                noise,
                n=asked["n"],
                threshold=asked["threshold"],
                most=asked["most"],
            )
            reached = [
                float((one.sure & (one.count <= k)).mean()) for k in range(1, asked["most"] + 1)
            ]
            used = np.bincount(one.chosen[one.chosen >= 0], minlength=len(known.touches))
            mean, error = one.count.mean(), one.count.std(ddof=1) / np.sqrt(len(one.count))
            found[f"{name} {noise:g}"] = {
                "touches": mean,
                "half": 1.96 * error,
                "right": one.right.mean(),
                "sure": one.sure.mean(),
                "reached": reached,
                "used": used,
            }
            print(
                name,
                noise,
                round(mean, 2),
                round(1.96 * error, 2),
                one.right.mean(),
                one.sure.mean(),
                flush=True,
            )
    keep(places=found, touches=known.touches)


def learn() -> None:
    """Recurrent PPO on what the observer believes, each seed that has no weights yet."""
    from feeler.active.policies import find_weights
    from studies.active.learning import Practice, save_policy, train_policy

    comparison = load_contest()
    asked, antenna = dict(comparison.learning), cockroach()
    seeds, first, n = (asked.pop(name) for name in ("seeds", "first", "practices"))
    practices = [Practice(comparison.make_task(antenna, first + k)) for k in range(n)]
    for seed in seeds:
        if not find_weights(seed).is_file():
            began = time.process_time()
            model = train_policy(practices, comparison.deadlines, seed=seed, **asked)
            save_policy(model, find_weights(seed), {"seed": seed, **comparison.learning})
            keep_learned(f"seed {seed}", seconds=time.process_time() - began)


def keep_learned(name: str, **values: object) -> None:
    """Add to what is kept of the learned policy."""
    found = json.loads(RESULTS.read_text()).get("learning", {})
    keep(learning=found | {name: found.get(name, {}) | values})
    print(name, values, flush=True)


def judge() -> None:
    """The learned policies under the exact observer, on the sets that policies are judged on; and
    practice against it.
    """
    from feeler.active.policies import find_weights
    from studies.active.learning import Practice, practise

    comparison, antenna = load_contest(), cockroach()
    seeds = [seed for seed in comparison.learning["seeds"] if find_weights(seed).is_file()]
    for number in range(1, comparison.sets, 2):
        found = json.loads(RESULTS.read_text()).get("learning", {})
        if all(
            len(found.get(f"seed {seed} set {number}", {})) == len(comparison.deadlines)
            for seed in seeds
        ):
            continue
        task = comparison.make_task(antenna, number)
        observer = comparison.make_observer(antenna, number)
        if f"practice {number}" not in found:
            practice = Practice(task)
            names = [*comparison.fixed, *comparison.steered]
            right = {
                n: [practise(practice, parse_policy(n), d) for d in comparison.deadlines]
                for n in names
            }
            keep_learned(f"practice {number}", **right)
        for deadline in comparison.deadlines:
            for seed in seeds:
                name = f"seed {seed} set {number}"
                if f"{deadline:g}" in found.get(name, {}):
                    continue
                episodes = observer.run(
                    make_learned(seed, deadline), comparison.copies, deadline
                )
                last = {
                    "accuracy": episodes.accuracy[-1],
                    "hits": episodes.hits[-1],
                    "work": episodes.work[-1].mean(),
                }
                last["speed"] = episodes.speed[1:].mean(axis=1)
                keep_learned(name, **{f"{deadline:g}": last})


def walls() -> None:
    """Stability over delay and gain of every profile and speed, gain and phase of the antenna, and
    turns.
    """
    from feeler.wall import calibrate, follow, make_turn
    from studies.active.wall_loop import map_stability, measure_wall_response

    asked = load_contest().wall
    found = json.loads(RESULTS.read_text()).get("wall", {}) if RESULTS.exists() else {}
    engine: dict[str, Any] = {"engine": "chain-consistent", "timestep": 0.1}
    for speed in asked["speeds"]:
        for name in (*asked["profiles"], "told the distance"):
            key = f"{name} {speed:g}"
            if key in found:
                continue
            oracle = name == "told the distance"
            antenna = cockroach("exponential" if oracle else name)
            known = None if oracle else calibrate(antenna, speed=speed, **engine)
            stable = map_stability(
                antenna,
                asked["delays"],
                asked["frequencies"],
                speed=speed,
                known=known,
                oracle=oracle,
            )
            entry = {
                "spread": stable.spread,
                "stable": stable.stable,
                "undefined": known.undefined if known else "",
            }
            if known is not None and not known.undefined:
                ratio = measure_wall_response(antenna, known, asked["response"], speed=speed)
                entry |= {
                    "gain": np.abs(ratio),
                    "phase": np.degrees(np.angle(ratio)),
                    "r2": known.r2,
                }
                for angle in asked["turns"]:
                    run = follow(
                        antenna, make_turn(angle), speed=speed, distance_map=known, **engine
                    )
                    entry[f"turn {angle:g}"] = {"error": run.error, "collided": run.collided}
            found[key] = entry
            keep(wall=found)
            print(key, stable.stable.astype(int).tolist(), flush=True)


if __name__ == "__main__":
    for word in sys.argv[1:] or [
        "compare",
        "speed",
        "places",
        "learn",
        "judge",
        "walls",
        "write",
        "store_learned",
    ]:
        globals()[word]()
