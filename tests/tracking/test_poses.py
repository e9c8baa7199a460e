"""Tracks leave as ndx-pose in NWB, which nwbinspector accepts, and come back the same."""

import json
from datetime import UTC, datetime

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.tensors.formats import load
from feeler.tracking import load_tracks, make_synthetic_tracks, save_poses
from tests.tensors._sets import judge
from tests.tracking.dltdv import save_dltdv

START = datetime(2026, 5, 1, 9, tzinfo=UTC)


@pytest.fixture(scope="module")
def trials():
    films = [
        make_synthetic_tracks(np.random.default_rng(k), duration=2e3 * (k + 1), noise=0.1)
        for k in range(2)
    ]
    position = films[1].position.copy()
    position[5, 2] = np.nan
    return [films[0], films[1].replace(position=position)]


@pytest.mark.further
@pytest.mark.parametrize("unit", ["px", "mm"])
def test_poses_come_back_as_they_were(tmp_path, trials, unit):
    from pynwb import NWBHDF5IO

    path = tmp_path / "a.nwb"
    films = [film.scaled(10.0) if unit == "mm" else film for film in trials]
    save_poses(
        films,
        path,
        session_start=START,
        identifier="walk",
        edges=[("head", "abdomen")],
        subject="c1",
    )
    for k, film in enumerate(films):
        back = load_tracks(path, individual=f"trial_{k:06d}")
        assert (back.landmarks, back.unit, back.interval) == (
            film.landmarks,
            unit,
            pytest.approx(film.interval),
        )
        np.testing.assert_allclose(back.position, film.position, rtol=1e-12)
        assert back.source == film.source == "synthetic"
    said = {"px": ("pixels", 1.0), "mm": ("meters", 1e-3)}[unit]
    with NWBHDF5IO(str(path), "r") as io:
        module = io.read().processing["behavior"]
        for k in range(len(films)):
            for series in module[f"trial_{k:06d}"].pose_estimation_series.values():
                assert (series.unit, series.conversion) == said
                assert "x to the right, y downwards" in series.reference_frame


def test_all_films_share_one_clock(tmp_path, trials):
    from pynwb import NWBHDF5IO

    save_poses(
        trials,
        tmp_path / "a.nwb",
        session_start=START,
        identifier="walk",
        edges=[("head", "left_tip")],
    )
    with NWBHDF5IO(str(tmp_path / "a.nwb"), "r") as io:
        file = io.read()
        start, stop = file.trials["start_time"][:], file.trials["stop_time"][:]
        assert start[0] == 0 and start[1] == stop[0] + 1
        for number, film in enumerate(trials):
            poses = file.processing["behavior"][f"trial_{number:06d}"]
            for one in poses.pose_estimation_series.values():
                assert one.starting_time == start[number]
                last = one.starting_time + (len(one.data) - 1) / one.rate
                assert stop[number] == pytest.approx(last, abs=1e-5)
            assert stop[number] - start[number] == pytest.approx(
                1e-3 * np.ptp(film.time), abs=1e-5
            )
        assert {row.timeseries.name for row in file.trials["timeseries"][1]} == {
            *trials[0].landmarks
        }
        nodes, (edge,) = poses.skeleton.nodes[:], poses.skeleton.edges[:]
        assert [nodes[k] for k in edge] == ["head", "left_tip"]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"edges": [("head", "knee")]}, "an edge joins 'knee'; the tracks hold left_tip"),
        ({"session_start": datetime(2026, 5, 1)}, "a time with its zone"),
        ({"trials": []}, "at least one film"),
    ],
)
def test_what_cannot_be_written_is_said(tmp_path, trials, change, match):
    given = {
        "trials": trials,
        "path": tmp_path / "a.nwb",
        "session_start": START,
        "identifier": "walk",
    } | change
    with pytest.raises(InvalidInput, match=match):
        save_poses(given.pop("trials"), given.pop("path"), **given)
    assert not any(tmp_path.iterdir())


def test_one_film_of_other_landmarks_is_enough_to_refuse_all(tmp_path, trials):
    from dataclasses import replace

    odd = replace(trials[0], landmarks=trials[0].landmarks[::-1])
    with pytest.raises(InvalidInput, match="the same landmarks in the same order"):
        save_poses([trials[0], odd], tmp_path / "a.nwb", session_start=START, identifier="walk")


@pytest.mark.long
def test_the_verb_writes_poses_of_which_the_inspector_is_silent_and_reads_them(
    tmp_path, trials
):
    for k, film in enumerate(trials):
        save_dltdv(film, tmp_path / f"walk{k}_xypts.csv")
    files = [tmp_path / f"walk{k}_xypts.csv" for k in range(2)]
    words = [
        "tracks",
        *files,
        "--frame-rate",
        1e3 / trials[0].interval,
        "--scale",
        8,
        "--out",
        tmp_path / "out",
        "--json",
    ]
    first = CliRunner().invoke(
        app, [str(w) for w in (*words, "--session-start", START.isoformat(), "--subject", "c1")]
    )
    assert first.exit_code == 0 and judge(tmp_path / "out" / "tracks.nwb") == [], first.output
    words = [
        "tracks",
        tmp_path / "out" / "tracks.nwb",
        "--individual",
        "trial_000001",
        "--json",
    ]
    again = CliRunner().invoke(app, [str(w) for w in words])
    known = [json.loads(one.stdout)["trials"] for one in (first, again)]
    assert known[1][0]["mean_peak"] == pytest.approx(known[0][1]["mean_peak"])
    with pytest.raises(InvalidInput, match=r"Poses are read by feeler tracks"):
        load(tmp_path / "out" / "tracks.nwb")


@pytest.mark.parametrize("shape", [2, 3])
def test_landmarks_with_signs_that_nwb_forbids_come_back(tmp_path, shape):
    names = ("Butt/Tail", "Butt_Tail", "a:b", "plain")
    position = np.random.default_rng(0).normal(50, 9, (20, 4, shape))
    tracks = make_synthetic_tracks(np.random.default_rng(0), duration=2e3).replace(
        position=position, landmarks=names
    )
    save_poses([tracks], tmp_path / "a.nwb", session_start=START, identifier="x")
    back = load_tracks(tmp_path / "a.nwb", plane=None if shape == 2 else "space")
    assert back.landmarks == names
    np.testing.assert_allclose(back.position, position)


def write_ndx(path, n_axes, timestamps):
    """A file by ndx-pose itself: a landmark for each number of axes."""
    from ndx_pose import PoseEstimation, PoseEstimationSeries, Skeleton, Skeletons
    from pynwb import NWBHDF5IO, NWBFile

    file = NWBFile(session_description="x", identifier="x", session_start_time=START)
    skeleton = Skeleton(name="s", nodes=[f"p{k}" for k in range(len(n_axes))])
    series = [
        PoseEstimationSeries(
            name=f"p{k}",
            data=np.random.default_rng(k).normal(size=(len(timestamps), n)),
            unit="pixels",
            reference_frame="top left",
            timestamps=timestamps,
            confidence=np.ones(len(timestamps)),
        )
        for k, n in enumerate(n_axes)
    ]
    module = file.create_processing_module("behavior", "poses")
    module.add(Skeletons(skeletons=[skeleton]))
    module.add(PoseEstimation(name="walk", pose_estimation_series=series, skeleton=skeleton))
    with NWBHDF5IO(path, "w") as out:
        out.write(file)


def test_landmarks_with_and_without_z_are_read_together(tmp_path):
    write_ndx(tmp_path / "m.nwb", (3, 2), np.arange(30) / 25.0)
    tracks = load_tracks(tmp_path / "m.nwb", plane="space")
    assert tracks.position.shape == (30, 2, 3) and tracks.interval == pytest.approx(40.0)
    assert np.isnan(tracks.of("p1")[:, 2]).all() and np.isfinite(tracks.of("p1")[:, :2]).all()
    assert tracks.notes["without z"] == "p1"


def test_frames_that_are_not_evenly_spaced_are_said(tmp_path):
    times = np.arange(30) / 25.0
    times[7:] += 0.02  # half a frame
    write_ndx(tmp_path / "u.nwb", (2,), times)
    with pytest.raises(InvalidInput, match=r"no even clock: its frames are 40 to 60 ms apart"):
        load_tracks(tmp_path / "u.nwb")
    assert load_tracks(tmp_path / "u.nwb", frame_rate=25).n_frames == 30


def test_frames_that_are_left_out_of_the_times_are_gaps(tmp_path):
    write_ndx(tmp_path / "u.nwb", (2,), np.delete(np.arange(30) / 25.0, [7, 8]))
    tracks = load_tracks(tmp_path / "u.nwb")
    assert tracks.n_frames == 30 and tracks.interval == pytest.approx(40.0)
    assert np.flatnonzero(np.isnan(tracks.of("p0")[:, 0])).tolist() == [7, 8]
    assert "2 of 30 frames" in tracks.notes["left out"]
    with pytest.raises(InvalidInput, match="contradicts its times, by which there are 25"):
        load_tracks(tmp_path / "u.nwb", frame_rate=60)
