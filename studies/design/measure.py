"""Which antenna should I build? Splines against the paper's profile, far starts of its family,
sensors.

    python -m studies.design.measure --journals build/design [spline family final …]

All choices stand in declared.toml and below, written down before any final draw was looked
at. Each part goes on from its journals; what is finished stands in benchmarks/results/design.json,
which docs and report quote.

**spline**: five optimiser seeds from the paper's profile (5 knots of stiffness, 3 of damping).
**family**: the exponential family (2 and 2 knots, span 300) from five far starts, under a
constraint that does not know the paper's antenna: each of the first six modes has a damping ratio
of at least 0.5. Twice: relative noise 1.0 of peak, and common noise 0.03 rad (there with a peak
angle of at most 0.12 rad, or else the floppiest wins). **final**: the paper's profile and the five
splines, on the final draws (12 test touches of each class), at 0.6, 0.3 and 0.06 m/s. Held: at each
speed the mean over the seeds of 1 − errors/errors of the paper's is ≥ 0.30 and its 95 % interval
over the seeds (Student's t) excludes 0. Anything else is reported as not held. **sensors**: the
fewest of the 56 sensors that keep 95 % of
the bits (test draws), by rule, for the paper's profile, its controls and the spline that is best on
the test draws.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit

from benchmarks.kept import write_kept
from feeler.design import (
    CHOICES,
    Constraints,
    Space,
    choose_sensors,
    load_plan,
    measure_sensors,
    optimise,
    score,
)
from feeler.presets import cockroach

HERE = Path(__file__).parent
PLAN = load_plan(HERE / "declared.toml")
RESULTS = HERE.parents[1] / "benchmarks" / "results" / "design.json"
STORED = HERE / "results.json"  # what the report draws, with fewer digits
SPEEDS = (0.6, 0.3, 0.06)
SEEDS = range(5)
COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 56)
FAMILY = Space(reference=PLAN.reference, stiffness=2, damping=2, span=300.0)
FAMILIES = {
    "relative": (PLAN.task, Constraints(damping_ratio=0.5)),
    "common": (
        PLAN.task.replace(noise="common:0.03"),
        Constraints(damping_ratio=0.5, peak_angle=0.12),
    ),
}
FINAL = PLAN.task.replace(speeds=SPEEDS, test=12)


def describe(found, space) -> dict:
    x = found.best.x
    design = space.build(x).antenna
    return {
        "x": x.tolist(),
        "bits": found.best.bits,
        "errors": found.best.errors,
        "peak": found.best.peak,
        "counts": found.counts,
        "seconds": found.seconds,
        "history": [list(row) for row in found.history],
        "stiffness": design.stiffness.tolist(),
        "damping": design.damping.tolist(),
    }


def run_spline(journals: Path) -> dict:
    made = {}
    for seed in SEEDS:
        found = optimise(
            PLAN.task,
            PLAN.space,
            PLAN.constraints,
            **(PLAN.search | {"seed": seed}),
            journal=journals / f"spline{seed}",
            workers=1,
        )[0]
        made[str(seed)] = describe(found, PLAN.space)
        print(
            "spline",
            seed,
            f"{found.best.bits:.3f} bits, errors {found.best.errors:.4f}",
            found.counts,
            flush=True,
        )
    return made


def run_family(journals: Path) -> dict:
    made: dict[str, Any] = {}
    for noise, (task, constraints) in FAMILIES.items():
        reference = score(PLAN.reference, task, "optimiser", workers=1)
        made[noise] = {
            "paper": {"bits": reference.bits, "errors": reference.errors},
            "starts": [],
        }
        for seed in SEEDS:
            found = optimise(
                task,
                FAMILY,
                constraints,
                evaluations=100,
                seed=seed,
                far=True,
                journal=journals / f"family_{noise}",
                workers=1,
            )[0]
            design, n = FAMILY.build(found.best.x).antenna, PLAN.reference.n_segments - 1
            p = [
                design.stiffness[0],
                design.damping[0],
                *(np.log(v[-1] / v[0]) / n for v in (design.stiffness, design.damping)),
            ]
            start, held = (
                FAMILY.build(found.start).antenna,
                score(design, task, "test", workers=1),
            )
            row = describe(found, FAMILY) | {
                "p": [float(v) for v in p],
                "test_bits": held.bits,
                "test_errors": held.errors,
            }
            row["start_rate"] = float(np.log(start.stiffness[-1] / start.stiffness[0]) / n)
            made[noise]["starts"].append(row)
            print(
                noise,
                seed,
                f"{found.best.bits:.3f} bits",
                np.round(p, 4),
                found.counts,
                flush=True,
            )
    return made


def run_final(journals: Path) -> dict:
    known = load("spline")
    paper = score(PLAN.reference, FINAL, "final", workers=1)
    found: dict[str, Any] = {
        "paper": {
            "errors": paper.by_speed[:, 1].tolist(),
            "bits": paper.by_speed[:, 0].tolist(),
        },
        "seeds": {},
    }
    for seed, one in known.items():
        mine = score(PLAN.space.build(np.array(one["x"])).antenna, FINAL, "final", workers=1)
        gain = (paper.wrong - mine.wrong).mean(axis=1)  # (speed, touch)
        found["seeds"][seed] = {
            "errors": mine.by_speed[:, 1].tolist(),
            "bits": mine.by_speed[:, 0].tolist(),
            "gain": gain.mean(axis=1).tolist(),
            "gain_error": (gain.std(axis=1, ddof=1) / np.sqrt(gain.shape[1])).tolist(),
        }
        print(
            "final",
            seed,
            np.round(mine.by_speed[:, 1], 4),
            "paper",
            np.round(paper.by_speed[:, 1], 4),
            flush=True,
        )
    fewer = (
        1 - np.array([one["errors"] for one in found["seeds"].values()]) / paper.by_speed[:, 1]
    )
    mean, count = fewer.mean(axis=0), len(fewer)
    half = stdtrit(count - 1, 0.975) * fewer.std(axis=0, ddof=1) / np.sqrt(count)
    found |= {"speeds": list(SPEEDS), "fewer": mean.tolist(), "half": half.tolist()}
    found["held"] = bool(np.all((mean >= 0.3) & (mean - half > 0)))
    return found


def run_sensors(journals: Path) -> dict:
    chosen = {name: cockroach(name) for name in ("exponential", "linear", "uniform", "matched")}
    splines = [PLAN.space.build(np.array(one["x"])).antenna for one in load("spline").values()]
    told = [score(one, PLAN.task, "test", workers=1).bits for one in splines]
    chosen["spline"] = splines[int(np.argmax(told))]
    made: dict = {"spline_test_bits": told}
    for name, antenna in chosen.items():
        made[name] = {}
        for choice in CHOICES:
            bits = measure_sensors(antenna, PLAN.task, list(COUNTS), choice)
            enough = [n for n, b in zip(COUNTS, bits, strict=True) if b >= 0.95 * bits[-1]]
            made[name][choice] = {"bits": bits.tolist(), "fewest": enough[0]}
        made[name]["hinges"] = choose_sensors(
            antenna, PLAN.task, made[name]["d-optimal"]["fewest"]
        ).tolist()
        print(
            name,
            {c: made[name][c]["fewest"] for c in CHOICES},
            made[name]["hinges"],
            flush=True,
        )
    return made | {"counts": list(COUNTS)}


def list_values(known: dict) -> dict:
    """The numbers that docs/guide/design.md quotes."""
    found: dict[str, Any] = {}
    if final := known.get("final"):
        mean = np.mean([one["errors"] for one in final["seeds"].values()], axis=0)
        for k, speed in enumerate(SPEEDS):
            row = {
                "paper": final["paper"]["errors"][k],
                "splines": mean[k],
                "fewer": final["fewer"][k],
                "half": final["half"][k],
            }
            found |= {f"{name}.{speed:g}": 100 * float(value) for name, value in row.items()}
    for noise, family in known.get("family", {}).items():
        found[f"family.{noise}.paper"] = family["paper"]["bits"]
        found[f"family.{noise}.starts"] = len(family["starts"])
        for name, pick in (
            ("bits", lambda one: one["bits"]),
            ("rate", lambda one: one["p"][2]),
        ):
            values = [pick(one) for one in family["starts"]]
            found |= {
                f"family.{noise}.{name}.least": min(values),
                f"family.{noise}.{name}.most": max(values),
            }
        stiffness = PLAN.reference.stiffness
        found["family.rate"] = float(
            np.log(stiffness[-1] / stiffness[0]) / (len(stiffness) - 1)
        )
        found[f"family.{noise}.rate.best"] = max(family["starts"], key=lambda one: one["bits"])[
            "p"
        ][2]
    for name in ("exponential", "linear", "uniform", "matched", "spline"):
        if "sensors" in known:
            found |= {
                f"sensors.{name}.{choice}": known["sensors"][name][choice]["fewest"]
                for choice in CHOICES
            }
    return found


def keep(known: dict) -> None:
    known = known | {"values": list_values(known)}
    write_kept(RESULTS, json.dumps(known, sort_keys=True) + "\n")
    lean = json.loads(json.dumps(known), parse_float=lambda text: float(f"{float(text):.5g}"))
    write_kept(STORED, json.dumps(lean, sort_keys=True) + "\n")


def load(name: str) -> dict:
    return json.loads(RESULTS.read_text())[name]


PARTS = {
    "spline": run_spline,
    "family": run_family,
    "final": run_final,
    "sensors": run_sensors,
}


def main() -> None:
    asked = argparse.ArgumentParser()
    asked.add_argument("parts", nargs="*", default=list(PARTS))
    asked.add_argument("--journals", type=Path, default=Path("build/design"))
    given = asked.parse_args()
    given.journals.mkdir(parents=True, exist_ok=True)
    for name in given.parts:
        known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
        keep(known | {name: PARTS[name](given.journals)})


if __name__ == "__main__":
    main()
