"""``feeler spikes --recorded``: one's own units, alone or beside the model."""

from typing import Any

import numpy as np
import typer

from feeler.cli.options import say_json
from feeler.errors import InvalidInput
from feeler.files import write_text


def tell_recorded(said: Any) -> None:
    """Rates, intervals, latency and PSTH of recorded units, and how far the model is from them
    (recorded.html, .nc, .csv, psth.csv, recorded.png).
    """
    from feeler.spikes import compare_trains, cut_trains, measure_trains, read_trains
    from feeler.tensors.formats import save

    try:
        trains = read_trains(said.recorded, unit=said.time_unit)
        onsets, words = _find_onsets(said, trains)
    except InvalidInput as error:
        raise InvalidInput(str(error).replace("unit=", "time_unit=")) from None
    touches = model = None
    if said.touches is not None:
        model, touches = _make_model(said)
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
    files = _save(said, drawn, table, beside, words)
    if touches is not None:
        if (said.out / "recorded.nc").exists():
            raise InvalidInput(
                f"{said.out / 'recorded.nc'} exists already. Choose another --out."
            )
        save(drawn, said.out / "recorded.nc")
        files.append("recorded.nc")
    if said.as_json:
        plain: dict[str, Any] = {"trials": drawn.sizes["trial"], "onsets": words}
        plain["units"] = table.to_dict("records")
        if beside is not None:
            plain["model"] = beside.to_dict("records")
        say_json(plain | {"page": said.out / "recorded.html", "files": files})
        return
    typer.echo(
        f"{said.recorded}: {len(table)} unit(s), {drawn.sizes['trial']} trial(s), {words}"
    )
    typer.echo(table.round(3).to_string(index=False))
    if beside is not None:
        typer.echo("beside the model (van Rossum's distance, one spike more or less is 1):")
        typer.echo(beside.round(3).to_string(index=False))
    typer.echo(f"wrote {said.out}/{', '.join(files)}")


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


def _make_model(said: Any) -> tuple[Any, Any]:
    """The model's spikes of the touches, and the touches."""
    from feeler.cli.spikes import _make_touches, _place
    from feeler.spikes import Firing, draw_spikes

    touches = _make_touches(said)
    firing = Firing(order=said.order, refractory=said.refractory, spread=said.spread)
    return draw_spikes(_place(said, touches).encode(touches), firing, seed=said.seed), touches


def _save(said: Any, drawn: Any, table: Any, beside: Any, words: str) -> list[str]:
    """Page, pictures and tables."""
    from feeler.plotting.results import plot_psth
    from feeler.report import Section, write_page
    from feeler.spikes import compute_psth

    span = float(drawn["time"][-1] - drawn["time"][0])
    psth = compute_psth(drawn, 10.0 if span < 5000 else span / 200)
    write_text(said.out / "recorded.csv", table.to_csv(index=False))
    write_text(said.out / "psth.csv", psth.to_series().rename("rate_hz").to_csv())
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
