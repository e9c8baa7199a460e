"""Files of trackers: what is planted comes back, likelihood counts, hostile files stay harmless.

DLC_one and DLC_two (.csv, .h5) were written by pandas 3.1 with PyTables 3.11, as DeepLabCut writes
them (``to_hdf`` with key ``df_with_missing`` and format ``table``). SLEAP's analysis file,
Anipose's table and movement's netCDF follow their published layouts: sleap.io.convert, anipose
triangulate, movement.io.
"""

import json
import pickle
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.tracking import (
    compute_antenna_angle,
    load_tracks,
    measure_exploration,
    measure_posture,
)
from feeler.tracking.trackers import PLANES, _spread_frames
from feeler.tracking.tracks import Tracks

DATA = Path(__file__).parent / "data"
NAMES = ("left_tip", "right_tip", "head", "abdomen")
SPEED, RATE = np.deg2rad(204.2e-3), 200.0  # rad/ms, frames/s


def plant(rng, outliers=0.0, noise=0.3):
    """Names, positions (frame, landmark, axis) [px, y down] and likelihoods of antennae that sit 18
    px beside the head.
    """
    time = np.arange(2000) * 1e3 / RATE
    names = (*NAMES, "left_base", "right_base")
    swing = np.deg2rad(40) + SPEED / (2 * np.pi * 1e-3) * np.cos(2 * np.pi * 1e-3 * time)
    head, place = np.array([300.0, 300.0]), {}
    place["head"], place["abdomen"] = (
        np.tile(v, (time.size, 1)) for v in (head, head - [200.0, 0.0])
    )
    for side, sign in (("left", 1.0), ("right", -1.0)):
        base = head + np.array([0.0, 18.0 * sign])
        place[f"{side}_base"] = np.tile(base, (time.size, 1))
        place[f"{side}_tip"] = base + 240 * np.stack(
            [np.cos(swing), sign * np.sin(swing)], axis=1
        )
    position = np.stack([place[name] for name in names], axis=1) + rng.normal(
        0, noise, (time.size, len(names), 2)
    )
    lost = rng.random((time.size, len(names))) < outliers
    position[lost] += rng.uniform(-200, 200, (lost.sum(), 2))
    return names, position * [1.0, -1.0], np.where(lost, 0.1, 0.95)


def write_deeplabcut(path, names, position, likelihood):
    columns = np.concatenate([position, likelihood[:, :, None]], axis=2).reshape(
        len(position), -1
    )
    head = (
        ("scorer", *["DLC"] * columns.shape[1]),
        ("bodyparts", *np.repeat(names, 3)),
        ("coords", *["x", "y", "likelihood"] * len(names)),
    )
    rows = [",".join(row) for row in head] + [
        f"{k}," + ",".join(map(repr, row)) for k, row in enumerate(columns.tolist())
    ]
    path.write_text("\n".join(rows) + "\n")


def write_sleap(path, names, position, likelihood):
    with h5py.File(path, "w") as file:
        file["tracks"] = position.transpose(2, 1, 0)[None]
        file["point_scores"] = likelihood.T[None]
        file["track_occupancy"] = np.ones((len(position), 1), np.uint8)
        file["node_names"] = np.array(names, dtype="S")
        file["track_names"] = np.array(["track_0"], dtype="S")


def write_anipose(path, names, position, likelihood):
    columns = {}
    for k, name in enumerate(names):
        columns |= {f"{name}_{axis}": position[:, k, j] for j, axis in enumerate("xy")}
        columns |= {
            f"{name}_z": 0 * position[:, k, 0] + 7,
            f"{name}_error": 0 * position[:, k, 0] + 1.5,
        }
        columns |= {
            f"{name}_ncams": 0 * position[:, k, 0] + 3,
            f"{name}_score": likelihood[:, k],
        }
    columns |= {
        f"M_{i}{j}": np.full(len(position), float(i == j)) for i in range(3) for j in range(3)
    }
    columns |= {f"center_{i}": np.zeros(len(position)) for i in range(3)} | {
        "fnum": np.arange(len(position))
    }
    np.savetxt(
        path,
        np.stack(list(columns.values()), axis=1),
        delimiter=",",
        header=",".join(columns),
        comments="",
    )


def write_movement(path, names, position, likelihood):
    xr.Dataset(
        {
            "position": (
                ("time", "space", "keypoints", "individuals"),
                position.transpose(0, 2, 1)[..., None],
            ),
            "confidence": (("time", "keypoints", "individuals"), likelihood[..., None]),
        },
        coords={
            "time": np.arange(len(position)) / RATE,
            "space": ["x", "y"],
            "keypoints": list(names),
            "individuals": ["one"],
        },
        attrs={
            "fps": RATE,
            "time_unit": "seconds",
            "source_software": "SLEAP",
            "ds_type": "poses",
        },
    ).to_netcdf(path, engine="h5netcdf")


def write_new_movement(path, names, position, likelihood):
    """As versions of movement that count in the singular."""
    write_movement(path.with_name("old.nc"), names, position, likelihood)
    with xr.open_dataset(path.with_name("old.nc")) as old:
        new = old.rename(individuals="individual", keypoints="keypoint")
        new.to_netcdf(path, engine="h5netcdf")


def write_sleap_rows(path, names, position, likelihood):
    """SLEAP's CSV, with a second animal that sits still, and rows in no order of frames."""
    header = ["track", "frame_idx", "instance.score"]
    header += [f"{name}.{what}" for name in names for what in ("x", "y", "score")]
    numbers = np.concatenate([position, likelihood[:, :, None]], axis=2).reshape(
        len(position), -1
    )
    rows = [
        ["track_7", str(k + 30), "0.9", *map(repr, r)] for k, r in enumerate(numbers.tolist())
    ]
    rows += [["track_2", "31", "0.9", *["5.0"] * (3 * len(names))]]
    np.random.default_rng(2).shuffle(rows)
    path.write_text("\n".join(map(",".join, [header, *rows])) + "\n")


def write_plain(path, names, position, likelihood):
    header = ",".join(f"{name}_{what}" for name in names for what in ("x", "y", "likelihood"))
    table = np.concatenate([position, likelihood[:, :, None]], axis=2).reshape(
        len(position), -1
    )
    np.savetxt(path, table, delimiter=",", header=header, comments="")


WRITERS = {
    "dlc.csv": write_deeplabcut,
    "sleap.analysis.h5": write_sleap,
    "pose_3d.csv": write_anipose,
    "movement.nc": write_movement,
    "singular.nc": write_new_movement,
    "rows.csv": write_sleap_rows,
    "flat.csv": write_plain,
}
BASES = {"bases": ("left_base", "right_base")}


@pytest.mark.further
@pytest.mark.parametrize(
    ("name", "outliers"), [("dlc.csv", 0.0), *((name, 0.03) for name in WRITERS)]
)
def test_planted_speed_comes_back_within_its_stated_error(tmp_path, name, outliers):
    planted = plant(np.random.default_rng(1), outliers)
    WRITERS[name](tmp_path / name, *planted)
    plane = "xy" if name == "pose_3d.csv" else None
    tracks = load_tracks(
        tmp_path / name,
        frame_rate=None if name.endswith(".nc") else RATE,
        plane=plane,
        individual="track_7" if name == "rows.csv" else None,
    )
    assert sum(tracks.doubted.values()) == (planted[2] < 0.6).sum()
    found = measure_exploration([tracks], max_gap=5, landmarks=BASES)
    np.testing.assert_array_equal(found.n_peaks, [[20, 20]])
    assert np.all(np.abs(found.mean_peak - SPEED) < 2 * found.error)
    assert np.all(found.error < 0.02 * SPEED)


def test_a_row_twice_and_text_in_the_place_of_a_number_are_refused(tmp_path):
    write_sleap_rows(tmp_path / "t.csv", *plant(np.random.default_rng(1)))
    lines = (tmp_path / "t.csv").read_text().splitlines()
    with pytest.raises(InvalidInput, match="choose one of"):
        load_tracks(tmp_path / "t.csv", frame_rate=RATE)
    (tmp_path / "t.csv").write_text("\n".join([*lines, lines[5]]))
    with pytest.raises(InvalidInput, match="every frame of a track needs one row"):
        load_tracks(tmp_path / "t.csv", frame_rate=RATE, individual=lines[5].split(",")[0])
    (tmp_path / "t.csv").write_text("note,a_x,a_y\nok,left,1\nok,2,3\n")
    with pytest.raises(InvalidInput, match="column 'a_x' holds text"):
        load_tracks(tmp_path / "t.csv", frame_rate=RATE)


def test_the_head_in_place_of_the_base_is_wrong_and_outliers_without_likelihood_are_left_out(
    tmp_path,
):
    names, position, likelihood = plant(np.random.default_rng(1), 0.03)
    write_deeplabcut(tmp_path / "t.csv", names, position, likelihood)
    clean, all_of_them = (
        load_tracks(tmp_path / "t.csv", frame_rate=RATE, min_likelihood=m) for m in (0.6, 0.0)
    )
    assert measure_exploration([clean], max_gap=5).mean < 0.96 * SPEED
    found = measure_exploration([all_of_them], landmarks=BASES)
    np.testing.assert_allclose(found.mean_peak, SPEED, rtol=0.02)
    assert found.left_out[0]["left_tip jumps"] > 20
    wrong = measure_exploration([all_of_them], landmarks=BASES, outliers="keep", cutoff="paper")
    assert np.abs(wrong.mean_peak / SPEED - 1).max() > 0.05


@pytest.mark.parametrize("ending", ["csv", "h5"])
def test_deeplabcuts_own_files(ending):
    tracks = load_tracks(DATA / f"DLC_one.{ending}", frame_rate=30)
    k = np.delete(np.arange(50.0), 7)
    assert tracks.landmarks == NAMES and tracks.doubted == dict.fromkeys(NAMES, 1)
    np.testing.assert_allclose(
        np.delete(tracks.of("head"), 7, axis=0), np.stack([5 + k, -(2 * k - 2)], axis=1)
    )
    other = load_tracks(
        DATA / f"DLC_two.{ending}", frame_rate=30, individual="two", landmarks=("head",)
    )
    np.testing.assert_allclose(
        np.delete(other.of("head"), 7, axis=0), np.stack([15 + k, -(2 * k - 12)], axis=1)
    )
    with pytest.raises(InvalidInput, match="several individuals; choose one of one, two"):
        load_tracks(DATA / f"DLC_two.{ending}", frame_rate=30)


def test_column_names_that_would_call_something_are_refused(tmp_path):
    with h5py.File(tmp_path / "evil.h5", "w") as file:
        table = file.create_dataset(
            "df_with_missing/table",
            (3,),
            dtype=[("index", "<i8"), ("values_block_0", "<f8", (3,))],
        )
        table.attrs["values_block_0_kind"] = np.bytes_(pickle.dumps(Path.home, protocol=0))
    with pytest.raises(InvalidInput, match="only plain texts are read"):
        load_tracks(tmp_path / "evil.h5", frame_rate=30)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"frame_rate": None}, "does not say how many frames"),
        ({"frame_rate": 30, "min_likelihood": 2.0}, "must be from 0 to 1"),
        ({"frame_rate": 30, "individual": "zoe"}, "has no individual 'zoe'"),
        ({"frame_rate": 30, "plane": "xz"}, "have no plane xz"),
        ({"frame_rate": 30, "plane": "yx"}, "plane must be one of xy, xz, yz, space"),
        (
            {"frame_rate": 30, "landmarks": ("paw",)},
            "no landmark 'paw'; the tracks hold left_tip",
        ),
    ],
)
def test_what_is_missing_is_named(options, match):
    with pytest.raises(InvalidInput, match=match):
        load_tracks(DATA / "DLC_one.csv", **options)


def test_places_in_space_need_a_plane_and_foreign_hdf5_is_refused(tmp_path):
    write_anipose(tmp_path / "p.csv", *plant(np.random.default_rng(0)))
    with pytest.raises(InvalidInput, match="onto which plane"):
        load_tracks(tmp_path / "p.csv", frame_rate=30)
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["stuff"] = np.zeros(3)
    with pytest.raises(
        InvalidInput, match=r"neither tensors .* nor tracks .*; it holds stuff of shape \(3,\)"
    ):
        load_tracks(tmp_path / "x.h5", frame_rate=30)
    text = (DATA / "DLC_one.csv").read_text().replace("\n9,", "\n99,")
    (tmp_path / "hole.csv").write_text(text)
    with pytest.raises(InvalidInput, match="frames missing"):
        load_tracks(tmp_path / "hole.csv", frame_rate=30)


@pytest.mark.parametrize("numbers", [[4, 4], [6, 4], [4, 5.5], [4, np.nan]])
def test_frames_that_do_not_rise_by_whole_numbers_are_refused(numbers):
    with pytest.raises(InvalidInput, match=r"a\.csv: frame numbers must rise"):
        _spread_frames(np.array(numbers), "a.csv", np.zeros((2, 1, 2)))


@pytest.mark.parametrize("n", [3, 9])
def test_an_arc_has_one_curvature_and_bends_that_add_up(n):
    radius, turn = 50.0, np.linspace(0.0, 1.2, n)
    arc = radius * np.stack([np.sin(turn), 1 - np.cos(turn)], axis=1)
    spin = np.linspace(0, 7, 11)  # however it points, it bends alike
    turned = np.stack([arc @ [[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]] for a in spin])
    tracks = Tracks(
        position=turned + 3, landmarks=tuple(f"p{k}" for k in range(n)), interval=5.0
    ).scaled(2.0)
    posture = measure_posture(tracks, tracks.landmarks)
    np.testing.assert_allclose(posture.bend.sum("joint"), 1.2 * (n - 2) / (n - 1))
    chord = 2 * 25.0 * np.sin(0.6 / (n - 1))
    np.testing.assert_allclose(posture.piece_length, chord)
    np.testing.assert_allclose(posture.curvature, 1.2 / (n - 1) / chord)
    with pytest.raises(InvalidInput, match="at least 3 different landmarks"):
        measure_posture(tracks, ("p0", "p1"))
    with pytest.raises(InvalidInput, match="scaled already"):
        tracks.scaled(2.0)


def test_tracks_writes_table_figure_and_numbers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def ask(words):
        said = CliRunner().invoke(app, ["tracks", *words.split(), "--json"])
        assert said.exit_code == 0, said.output
        return json.loads(said.stdout)

    write_deeplabcut(Path("walk.csv"), *plant(np.random.default_rng(1), 0.03))
    how = f"--frame-rate {RATE} --bases left_base,right_base --max-gap 5 --out out"
    found = ask(f"walk.csv {how}")
    assert found == json.loads(Path("out/tracks.json").read_text())
    assert found["mean"] == pytest.approx(204.2, abs=2 * max(found["trials"][0]["error"]))
    assert found["trials"][0]["doubted"]["left_tip"] > 0
    table = pd.read_csv("out/tracks.csv", comment="#")
    tracks = load_tracks("walk.csv", frame_rate=RATE)
    raw = np.rad2deg(compute_antenna_angle(tracks, **BASES)[0])
    assert np.nanmedian(np.abs(table["angle_deg"][table["side"] == "left"] - raw)) < 0.2
    assert Path("out/tracks.png").stat().st_size > 10_000
    one = ask(f"{DATA / 'DLC_one.csv'} --frame-rate 30 --points left_tip,head,abdomen --out p")
    assert one[0]["whole"] == 49
    assert xr.open_dataset("p/DLC_one.posture.nc", engine="h5netcdf").sizes["joint"] == 1


SPACE = np.random.default_rng(3).normal(100.0, 20.0, (9, 4, 3))


def write_space_table(path):
    header = ",".join(f"{name}_{axis}" for name in NAMES for axis in "xyz")
    np.savetxt(path, SPACE.reshape(9, -1), delimiter=",", header=header, comments="")


def write_space_deeplabcut(path):
    rows = [
        ("scorer", *["3d"] * 12),
        ("bodyparts", *np.repeat(NAMES, 3)),
        ("coords", *"xyz" * 4),
    ]
    lines = [",".join(map(str, row)) for row in rows]
    lines += [
        f"{k}," + ",".join(map(repr, row))
        for k, row in enumerate(SPACE.reshape(9, -1).tolist())
    ]
    path.write_text("\n".join(lines))


def write_points(path):
    with h5py.File(path, "w") as file:
        file["tracks"] = SPACE[:, None]


SPACES = {
    "flat.csv": write_space_table,
    "dlc3d.csv": write_space_deeplabcut,
    "p.h5": write_points,
}


@pytest.mark.parametrize("name", SPACES)
def test_places_in_space_are_never_flattened_in_silence(tmp_path, name):
    SPACES[name](tmp_path / name)
    how = {"frame_rate": 50.0, **({"landmarks": NAMES} if name == "p.h5" else {})}
    with pytest.raises(InvalidInput, match="onto which plane to look"):
        load_tracks(tmp_path / name, **how)
    for plane, axes in PLANES.items():
        tracks = load_tracks(tmp_path / name, plane=plane, **how)
        np.testing.assert_allclose(tracks.position, SPACE[:, :, list(axes)])
        assert tracks.landmarks == NAMES and tracks.unit == "own unit"


def turn_at_random(rng):
    matrix = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return matrix * np.sign(np.linalg.det(matrix))


def test_angles_and_bends_in_space_are_those_of_the_plane_they_lie_in():
    """Antennae in a plane that is turned at random in space: angles and bends stay."""
    rng = np.random.default_rng(5)
    names, position, _ = plant(rng, noise=0.0)
    flat = Tracks(position=position * (1.0, -1.0), landmarks=names, interval=5.0)
    turned = (
        np.concatenate([flat.position, 0 * flat.position[..., :1]], 2) @ turn_at_random(rng).T
    )
    space = flat.replace(position=turned + 7.0)
    one, other = (compute_antenna_angle(tracks, **BASES) for tracks in (flat, space))
    np.testing.assert_allclose(other, np.abs(one), atol=1e-9)
    points = ("abdomen", "head", "left_base", "left_tip")
    bends = [measure_posture(tracks, points).bend for tracks in (flat, space)]
    np.testing.assert_allclose(bends[1], np.abs(bends[0]), atol=1e-9)


@pytest.mark.parametrize(
    "lines",
    [
        "scorer,me,me\nbodyparts,a,a\ncoords,x,y\nlabeled-data/v/img005.png,1.5,2\n",
        "scorer,,,me,me\nbodyparts,,,a,a\ncoords,,,x,y\nlabeled-data,v,img005.png,1.5,2\n",
        "scorer,,,S,S\nindividuals,,,i,i\nbodyparts,,,a,a\ncoords,,,x,y\nlabeled-data,v,i.png,1,2\n",
    ],
)
def test_training_labels_are_called_so(tmp_path, lines):
    (tmp_path / "CollectedData.csv").write_text(lines)
    with pytest.raises(InvalidInput, match=r"training labels .*, not tracks"):
        load_tracks(tmp_path / "CollectedData.csv", frame_rate=30)
    said = CliRunner().invoke(app, ["robot", "check", str(tmp_path / "CollectedData.csv")])
    assert "DeepLabCut" in str(said.exception)


def test_a_sleap_project_is_named_with_the_command_that_helps(tmp_path):
    with h5py.File(tmp_path / "walk.slp", "w") as file:
        file.create_group("metadata")
        file["frames"], file["instances"] = np.zeros(3), np.zeros(3)
    for verb in ("info", "tracks"):
        said = CliRunner().invoke(app, [verb, str(tmp_path / "walk.slp")])
        words = f"{said.output} {said.exception}"
        assert "sio convert walk.slp -o walk.analysis.h5 --to analysis_h5" in words
        assert "damaged" not in words


@pytest.mark.parametrize("clock", ["", "time_ms"])
def test_a_first_column_without_a_name_numbers_the_rows(tmp_path, clock):
    """As pandas and R write them: rows that were taken out are frames that were not seen."""
    names = ["", clock] if clock else [""]
    rows = [(k, *[5.0 * k] * bool(clock), k, 2.0 * k) for k in range(12) if k not in (4, 5)]
    lines = [",".join([*names, "tip_x", "tip_y"]), *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "t.csv").write_text("\n".join(lines))
    tracks = load_tracks(tmp_path / "t.csv", frame_rate=None if clock else 200)
    assert tracks.n_frames == 12 and tracks.interval == 5.0
    x = tracks.of("tip")[:, 0]
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(x)), [4, 5])
    np.testing.assert_array_equal(x[6:], np.arange(6, 12))
