"""What a biologist measures: releases from a tracker's file, force against deflection, segments
under the microscope; one antenna fitted to all.
"""

import csv
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from feeler.antenna import Antenna
from feeler.calibration import (
    ForceCurve,
    Measurements,
    Protocol,
    Ratios,
    compute_force,
    fit_measurements,
    fit_traces,
    join_films,
    load_film,
    load_forces,
    load_microscope,
    load_traces,
    make_factors,
    measure_impulse_film,
    predict_release,
)
from feeler.calibration.measurements import make_film
from feeler.calibration.traces import simulate_steps
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.experiments.mechanics import IMPULSE_LEAD, hit, hold
from feeler.physics.equilibrium import compute_point
from feeler.tracking import Tracks

from .small_antenna import make_small

HELD = Protocol(at=10.0, deflection=1.0)
PLANTED = {"stiffness": 1.3, "damping": 0.75}


def write_film(
    path, antenna, *, turn=0.7, gap=(), scale=8.0, noise=0.2, seed=0, size=12.0, held=HELD
):
    """A DeepLabCut table of a release: base, mid and tip of an antenna that points ``turn`` rad
    away from up; ``gap`` frames have an unsure tip.
    """
    rng, time = np.random.default_rng(seed), np.arange(0, 120, 1.0)
    moved = simulate_steps(
        [antenna], held.replace(step_duration=125.0), np.maximum(time - 20.4, 0.0), (0.5, 1.0)
    )[0]
    moved = np.vstack([np.zeros(time.size), moved]) * size
    along, across = (np.array([np.sin(t), -np.cos(t)]) for t in (turn, turn + np.pi / 2))
    rest = np.array([0.0, 0.5, 1.0])[:, None] * antenna.length
    place = 300 + scale * (rest[:, None] * along + moved[..., None] * across)
    place += rng.normal(0, noise, place.shape)
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["scorer", *["D"] * 9])
        table.writerow(["bodyparts", *(name for name in ("base", "mid", "tip") for _ in "xyl")])
        table.writerow(["coords", *["x", "y", "likelihood"] * 3])
        for k in range(time.size):
            cells = [
                (*place[j, k].round(3), 0.1 if j == 2 and k in gap else 0.99) for j in range(3)
            ]
            table.writerow([k, *(cell for three in cells for cell in three)])
    return path


@pytest.mark.further
@pytest.mark.parametrize(("turn", "gap"), [(0.7, (41, 42, 43)), (-2.0, ())])
def test_a_tracked_release_is_the_trace_across_the_antenna(tmp_path, turn, gap):
    """However the film is turned and scaled, the shapes are those of the simulation; gaps are
    marked, and a fit does not use what was filled in.
    """
    antenna = make_small(*PLANTED.values())
    file = write_film(tmp_path / "a.csv", antenna, turn=turn, gap=gap)
    film = load_film(file, ["base", "mid", "tip"], frame_rate=1000)
    np.testing.assert_allclose(film.place, [0, 0.5, 1], atol=5e-3)
    traces = film.make_traces()
    assert traces.bridged.sum() == len(gap) and traces.found
    place, rows = traces.take("a")
    late = [
        0.1 * k - 1 for k in range(40)
    ]  # ms from the release to the last sample that is held
    exact = simulate_steps([antenna] * 40, HELD, traces.time[:90], place, late)
    assert np.abs(rows[:, :90] / rows[-1, 0] - exact).max(axis=(1, 2)).min() < 0.02
    fitted = fit_traces(join_films([film]), make_small(), names=[*PLANTED], protocol=HELD)
    np.testing.assert_allclose(fitted.p, [*PLANTED.values()], rtol=0.05)


@pytest.mark.long
@pytest.mark.parametrize("scale", [None, 8.0])
def test_how_far_it_was_held_aside_is_taken_from_the_film(tmp_path, scale):
    """Without it a large deflection is fitted as a stiffness that changes along the antenna."""
    animal, held = make_small(*PLANTED.values()), HELD.replace(deflection=4.0)
    aside = compute_point(animal, hold(animal, held.at, held.deflection), 1.0)[0]
    file = write_film(tmp_path / "a.csv", animal, held=held, size=aside)
    film = load_film(file, ["base", "mid", "tip"], frame_rate=1000, scale=scale)
    matched = film.match_protocol(make_small(), HELD).deflection
    assert matched == pytest.approx(4.0, rel=0.03)
    tilts = []
    for deflection in (matched, None):
        one = Measurements(releases=(film.make_traces(),), deflection=deflection)
        found = fit_measurements([one], make_small(), protocol=HELD)
        tilts.append(abs(found.p[found.names.index("stiffness_tilt")]))
    assert tilts[0] < 0.05 and tilts[0] < 0.5 * tilts[1]


def test_what_was_filled_in_does_not_count(tmp_path):
    """A table with empty cells gives the fit of the same table with nonsense in those cells marked
    as filled in.
    """
    antenna = make_small(*PLANTED.values())
    time = np.arange(0.0, 80.0)
    rows = simulate_steps([antenna], HELD.replace(step_duration=82.0), time)[0]
    table = np.vstack([time, rows]).T
    table[[30, 31], 1] = np.nan
    np.savetxt(tmp_path / "t.csv", table, "%.6f", ",", header="time_ms,a", comments="")
    traces = load_traces(tmp_path / "t.csv")
    wrong = traces.displacement.copy()
    wrong[traces.bridged] += 0.03
    pair = [fit_traces(one, make_small(), protocol=HELD).p for one in (
        traces, traces.replace(displacement=wrong)
    )]  # fmt: skip
    np.testing.assert_allclose(pair[0], [*PLANTED.values()], rtol=0.01)
    np.testing.assert_allclose(*pair, rtol=1e-3)
    with pytest.raises(InvalidInput, match=r"a is missing from sample 30 to 31.*max_gap=2"):
        load_traces(tmp_path / "t.csv", max_gap=1)


@pytest.mark.parametrize(
    ("name", "frame"), [("tip", 5), ("tip", 22), ("mid", 41), ("base", 90)]
)
def test_a_place_off_its_path_in_one_frame_is_left_out_and_named(tmp_path, name, frame):
    file = write_film(tmp_path / "a.csv", make_small(*PLANTED.values()))
    points = ["base", "mid", "tip"]
    clean = load_film(file, points, frame_rate=1000)
    rows = [line.split(",") for line in file.read_text().splitlines()]
    rows[3 + frame][1 + 3 * points.index(name)] = "900"
    file.write_text("\n".join(map(",".join, rows)))
    with pytest.warns(ModelValidityWarning, match="off their path in a single frame") as said:
        film = load_film(file, points, frame_rate=1000)
    assert f"a: {name} in frame {frame}." in said[0].message.details
    assert np.argwhere(film.bridged).tolist() == [[frame, points.index(name)]]
    np.testing.assert_allclose(film.displacement, clean.displacement, atol=12)
    np.testing.assert_allclose(film.rest, clean.rest, atol=0.5)


@pytest.mark.parametrize(
    ("points", "match"),
    [
        (["base", "tipp"], "no landmark 'tipp'. Did you mean 'tip'"),
        (["tip", "base"], r"tip moves more than base.*Give base,tip"),
        (["base", "tip", "mid"], "points must go from base to tip"),
        (["base", "tip@1.4"], "a fraction of the length, from 0 to 1"),
        ([], "points must name the landmarks"),
    ],
)
def test_points_that_are_no_antenna_are_refused(tmp_path, points, match):
    file = write_film(tmp_path / "a.csv", make_small())
    with pytest.raises(InvalidInput, match=match):
        load_film(file, points, frame_rate=1000)


def test_a_release_that_never_moves_says_so(tmp_path):
    still = write_film(tmp_path / "a.csv", make_small(), size=0.0)
    with pytest.raises(InvalidInput, match="no release is found"):
        load_film(still, ["base", "tip"], frame_rate=1000).make_traces()


@pytest.mark.further
@pytest.mark.parametrize("radii", [(0.2, 0.05), (0.1, 0.1), (0.2, 0.02)])
@pytest.mark.parametrize("at", [21.0, 40.0])
def test_force_and_deflection_are_a_cantilevers(tmp_path, radii, at):
    """Uniform and tapered, loaded at the tip or before it: the modulus comes back within 1 %, from
    any units, with an offset of the load cell, and from either side.
    """
    base, tip = radii
    there = base + (tip - base) * at / 40
    stiffness = 3 * 2000 * np.pi / 4 * base**3 * there / at**3  # N/mm, in closed form
    moved = np.linspace(0, -0.02 * at, 12)
    table = np.stack([1e3 * moved, 1e6 * stiffness * moved + 3.0], axis=1)
    np.savetxt(
        tmp_path / "f.csv", table, "%.8g", ",", header="deflection_um,force (uN)", comments=""
    )
    guess = Antenna.from_beam(
        length=40.0, radius=f"{base} + ({tip - base}) * x", modulus=700.0, density=1.1e-3
    )
    curves = load_forces(tmp_path / "f.csv", at=at)
    table[:, 1] *= -1.0  # the antenna's own force on the load cell; rows are numbered
    rows = np.column_stack([np.arange(12), table])
    header = ",deflection_um,force (uN)"
    np.savetxt(tmp_path / "g.csv", rows, "%.8g", ",", header=header, comments="")
    with pytest.warns(ModelValidityWarning, match="taken with the opposite sign"):
        (own,) = load_forces(tmp_path / "g.csv", at=at)
    np.testing.assert_allclose(own.force, curves[0].force)
    found = fit_measurements([Measurements(forces=curves)], guess)
    assert 700 * found.p[0] == pytest.approx(2000, rel=0.01)
    assert found.names == ("stiffness",) and "release" in found.held["damping"]


@pytest.mark.further
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_loads_at_several_places_keep_their_signs(tmp_path, sign):
    """Nearer to the base less way takes more force, so that over all places forces fall with the
    deflection though within each they rise; the stiffness is that of the closed form.
    """
    guess = Antenna.from_beam(length=40.0, radius=0.1, modulus=700.0, density=1.1e-3)
    rows = [
        (at, moved, sign * 3 * 2000 * np.pi / 4 * 1e-4 * moved / at**3)
        for at in (10.0, 20.0, 38.0)
        for moved in np.linspace(0, 2e-4 * at**2, 8)
    ]
    assert sign * np.cov(np.transpose(rows)[1:])[0, 1] < 0
    np.savetxt(
        tmp_path / "f.csv", rows, "%.9g", ",", header="at_mm,deflection_mm,force_N", comments=""
    )
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        curves = load_forces(tmp_path / "f.csv")
    assert ["opposite sign" in str(one.message) for one in said] == [True] * (sign < 0)
    found = fit_measurements([Measurements(forces=curves)], guess)
    assert 700 * found.p[0] == pytest.approx(2000, rel=0.01)
    assert found.p[1] == pytest.approx(0, abs=0.02)  # no tilt


@pytest.mark.parametrize("zero", [0.0, 0.4, pytest.param(-0.7, marks=pytest.mark.long)])
def test_deflections_with_another_zero_give_the_same_stiffness_and_say_so(zero):
    antenna = Antenna.from_beam(
        length=20.0, radius=0.2, modulus=1000.0, density=1e-3, n_segments=8, damping_time=1.0
    )
    moved = np.linspace(0.0, 3.0, 8)
    force = 1.4 * compute_force(antenna, moved, 8.0)
    curve = ForceCurve(deflection=moved + zero, force=force, at=8.0)
    fit = fit_measurements([Measurements(forces=(curve,))], antenna)
    assert fit.p[0] == pytest.approx(1.4, rel=1e-3)
    assert [z for z, _ in fit.zero.values()] == pytest.approx([zero] if zero else [], rel=1e-3)
    assert all(0 < half < 0.5 for _, half in fit.zero.values())
    assert ("neither begin nor end at 0" in " ".join(fit.describe())) is (zero != 0)


@pytest.mark.further
@pytest.mark.parametrize(("sign", "rest"), [(-1, 1.0), (1, 1.0), (1, -1.5), (-1, -1.5)])
def test_a_curve_that_begins_at_a_preload_or_before_contact_gives_the_same_stiffness(
    sign, rest
):
    antenna = Antenna.from_beam(
        length=20.0, radius=0.2, modulus=1000.0, density=1e-3, n_segments=8, damping_time=1.0
    )
    moved = np.linspace(0.0, 3.0, 13)
    force = 1.4 * compute_force(antenna, np.maximum(moved - rest, 0.0), 8.0)
    curve = ForceCurve(deflection=sign * moved, force=sign * force, at=8.0)
    fit = fit_measurements([Measurements(forces=(curve,))], antenna)
    assert fit.p[0] == pytest.approx(1.4, rel=2e-3)
    assert [z for z, _ in fit.zero.values()] == pytest.approx([sign * rest], rel=5e-3)
    assert "not one from rest at 0" in " ".join(fit.describe())


@pytest.mark.parametrize(
    ("factor", "asked"),
    [(1 / 160, True), (1 / 20, False), pytest.param(1e3, True, marks=pytest.mark.long)],
)
def test_a_stiffness_of_another_unit_is_questioned(factor, asked):
    antenna = Antenna.from_beam(
        length=20.0, radius=0.2, modulus=1000.0, density=1e-3, n_segments=8, damping_time=1.0
    )
    moved = np.linspace(0.0, 1.0, 6)
    curve = ForceCurve(
        deflection=moved, force=factor * compute_force(antenna, moved, 16.0), at=16.0
    )
    said = " ".join(fit_measurements([Measurements(forces=(curve,))], antenna).describe())
    assert ("are its modulus, the frame rate, and the units" in said) is asked


def test_a_table_of_several_animals_is_a_curve_for_each(tmp_path):
    rows = [f"{who};{d};{k * d}" for d in (1, 2, 3) for who, k in (("b", 2), ("a 1", 5))]
    (tmp_path / "f.csv").write_text("animal;deflection_mm;force_mN\n" + "\n".join(rows))
    curves = load_forces(tmp_path / "f.csv", at=9.0)
    assert {one.name: one.force[-1] / one.deflection[-1] for one in curves} == pytest.approx(
        {"a 1": 5e-3, "b": 2e-3}
    )
    assert [one.name for one in load_forces(tmp_path / "f.csv", at=9.0, name="b")] == ["b"]
    with pytest.raises(InvalidInput, match="no animal 'c'; there are b, a 1"):
        load_forces(tmp_path / "f.csv", at=9.0, name="c")


def test_large_deflections_stiffen_as_the_statics_say():
    antenna = make_small()
    import feeler

    forces = np.array([1e-4, 1e-3, 4e-3])
    moved = feeler.bend(antenna, forces, at=0.5)["points"].values[:, 6, 0]
    np.testing.assert_allclose(
        compute_force(antenna, moved, 0.5 * antenna.length), forces, rtol=0.01
    )


@pytest.mark.parametrize(
    ("header", "rows", "match"),
    [
        ("deflection,force_uN", [(0, 0), (1, 1), (2, 2)], "'deflection' does not say its unit"),
        (
            "deflection_um,force_lb",
            [(0, 0), (1, 1), (2, 2)],
            "'force_lb' does not say its unit",
        ),
        ("deflection_um,force_uN,load_g", [(0, 0, 0), (1, 1, 2)], "which of force_uN, load_g"),
        ("deflection_um,volts_V", [(0, 0), (1, 1), (2, 2)], "no column force with its unit"),
        ("deflection_um,force_uN", [(0, 0), (1, 4), (2, 1), (3, 5)], "not monotone: near"),
        (
            "deflection_um,force_uN",
            [(k, min(k, 5.0)) for k in range(12)],
            "7 samples have the largest force",
        ),
        ("deflection_um,force_uN", [(0, 1), (1, 1), (2, 1)], "the force never changes"),
        ("deflection_mm,force_uN", [(0, 0), (500, 1), (900, 2)], "too large for a point 8 mm"),
        ("deflection_um,force_uN", [(0, 0), (1, ""), (2, 1)], "line 3: force_uN is empty"),
    ],
)
def test_tables_that_are_no_curve_are_refused(tmp_path, header, rows, match):
    lines = [header, *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "f.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(InvalidInput, match=match):
        load_forces(tmp_path / "f.csv", at=8.0)


def test_segments_under_the_microscope_make_the_beam(tmp_path):
    """In µm or mm, with diameters or radii, in any order: one antenna; and at some places only."""
    length = np.random.default_rng(1).uniform(0.3, 0.6, 14)
    radius = 0.15 - 0.1 * (np.cumsum(length) - length / 2) / length.sum()
    number = np.arange(1, 15)
    order = np.random.default_rng(2).permutation(14)
    tables = {
        "segment,length_um,diameter_um": (number, 1e3 * length, 2e3 * radius),
        "Segment;segment length (mm);radius [µm]": (
            number[order],
            length[order],
            1e3 * radius[order],
        ),
    }
    made = []
    for k, (header, columns) in enumerate(tables.items()):
        sign = ";" if ";" in header else ","
        rows = "\n".join(
            sign.join(f"{cell:.9g}" for cell in row) for row in zip(*columns, strict=True)
        )
        (tmp_path / f"{k}.csv").write_text(f"{header}\n{rows}\n", encoding="utf-8")
        made.append(load_microscope(tmp_path / f"{k}.csv", modulus=900.0, name="a"))
    direct = Antenna.from_beam(length=length, radius=radius, modulus=900.0, density=1.1e-3)
    for name in ("segment_length", "segment_mass", "radius", "stiffness"):
        for antenna in made:
            np.testing.assert_allclose(getattr(antenna, name), getattr(direct, name), rtol=1e-7)
    (tmp_path / "places.csv").write_text(
        f"position_mm,diameter_um\n0,300\n{length.sum() / 3},233.33333\n{length.sum()},100\n"
    )
    cone = load_microscope(tmp_path / "places.csv", modulus=900.0, n_segments=14)
    assert cone.segment_mass.sum() == pytest.approx(direct.segment_mass.sum(), rel=0.01)
    (tmp_path / "turned.csv").write_text("length_um,diameter_um\n400,90\n400,300\n")
    with pytest.warns(ModelValidityWarning, match="does the table begin at the tip"):
        load_microscope(tmp_path / "turned.csv", modulus=900.0)
    (tmp_path / "bare.csv").write_text("length,diameter_um\n400,90\n400,30\n")
    with pytest.raises(InvalidInput, match="'length' does not say its unit"):
        load_microscope(tmp_path / "bare.csv", modulus=900.0)


@pytest.mark.parametrize(
    ("rows", "match"),
    [
        ("1,500,200\n2,400,100\n,900,150", "line 4: segment is nan, but each row needs"),
        ("1,500,200\n2,400,100\n1,500,190\n2,410,90", "line 4: segment is 1, but each row"),
        ("a,500,200\nb,400,100\nMean,450,150", "the row 'Mean' is no segment"),
    ],
)
def test_sums_and_second_antennae_are_no_segments(tmp_path, rows, match):
    (tmp_path / "s.csv").write_text(f"segment,length_um,diameter_um\n{rows}\n")
    with pytest.raises(InvalidInput, match=match):
        load_microscope(tmp_path / "s.csv", modulus=900.0)


def test_a_base_that_drifts_with_the_animal_changes_no_release():
    time = np.arange(-30, 150) / 500
    swing = 40 * np.where(time < 0, 1, np.exp(-30 * time) * np.cos(150 * time))
    noise = np.random.default_rng(0).normal(0, 0.1, (2, 180, 2, 2))
    still = np.zeros((180, 2, 2))
    still[:, 1] = np.stack([np.full(180, 300.0), swing], axis=1)
    drift = np.outer(time, [20.0, 20.0])[:, None]  # 7 px, beside an antenna of 300 px
    first, second = (
        make_film(
            Tracks(position=one, landmarks=("base", "tip"), interval=2.0), ("base", "tip")
        ).make_traces()
        for one in (still + noise[0], still + drift + noise[1])
    )
    off = second.displacement[0][:140] - first.displacement[0][:140]
    assert np.abs(off).max() < 1.5


def measure(antenna, seed):
    """A release of three points, forces and an impulse of one animal, with noise."""
    rng, time = np.random.default_rng(seed), np.arange(0, 90, 1.0)
    from feeler.calibration import Traces

    rows = simulate_steps([antenna], HELD.replace(step_duration=92.0), time, (0.4, 0.7, 1.0))[0]
    rows = rows + rng.normal(0, 0.005, rows.shape)
    release = Traces(time=time, displacement=rows, names=("a@0.4", "a@0.7", "a"))
    moved = np.linspace(0, 1, 15)
    force = compute_force(antenna, moved, 15.0)
    force = force + 1e-6 + rng.normal(0, 0.01 * force.max(), 15)
    ratio = HELD.simulate_ratios([antenna], (0.5, 0.8))[0] + rng.normal(0, 0.01, 2)
    return Measurements(
        releases=(release,),
        forces=(ForceCurve(deflection=moved, force=force, at=15.0),),
        ratios=(Ratios(place=(0.5, 0.8), ratio=ratio, sd=np.full(2, 0.01)),),
    )


@pytest.mark.long
def test_one_fit_over_force_release_and_impulse_finds_the_hidden_animal():
    hidden = {
        "stiffness": 1.4,
        "damping": 0.7,
        "mass": 1.15,
        "stiffness_tilt": -0.4,
        "damping_tilt": 0.3,
    }
    animal = make_factors(make_small(), [*hidden]).build([*hidden.values()])
    found = fit_measurements([measure(animal, 4)], make_small(), protocol=HELD)
    assert found.names == (*hidden,) and not found.held
    values = np.array([*hidden.values()])
    width = found.high - found.low
    assert np.all(values > found.low - 0.25 * width) and np.all(
        values < found.high + 0.25 * width
    )
    assert all(found.determined[:4]) and found.interval.startswith("one animal")
    held_out = measure(animal, 5).releases[0]
    told = predict_release(held_out, found.antenna, start=make_small(), protocol=HELD)
    assert told.error < 0.01 < 0.05 < told.error_before


@pytest.mark.slow
def test_hidden_animals_lie_within_their_intervals():
    """Nine tenths of the parameters of twenty animals."""
    inside = []
    for seed in range(20):
        rng = np.random.default_rng(100 + seed)
        sizes = {"stiffness": 0.4, "damping": 0.4, "mass": 0.15}
        hidden = {name: np.exp(rng.normal(0, sd)) for name, sd in sizes.items()}
        hidden |= {name: rng.normal(0, 0.5) for name in ("stiffness_tilt", "damping_tilt")}
        animal = make_factors(make_small(), [*hidden]).build([*hidden.values()])
        found = fit_measurements([measure(animal, seed)], make_small(), protocol=HELD)
        values = np.array([*hidden.values()])
        inside.append((values > found.low) & (values < found.high))
    assert np.mean(inside) >= 0.9


def test_an_impulse_film_is_measured_as_the_simulated_one(tmp_path):
    """The ratios of a film of a hit, turned and in px, are those of the simulation."""
    import feeler

    antenna = make_small()
    hit = feeler.hit(antenna, points=(0.5, 0.8), sample_interval=1.0)
    moved = np.vstack([np.zeros(hit.time.size), hit.deflection.values, hit.tip.values])
    along, across = np.array([0.6, -0.8]), np.array([0.8, 0.6])
    rest = np.array([0.0, 0.5, 0.8, 1.0])[:, None] * antenna.length
    place = 300 + 8 * (rest[:, None] * along + moved[..., None] * across)
    names = ("base", "p50", "p80", "tip")
    header = ",".join(f"{name}_{axis}" for name in names for axis in "xy")
    table = place.transpose(1, 0, 2).reshape(hit.time.size, -1)
    np.savetxt(tmp_path / "hit.csv", table, "%.4f", ",", header=header, comments="")
    found = measure_impulse_film(load_film(tmp_path / "hit.csv", names, frame_rate=1000))
    np.testing.assert_allclose(found.place, [0.5, 0.8], atol=2e-3)
    exact = HELD.simulate_ratios([antenna], (0.5, 0.8))[0]
    np.testing.assert_allclose(found.ratio, exact, atol=0.01)


def take(dataset):
    return SimpleNamespace(**{name: item.values for name, item in dataset.variables.items()})


def test_nothing_moves_before_contact_and_the_tip_leads():
    result = take(hit(make_small(), points=(0.3, 0.71, 0.86), speed=0.3))
    before = result.time < -1e-9
    assert before.any() and np.abs(result.tip[before]).max() < 1e-12
    k = int(np.argmax(result.tip))
    assert (
        0
        < result.deflection[0, k]
        < result.deflection[1, k]
        < result.deflection[2, k]
        < result.tip[k]
    )
    assert np.abs(result.force[-1]).max() == 0.0


@pytest.mark.parametrize("lever", [None, 15.0])
def test_the_cylinder_goes_where_it_is_sent(lever):
    """At 0.4 mm/ms, straight ahead or, from contact on, round a lever's quarter circle and then
    along the antenna.
    """
    result = take(hit(make_small(), speed=0.4, lever=lever, sample_interval=0.5))
    speed = np.linalg.norm(np.diff(result.object, axis=0), axis=1) / 0.5
    np.testing.assert_allclose(speed, 0.4, rtol=2e-3)
    way = 0.4 * (result.time[-1] - result.time[0])
    ends = {
        None: (way, 0.0),
        15.0: (0.4 * IMPULSE_LEAD + 15.0, 0.4 * result.time[-1] - 15.0 * (np.pi / 2 - 1)),
    }
    (x, y), end = result.object[-1] - result.object[0], ends[lever]
    assert x == pytest.approx(end[0], rel=1e-3)
    assert y == pytest.approx(end[1], rel=2e-2, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"points": ()}, "points"),
        ({"points": (1.2,)}, "points"),
        ({"lever": -1.0}, "lever"),
        ({"speed": 0.0}, "speed"),
    ],
)
def test_impossible_hits_are_refused(options, match):
    with pytest.raises((InvalidInput, ZeroDivisionError), match=match):
        hit(make_small(), **options)
