"""``feeler robot``: calibrate, check, convert, fit, classify and stream the recordings of a robotic antenna."""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

EXAMPLES = """Examples:

  feeler robot example .

  feeler robot calibrate surrogate_calibration_table.csv --out calibration.json

  feeler robot classify surrogate_ball_tip_fast.csv --calibration calibration.json

  feeler robot stream surrogate_ball_tip_fast.csv --calibration calibration.json

  feeler robot fit surrogate_release.csv
"""

app = typer.Typer(help="Recordings of a robotic antenna: calibrate, check, convert, fit, classify, stream.",
                  epilog=EXAMPLES, no_args_is_help=True)  # fmt: skip

Files = Annotated[list[Path], typer.Argument(help="CSV recordings: time_ms, hinge1_pF … hinge8_pF (or _deg, _rad)")]
Calibration = Annotated[Path | None, typer.Option(help="sensor calibration (JSON), for capacitance")]
Outside = Annotated[str, typer.Option(help="readings out of the calibrated range: refuse, clip, missing, extend")]
Engine = Annotated[str | None, typer.Option(help="of the simulated touches: chain-consistent, chain or mujoco")]
Timestep = Annotated[float | None, typer.Option(help="of the simulated touches [ms]; default: the engine's own")]
Workers = Annotated[int | None, typer.Option(help="threads; default one per core")]
Gaps = Annotated[str, typer.Option(help="gaps over 10 ms: refuse, bridge, keep")]


@app.command()
def example(folder: Annotated[Path, typer.Argument(help="where to put them")] = Path()) -> None:
    """Copy the example files (made by a surrogate robot) to a folder."""
    from feeler.robot.examples import EXAMPLES, get_example

    folder.mkdir(parents=True, exist_ok=True)
    for name in EXAMPLES:
        source = get_example(name)
        (folder / source.name).write_bytes(source.read_bytes())
        typer.echo(f"{name:12} {folder / source.name}")


@app.command()
def calibrate(
    table: Annotated[Path, typer.Argument(help="CSV: hinge, angle_deg, capacitance_pF, optionally time_ms")],
    out: Annotated[Path, typer.Option(help="where to save the calibration")] = Path("calibration.json"),
) -> None:
    """Fit capacitance to angle, one line per hinge, and say how good it is."""
    from feeler.robot import load_calibration_table, save_calibration

    calibration = load_calibration_table(table)
    typer.echo(calibration.report())
    save_calibration(calibration, out)
    typer.echo(f"saved to {out}" + (f", robot {calibration.robot}" if calibration.robot else ""))


@app.command()
def check(
    recordings: Files, calibration: Calibration = None, outside: Outside = "refuse", gaps: Gaps = "refuse"
) -> None:
    """Say what a recording holds, what is wrong with it and what would be mended."""
    for path, recording in zip(recordings, _read(recordings, calibration, outside, gaps), strict=True):
        typer.echo(f"{path.name}: {recording.n_sensors} channels, {recording.time[-1]:g} ms, source {recording.source}")
        for line in recording.history:
            typer.echo(f"  {line}")


@app.command()
def convert(
    recordings: Files,
    out: Annotated[Path, typer.Option(help="ending .zarr, .nc, .mat or .nwb")],
    calibration: Calibration = None,
    outside: Outside = "refuse",
    gaps: Gaps = "refuse",
    lengths: Annotated[str, typer.Option(help="different durations: refuse, crop, hold")] = "refuse",
) -> None:
    """Write recordings as one set of tactile tensors, in the same form as simulations."""
    from feeler.robot import make_dataset
    from feeler.tensors.formats import save

    dataset = make_dataset(_read(recordings, calibration, outside, gaps), lengths=lengths)
    save(dataset, out)
    typer.echo(f"{dict(dataset.sizes)} saved to {out}")


@app.command()
def fit(
    recording: Annotated[Path, typer.Argument(help="CSV recording that starts at the release")],
    calibration: Calibration = None,
    thickness: Annotated[float | None, typer.Option(help="flexure thickness [mm]")] = None,
    length: Annotated[float | None, typer.Option(help="flexure length [mm]")] = None,
    method: Annotated[str, typer.Option(help="update (fast) or powell (the paper's)")] = "update",
    engine: Engine = None,
    timestep: Timestep = None,
) -> None:
    """Fit the stiffness and damping factors p1 and p2 to a recorded release."""
    from feeler.robot import fit_factors, make_flexures

    read = _read([recording], calibration, "refuse", "refuse")[0]
    result = fit_factors(
        read,
        hinges=make_flexures(**_tell(thickness=thickness, length=length)),
        method=method,
        **_tell(engine=engine, timestep=timestep),
    )
    for name, ringing in (("recording", result.target), ("model", result.reached)):
        typer.echo(
            f"{name:10} {ringing.frequency * 1e3:.3f} Hz damped, damping ratio {ringing.damping_ratio:.4f}, "
            f"a damped cosine explains {ringing.r_squared:.1%}"
        )
    typer.echo(
        f"p1 = {result.stiffness_factor:.4f}, p2 = {result.damping_factor:.4f} ms, error {result.error:.2g}, "
        f"{result.n_evaluations} evaluations (source: {read.source}; the paper's robot: 1.19, 2.06, 0.0009)"
    )


@app.command()
def classify(
    recordings: Files,
    calibration: Calibration = None,
    outside: Outside = "refuse",
    gaps: Gaps = "bridge",
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
) -> None:
    """Train on simulated touches, then name feature, location and speed of each recording."""
    import numpy as np

    from feeler.decoding.transfer import TransferClassifier
    from feeler.robot import align_recordings, make_training, subtract_rest

    read = [subtract_rest(recording) for recording in _read(recordings, calibration, outside, gaps)]
    training = make_training(**_tell(engine=engine, timestep=timestep, workers=workers))
    classifier = TransferClassifier().fit(training.values, training.labels)
    aligned = [align_recordings([recording]).values[0] for recording in read]
    for path, ranked in zip(recordings, classifier.predict_top(np.stack(aligned), 2), strict=True):
        words = "; then ".join(_name(label) for label in ranked)
        typer.echo(f"{path.name}: {words}")


@app.command()
def stream(
    source: Annotated[str, typer.Argument(help="CSV recording, - for standard input, or a serial port with --serial")],
    calibration: Calibration = None,
    serial: Annotated[bool, typer.Option("--serial", help="source is a serial port (extra: robot)")] = False,
    threshold: Annotated[float, typer.Option(help="posterior at which the answer counts as decided")] = 0.9,
    every: Annotated[int, typer.Option(help="print every so many samples after contact")] = 50,
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
) -> None:
    """Decode touches while they happen: one line of numbers per sample, time in ms first or left out."""
    from feeler.decoding.samples import open_serial, read_lines, read_samples
    from feeler.robot import load_calibration, load_recording, make_decoder

    lines = None if calibration is None else load_calibration(calibration)
    decoder = make_decoder(threshold=threshold, **_tell(engine=engine, timestep=timestep, workers=workers))
    if serial or source == "-":
        samples = read_samples(open_serial(source) if serial else read_lines(sys.stdin.buffer), decoder.n_sensors_)
    else:
        recording = load_recording(source)
        samples = zip(recording.time, recording.values.T, strict=True)
        if recording.quantity == "angle":
            lines = None
    _decode(decoder.start(), samples, lines, every)


def _tell(**options: Any) -> dict[str, Any]:
    """What was said on the command line."""
    return {name: value for name, value in options.items() if value is not None}


def _decode(running, samples, lines, every: int) -> None:
    last, state = "waiting", None
    for time, values in samples:
        angle = values if lines is None else lines.slope * values + lines.offset
        state = running.update(angle, time)
        changed = state.state != last
        if changed or (state.since_contact >= 0 and state.since_contact % every == 0 and state.state != "over"):
            label = _name(state.label) if state.label else ""
            typer.echo(f"{state.since_contact:6d} ms  {state.state:8} {state.probability:5.2f}  {label}")
        last = state.state
        if state.state == "over":
            break
    if state is None or state.since_contact < 0:
        typer.echo("no contact")
    elif running.missed:
        typer.echo(f"{running.missed} samples were missing")


def _read(paths, calibration, outside, gaps) -> list:
    from feeler.robot import load_calibration, load_recording, repair

    lines = None if calibration is None else load_calibration(calibration)
    read = []
    for path in paths:
        recording = load_recording(path)
        if recording.quantity == "capacitance":
            recording = recording.to_angles(_require(lines, path), outside=outside)
        read.append(repair(recording, gaps=gaps))
    return read


def _require(lines, path):
    from feeler.errors import InvalidInput

    if lines is None:
        raise InvalidInput(f"{path} holds capacitance: give --calibration, made by `feeler robot calibrate`.")
    return lines


def _name(label: tuple) -> str:
    feature, location, speed = label
    return feature if feature == "no contact" else f"{feature} at {location:g} of the length, {speed:g} m/s"


def register(parent: typer.Typer) -> None:
    """Add ``robot`` with its commands to the command line."""
    parent.add_typer(app, name="robot")
