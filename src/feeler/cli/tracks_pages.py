"""What ``feeler tracks`` writes: page, table, figure, numbers; contacts; groups of animals."""

import json
from itertools import accumulate
from operator import and_, eq
from pathlib import Path
from typing import Any

import numpy as np
import typer

from feeler.cli.tracks import _list_groups, _list_settings, _pair_counts, _write_mean
from feeler.errors import InvalidInput
from feeler.files import write_text

_SIDES = ("left", "right")
_HEADER = (
    "trial",
    *(f"{side} [°/s] (peaks)" for side in _SIDES),
    "frames bridged (left, right)",
    "frames missing (left, right)",
)


def _list_cells(row: dict[str, Any]) -> list[object]:
    """A trial's row of the page."""
    speeds = [
        "none"
        if mean is None
        else f"{mean:.1f}" + ("" if error is None else f" ± {error:.2g}") + f" ({count})"
        for mean, error, count in zip(
            row["mean_peak"], row["error"], row["n_peaks"], strict=True
        )
    ]
    return [row["file"], *speeds, _pair_counts(row["bridged"]), _pair_counts(row["missing"])]


def _save_pages(
    out: Path,
    names: list[str],
    trials: list,
    result: Any,
    found: dict[str, Any],
    touched: list[Any] | None,
) -> None:
    """tracks.html, .csv (a row for each trial, side and frame), .json, .png and .svg, and
    contacts.csv.
    """
    from matplotlib.figure import Figure

    from feeler.plotting import style
    from feeler.plotting.results import plot_exploration
    from feeler.report import Section, write_page

    out.mkdir(parents=True, exist_ok=True)
    _save_table(out / "tracks.csv", trials, result, found)
    if touched is not None:
        _save_contacts(out, names, touched)
    write_text(out / "tracks.json", json.dumps(found, indent=1) + "\n")
    height = 1.2 + 1.5 * len(trials)

    def draw(figure: Any) -> None:
        plot_exploration(result, figure, names, touched)

    with style():
        draw(figure := Figure(figsize=(6.0, height), layout="constrained"))
        figure.savefig(out / "tracks.svg")
    section = Section(name="tracks", title="Angles and speeds", folder=out, vector=False)
    section.figure(
        "tracks",
        "Left: angle of each antenna to the body. Right: its absolute speed (line) and the peaks"
        " that are averaged (black dots). Grey: contact.",
        draw,
        height=height,
    )
    section.table(
        _HEADER,
        [_list_cells(row) for row in found["trials"]],
        "Mean of the peak speeds ± standard error.",
    )
    for words in _list_groups(found):
        section.text(words.strip())
    section.heading("How it was measured")
    for row in found["trials"]:
        section.text(f"{row['file']}: {'. '.join(_list_settings(row, found['settings']))}.")
    section.table(
        ["setting", "value"],
        [[name, _show(value)] for name, value in found["settings"].items()],
    )
    write_page(
        out / "tracks.html",
        "Antennal movement: " + ", ".join(names),
        _write_mean(found),
        section,
    )
    typer.echo(
        f"wrote {out}/tracks.html, tracks.csv, tracks.json, tracks.png, tracks.svg", err=True
    )


def _show(value: Any) -> str:
    """A setting in words."""
    if isinstance(value, tuple | list):
        return ", ".join(map(str, value))
    return "not given" if value is None else str(value)


def _save_table(path: Path, trials: list, result: Any, found: dict[str, Any]) -> None:
    """A row for each trial, side and frame, with what it was measured with."""
    import pandas as pd

    from feeler.tracking import measure_rhythm

    settings, tables = found["settings"], []
    choice = settings["cutoff"] if isinstance(settings["cutoff"], str) else "given"
    head, abdomen = settings["body"]
    bases = settings["bases"] or (head, head)
    shared = {name: settings[name] for name in ("min_likelihood", "max_gap", "outliers")}
    for row, trial, pair in zip(found["trials"], trials, result.sweeps, strict=True):
        for k, (side, sweeps) in enumerate(zip(_SIDES, pair, strict=True)):
            if not settings["tips"][k]:
                continue
            tip = trial.of(settings["tips"][k])
            touching = np.zeros(trial.n_frames, dtype=int)
            for one in row.get("contacts", ()):
                if one["side"] == side:
                    touching[one["first_frame"] : one["last_frame"] + 1] = 1
            phase = np.full(trial.n_frames, np.nan)
            if 0 < sweeps.frequency * 2 * trial.interval < 0.5:
                phase = measure_rhythm(
                    sweeps.angle, trial.interval, sweeps.frequency
                ).phase.values
            columns = {
                "trial": row["file"],
                "side": side,
                "time_ms": trial.time,
                "angle_deg": np.rad2deg(sweeps.angle),
                "speed_deg_per_s": np.rad2deg(sweeps.speed) * 1e3,
                "frame": np.arange(trial.n_frames),
                "bridged": sweeps.is_bridged.astype(int),
                "tip_x": tip[:, 0],
                "tip_y": tip[:, 1],
                "unit": trial.unit,
                "phase_deg": np.rad2deg(phase),
                "contact": touching,
                "frame_rate": row["frame_rate"],
                "cutoff_hz": row["cutoff"][k],
                "cutoff_choice": choice,
                "tip": settings["tips"][k],
                "base": bases[k] or head,
                "head": head,
                "abdomen": abdomen,
            }
            tables.append(pd.DataFrame(columns | shared | {"feeler": settings["feeler"]}))
    write_text(path, pd.concat(tables).to_csv(index=False, float_format="%.6g", na_rep="nan"))


# Contacts and groups, as the command line asks for them.


def _find_touched(
    said: Any, trials: list, antennae: list[tuple[str, list[str]]]
) -> list[Any] | None:
    """Per trial a table of contacts of ``antennae`` (side, landmarks base to tip); None where
    nothing was asked.
    """
    import pandas as pd

    from feeler.tracking import find_contacts

    if not said.contact:
        if said.within is not None:
            raise InvalidInput("--within is for --contact, which names what is touched.")
        return None
    within = said.within
    if said.contact == "bend":
        if len(antennae[0][1]) < 3:
            raise InvalidInput(
                "--contact bend needs --points, three or more along the antenna."
            )
        within = None if within is None else float(np.deg2rad(within))
    elif within is None:
        raise InvalidInput(
            "--contact needs --within, the greatest distance that counts as contact [px, or mm"
            " with --scale]."
        )
    found = []
    for trial in trials:
        parts = [
            find_contacts(
                trial,
                points,
                _read_target(said, trial.first_pixel),
                within=within,
                max_gap=said.max_gap or 0,
            ).assign(side=side, target=said.contact)
            for side, points in antennae
        ]
        found.append(
            pd.concat([one for one in parts if len(one)] or parts[:1], ignore_index=True)
        )
    return found


def _read_target(said: Any, first: float) -> str | list[tuple[float, float]] | None:
    """A landmark, places as tracks have them whose file has the first pixel at ``first``, or None
    for bending.
    """
    if said.contact == "bend":
        return None
    parts = said.contact.split(",")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        if len(parts) > 1:
            raise InvalidInput(
                f"--contact takes one landmark, or numbers X,Y,X,Y,…; got {said.contact!r}."
            ) from None
        return said.contact
    if len(numbers) % 2 or len(numbers) < 2:
        raise InvalidInput(
            f"--contact takes pairs X,Y of pixels, got {len(numbers)} numbers: {said.contact}."
        )
    places = (np.reshape(numbers, (-1, 2)) - first) / (said.scale or 1.0)
    # load_tracks turns y round unless a plane in space is chosen
    places[:, 1] *= -1.0 if said.origin == "top-left" and said.plane is None else 1.0
    return [(float(x), float(y)) for x, y in places]


def _save_contacts(out: Path, names: list[str], touched: list[Any]) -> None:
    """contacts.csv: a row for each contact."""
    import pandas as pd

    out.mkdir(parents=True, exist_ok=True)
    tables = [one.assign(trial=name) for name, one in zip(names, touched, strict=True)]
    write_text(out / "contacts.csv", pd.concat(tables).to_csv(index=False))
    typer.echo(f"wrote {out}/contacts.csv", err=True)


def _read_sheet(path: Path, files: list[Path]) -> list[tuple[str, str]]:
    """Animal and group of each file, by a table with columns file, animal and group."""
    from feeler.tables import read_table

    sheet = read_table(path, words=("file", "animal", "group"))
    table = {name.lower(): texts.tolist() for name, texts in sheet.words.items()}
    if missing := [name for name in ("file", "group") if name not in table]:
        raise InvalidInput(
            f"--sheet {path} has no column {missing[0]!r}, but"
            f" {', '.join(sheet.columns)}; it needs file and group, and animal where an"
            " animal has several films."
        )
    parts = [Path(name).parts[::-1] for name in table["file"]]
    owners = [
        *zip(table["animal" if "animal" in table else "file"], table["group"], strict=True)
    ]
    rows: list[int] = []
    for file in files:
        mine = file.resolve().parts[::-1]
        same = [sum(accumulate(map(eq, mine, names), and_)) for names in parts]
        found = [k for k, n in enumerate(same) if n and n == max(same)]
        if not found or not all(owners[found[0]]):
            raise InvalidInput(
                f"--sheet {path} names no animal and group for {file}; its files are"
                f" {', '.join(table['file'])}."
            )
        if len(found) > 1 or found[0] in rows:
            raise InvalidInput(
                f"--sheet {path}: which row is that of {file}? Several files or rows are called"
                f" {file.name}; give their folders too."
            )
        rows += found
    return [owners[row] for row in rows]


def _compare_animals(owners: list[tuple[str, str]], result: Any) -> Any:
    """The groups' average maximum angular speeds, an animal's both sides and all films together,
    but not those that lack too many frames for a mean.
    """
    from feeler.tracking import compare_groups

    value = [
        float(np.nanmean(row)) if np.isfinite(row).any() and not few else float("nan")
        for row, few in zip(np.rad2deg(result.mean_peak) * 1e3, result.too_few, strict=True)
    ]
    animals, groups = zip(*owners, strict=True)
    return compare_groups(value, animals, groups)
