"""``feeler spikes``: what the nerve of an antenna says of a touch.

Examples:

  feeler spikes --feature ball --location 0.7 --speed 0.06

  feeler spikes --touches set.zarr --show 3 --order 4 --refractory 1

  feeler spikes --antenna rat-whisker --feature peg --azimuth 45

  feeler spikes --touches set.zarr --session-start 2026-01-31T10:00:00+01:00 --identifier model-1

  feeler spikes --recorded spikes.csv --onsets contacts.csv         your own units: rates, PSTH

  feeler spikes --recorded phy/ --onsets contacts.csv --touches set.zarr    beside the model

The fourth also writes spikes.nwb, whose table of units pynwb and pynapple read.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.options import Json, as_sentence, require_new, say, say_adapted
from feeler.errors import InvalidInput, require_extra
from feeler.files import write_text


def spikes(
    touches: Annotated[
        Path | None,
        typer.Option(help="store or file of touches; default: one touch, simulated now"),
    ] = None,
    feature: Annotated[
        str, typer.Option(help="object of the touch: ball, box, triangle …")
    ] = "ball",
    size: Annotated[float, typer.Option(help="radius or half-width of the object [mm]")] = 1.53,
    location: Annotated[
        float, typer.Option(help="place of the touch, fraction of the length")
    ] = 0.7,
    speed: Annotated[float, typer.Option(help="speed of the object [m/s]")] = 0.3,
    azimuth: Annotated[
        float,
        typer.Option(
            help="for an antenna in space: side from which it comes [degrees about it]"
        ),
    ] = 0.0,
    side: Annotated[str, typer.Option(help="left or right")] = "left",
    contact: Annotated[
        str, typer.Option(help="smooth, hard or even; smooth:0.05 sets its time constant [ms]")
    ] = "smooth",
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = "exponential",
    sensors: Annotated[
        int | None,
        typer.Option(min=1, help="places of sensilla, evenly; default: those of the sensors"),
    ] = None,
    gain: Annotated[
        float | None, typer.Option(help="stimulus per radian; default: see --rate")
    ] = None,
    rate: Annotated[
        float,
        typer.Option(help="greatest firing rate in the median touch [Hz]; it sets the gain"),
    ] = 400.0,
    recorded: Annotated[
        Path | None,
        typer.Option(
            help="your own spikes: a table (unit, time_s), an NWB file with units, or a folder of"
            " Phy or Kilosort; with --touches, beside the model's"
        ),
    ] = None,
    onsets: Annotated[
        Path | None,
        typer.Option(
            help="with --recorded: table with a column onset_s or onset_ms, when contact began;"
            " default: the trials of an NWB file, else the whole session"
        ),
    ] = None,
    time_unit: Annotated[
        str | None,
        typer.Option(help="with --recorded: s, ms or us, where the file does not say"),
    ] = None,
    before: Annotated[float, typer.Option(help="with --recorded: ms before each onset")] = 50.0,
    after: Annotated[float, typer.Option(help="with --recorded: ms after each onset")] = 400.0,
    order: Annotated[
        int, typer.Option(help="1: Poisson; more: more regular intervals (gamma of that order)")
    ] = 1,
    refractory: Annotated[
        float, typer.Option(help="refractory time after each spike [ms]")
    ] = 0.0,
    spread: Annotated[
        float, typer.Option(help="standard deviation of the delay of a spike [ms]")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="seed of the spikes")] = 0,
    show: Annotated[int, typer.Option(min=0, help="which touch is drawn, from 0")] = 0,
    session_start: Annotated[
        str, typer.Option(help="start of an NWB session, ISO 8601 with time zone")
    ] = "",
    identifier: Annotated[str, typer.Option(help="unique name of the NWB file")] = "",
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("out/spikes"),
    as_json: Json = False,
) -> None:
    """Simulate the spikes of sensilla during a touch.

    Compute the spikes of sensilla along an antenna (spikes.html, spikes.png, spikes.nc; and
    spikes.nwb).
    """
    said = SimpleNamespace(**locals())
    from feeler.tensors.formats import save
    from feeler.tensors.writers import parse_time

    if said.recorded is not None:
        _tell_recorded(said)
        return
    if bool(said.session_start) != bool(said.identifier):
        raise InvalidInput("spikes.nwb needs both --session-start and --identifier.")
    start = parse_time(said.session_start) if said.session_start else None
    if start:
        require_extra("pynwb", "nwb", "writing NWB")
    said.out.mkdir(parents=True, exist_ok=True)
    files = ["spikes.nc", *(["spikes.nwb"] if start else [])]
    for name in files:
        require_new(said.out / name, "--out")
    felt = _make_touches(said)
    if said.show >= felt.sizes["trial"]:
        raise InvalidInput(f"--show is below {felt.sizes['trial']}, the number of touches.")
    drawn, gain = _draw(said, felt)
    save(drawn, said.out / "spikes.nc")
    if start:
        save(drawn, said.out / "spikes.nwb", session_start=start, identifier=said.identifier)
    made_now = said.touches is None and said.contact == "smooth"
    _tell(said, drawn, gain, files, say_adapted(felt) if made_now else "")


def _make_touches(said: SimpleNamespace) -> Any:
    """The touches of a file, or one made now."""
    from feeler.cli.choose import choose_antenna
    from feeler.experiments.tactile import touch
    from feeler.objects.shapes import parse_feature
    from feeler.objects.trials import Trial
    from feeler.tensors.formats import load
    from feeler.tensors.schema import validate

    if said.touches is not None:
        return validate(load(said.touches)).load()
    feature = parse_feature(said.feature, said.size)
    where: dict[str, Any] = {
        "location": said.location,
        "azimuth": said.azimuth,
        "side": said.side,
    }
    trial = Trial(feature=feature, speed=said.speed, **where)
    antenna = choose_antenna(said.antenna)
    duration = trial.lead + antenna.length / said.speed + 100.0
    return touch(antenna, trial, duration=float(round(duration)), contact=said.contact)


def _draw(said: SimpleNamespace, touches: Any) -> tuple[Any, float]:
    """Spikes of sensilla on both sides, in space on four, and their gain, given or found."""
    from feeler.spikes import Firing, draw_spikes, find_gain, place_sensilla

    places = touches["position"].values
    if said.sensors is not None:
        places = np.linspace(places[0], places[-1], said.sensors)
    sensilla = place_sensilla(
        places,
        30.0 if said.gain is None else said.gain,
        around=np.array((0.0, 90.0) if "plane" in touches.dims else (0.0,)),
    )
    if said.gain is None:
        sensilla = find_gain(touches, sensilla, said.rate)
    firing = Firing(order=said.order, refractory=said.refractory, spread=said.spread)
    return draw_spikes(sensilla.encode(touches), firing, seed=said.seed), float(
        sensilla.gain[0]
    )


def _tell(said: SimpleNamespace, drawn: Any, gain: float, files: list[str], note: str) -> None:
    """The page, and what is said in the terminal."""
    from feeler.plotting.results import plot_touch_spikes
    from feeler.report import Section, write_page
    from feeler.tensors.transforms import in_unit

    shown = drawn.isel(trial=said.show)
    times = in_unit(drawn["spike_time"], "ms").values
    counts = np.isfinite(times).sum(axis=(1, 2))
    fired = float(np.isfinite(times).any(axis=2).mean(axis=1).mean())
    best = float(in_unit(drawn["rate"], "Hz").max(("unit", "time")).median())
    lead = float(shown["lead"]) if "lead" in shown.coords else 0.0
    section = Section(
        name="spikes",
        title=f"{shown['feature'].item()} at {shown['location'].item():.2g} L",
        folder=said.out,
        vector=False,
    )
    section.figure(
        "spikes",
        "Angle of every sensor; spikes of every sensillum, each side of the antenna in its"
        " colour; and the mean rate of all. Grey: contact.",
        lambda figure: plot_touch_spikes(
            in_unit(shown["angle"], "deg").values,
            times[said.show],
            in_unit(shown["rate"], "Hz").values,
            in_unit(shown["time"], "ms").values,
            shown["unit_side"].values,
            figure,
            lead,
            shown["unit_around"].values if "unit_around" in shown.coords else None,
        ),
        height=6.5 if "plane" in shown.dims else 5.0,
        numbers={"spike_time": times[said.show], "rate": shown["rate"].values},
    )
    known = {
        "touches": len(counts),
        "units": drawn.sizes["unit"],
        "spikes_per_touch": float(counts.mean()),
        "units_that_fire": fired,
        "greatest_rate": best,
        "gain": gain,
    }
    units = {"greatest_rate": "Hz", "gain": "1/rad", "units_that_fire": "1"}
    section.table(
        ["quantity", "value"],
        [[f"{k.replace('_', ' ')} [{units.get(k, '1')}]", v] for k, v in known.items()],
    )
    section.text(
        "Sensilla after Szczecinski et al. 2021 (doi:10.1088/1748-3190/ac1ced), with the parameters"
        " of the cockroach's tibia; where they sit and how strongly the antenna drives them are"
        " choices."
    )
    if note:
        section.text(as_sentence(note))
    page = said.out / "spikes.html"
    answer = (
        f"{len(counts)} touch{'es' * (len(counts) > 1)}, {drawn.sizes['unit']} units:"
        f" {counts.mean():.0f} spikes a touch, {100 * fired:.0f} % of the units fire,"
        f" greatest rate {best:.0f} Hz"
    )
    write_page(page, "Simulated spikes of a touch", f"{answer}.", section)
    lines = [
        answer,
        *([note] if note else []),
        f"wrote {said.out}/spikes.html, spikes.png, {', '.join(files)}",
    ]
    say(said.as_json, {**known, "unit": units, "page": page, "files": files}, lines)


# One's own units, alone or beside the model.


def _tell_recorded(said: Any) -> None:
    """Rates, intervals, latency and PSTH of recorded units, and how far the model is from them
    (recorded.html, .nc, .csv, psth.csv, recorded.png).
    """
    from feeler.cli.info import name_instead
    from feeler.spikes import (
        compare_trains,
        cut_trains,
        measure_trains,
        read_trains,
    )
    from feeler.tensors.formats import save

    try:
        trains = read_trains(said.recorded, unit=said.time_unit)
        onsets, words = _find_onsets(said, trains)
    except InvalidInput as error:
        said_so = InvalidInput(str(error).replace("unit=", "time_unit="))
        raise name_instead(said.recorded, "spikes") or said_so from None
    touches = model = None
    if said.touches is not None:
        touches = _make_touches(said)
        model = _draw(said, touches)[0]
    how = {"before": said.before, "after": said.after}
    if not len(onsets):
        first, last = (
            float(pick([edge for train in trains.values() for edge in train[k:][:1]]))
            for k, pick in ((0, min), (-1, max))
        )
        onsets, how = [first], {"before": 1.0, "after": last - first + 1.0}
    drawn = cut_trains(trains, onsets, touches=touches, **how)
    table = measure_trains(drawn)
    beside = None if model is None else compare_trains(model, drawn)
    said.out.mkdir(parents=True, exist_ok=True)
    files = _save_recorded(said, drawn, table, beside, words)
    if touches is not None:
        require_new(said.out / "recorded.nc", "--out")
        save(drawn, said.out / "recorded.nc")
        files.append("recorded.nc")
    plain: dict[str, Any] = {
        "trials": drawn.sizes["trial"],
        "onsets": words,
        "units": table.to_dict("records"),
    }
    lines = [
        f"{said.recorded}: {len(table)} unit(s), {drawn.sizes['trial']} trial(s), {words}",
        table.round(3).to_string(index=False),
    ]
    if beside is not None:
        plain["model"] = beside.to_dict("records")
        lines += ["beside the model (van Rossum's distance, one spike more or less is 1):"]
        lines += [beside.round(3).to_string(index=False)]
    plain |= {"page": said.out / "recorded.html", "files": files}
    say(said.as_json, plain, [*lines, f"wrote {said.out}/{', '.join(files)}"])


def _find_onsets(said: Any, trains: dict[str, np.ndarray]) -> tuple[Any, str]:
    """When contact began, and whence that is known."""
    from feeler.spikes import read_onsets

    if said.onsets is not None:
        return read_onsets(said.onsets, unit=said.time_unit), f"contact as {said.onsets} says"
    if said.recorded.is_file() and said.recorded.suffix in (".nwb", ".h5"):
        try:
            return read_onsets(said.recorded), "from the starts of the file's trials"
        except InvalidInput:
            pass
    if said.touches is not None:
        raise InvalidInput("to compare with --touches, --onsets must say when contact began.")
    return [], "the whole session as one, so latency counts from the first spike"


def _save_recorded(said: Any, drawn: Any, table: Any, beside: Any, words: str) -> list[str]:
    """Page, pictures and tables."""
    from feeler.plotting.results import plot_psth
    from feeler.report import Section, write_page
    from feeler.spikes import compute_psth

    span = float(drawn["time"][-1] - drawn["time"][0])
    psth = compute_psth(drawn, 10.0 if span < 5000 else span / 200)
    write_text(said.out / "recorded.csv", table.to_csv(index=False))
    write_text(
        said.out / "psth.csv",
        psth.rename(time="time_ms").to_series().rename("rate_hz").to_csv(),
    )
    section = Section(name="recorded", title="Recorded units", folder=said.out, vector=False)
    section.text(f"{said.recorded.name}: {drawn.sizes['trial']} trial(s), {words}.")
    section.figure(
        "recorded",
        "Spikes of every trial, below one another for each unit, and the rate over all trials;"
        " time 0 is contact.",
        lambda figure: plot_psth(drawn, psth, figure),
        height=4.5,
    )
    section.table([*table.columns], table.to_numpy().tolist(), "Each unit.")
    if beside is not None:
        section.table(
            [*beside.columns],
            beside.to_numpy().tolist(),
            "Beside the model. distance: van Rossum's, one spike more or less is 1; distance_among:"
            " of a recorded trial from the next one.",
        )
        write_text(said.out / "model.csv", beside.to_csv(index=False))
    write_page(
        said.out / "recorded.html", f"Recorded spikes: {said.recorded.name}", words, section
    )
    files = ["recorded.html", "recorded.csv", "psth.csv", "recorded.png"]
    return files + (["model.csv"] if beside is not None else [])
