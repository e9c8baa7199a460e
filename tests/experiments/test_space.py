"""Touches in space from ``touch`` to files, codes and pictures: the same verbs."""

import json

import mujoco
import numpy as np
import pytest
import xarray as xr

import feeler
from feeler.analysis import compute_dispersion
from feeler.analysis.indices import check_tensors
from feeler.antenna.segments import Antenna
from feeler.encoding.inputs import read_tensors
from feeler.errors import InvalidInput, StoreError
from feeler.objects import Ball, Flow, Peg, Trial, Wall, place
from feeler.objects.meshes import compute_gap_in_space
from feeler.physics.spec import write_mjcf
from feeler.plotting.tensors import take_curvature
from feeler.provenance import to_jsonable
from feeler.tensors.schema import find_errors, validate
from feeler.tensors.transforms import reconstruct_posture, stack_planes

pytestmark = pytest.mark.long

BEND = np.stack([np.full(10, 0.02), np.full(10, -0.03)])
WHISKER = Antenna.from_beam(
    length=20.0,
    radius="0.08 - 0.07 * x",
    modulus=3500.0,
    density=1.4e-3,
    n_segments=10,
    damping_time=0.9,
    planes=2,
    rest_angle=BEND,
    sensors=[1, 4, 9],
    name="bent",
)
STRAIGHT = WHISKER.replace(rest_angle=0.0, radius=0.05)
TURNS = (0.0, 60.0, 180.0)
TRIALS = [
    Trial(feature=feature, location=0.6, speed=0.06, azimuth=turn)
    for feature in (Ball(radius=1.0), Peg(radius=0.5), Wall())
    for turn in TURNS
]


@pytest.fixture(scope="module")
def touches():
    return feeler.touch(WHISKER, TRIALS, duration=12, save=("force", "base_moment", "tip"))


@pytest.mark.parametrize(
    "trial", TRIALS, ids=lambda trial: f"{trial.feature.kind} {trial.azimuth}"
)
def test_contact_begins_after_the_lead(trial):
    """The gap at time 0 closes exactly in that time, whatever the antenna's curve."""
    placed = place(WHISKER, trial)
    axes = np.array([placed.forward, placed.left, np.cross(placed.forward, placed.left)])
    np.testing.assert_array_equal(placed.axes, axes)
    for time, closed in ((0.0, False), (trial.lead - 1e-6, False), (trial.lead + 1e-6, True)):
        where = placed.origin + time * placed.velocity
        points = WHISKER.shape()
        gap = compute_gap_in_space(points, WHISKER.radius, trial.feature, where, axes)
        assert (gap < 0) == closed


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("approach", [50.0, 90.0, 140.0])
def test_in_the_plane_a_trial_is_placed_as_on_the_planar_antenna(side, approach):
    trial = Trial(
        feature=Ball(radius=1.0), location=0.6, speed=0.1, side=side, approach=approach
    )
    flat, spatial = place(STRAIGHT.flatten(), trial), place(STRAIGHT, trial)
    for name in ("origin", "forward", "velocity"):
        wanted = [*getattr(flat, name), 0.0]
        np.testing.assert_allclose(getattr(spatial, name), wanted, rtol=0, atol=1e-11)


def test_tensors_keep_the_contract(touches):
    validate(touches)
    assert touches["angle"].dims == ("trial", "plane", "sensor", "time")
    assert touches["plane"].values.tolist() == ["x", "z"]
    assert touches["axis"].values.tolist() == ["x", "y", "z"]
    assert touches["base_moment"].dims == ("trial", "time", "axis")
    assert touches["azimuth"].values.tolist() == [0.0, 60.0, 180.0] * 3
    np.testing.assert_allclose(touches["angle"][0, :, :, 0], BEND[:, [0, 3, 8]])
    force = touches["force"].isel(time=-1).values
    direction = np.degrees(np.arctan2(force[:, 2], force[:, 0])) % 360
    np.testing.assert_allclose(direction, [0.0, 60.0, 180.0] * 3, atol=15)


def test_the_point_of_contact_lies_on_the_antenna_where_the_ball_is():
    """A ball's centre is its radius and the antenna's away from the point, less what it sank in."""
    trial = TRIALS[1]
    found = feeler.touch(
        WHISKER, trial, duration=30, save=("contact_point", "contact_place"), all_hinges=True
    )
    validate(found)
    touched = np.isfinite(found["contact_place"].values[0])
    assert touched.any() and not touched[: round(trial.lead)].any()
    point, start = found["contact_point"].values[0], place(WHISKER, trial)
    assert np.array_equal(np.isfinite(point).all(axis=1), touched)
    centre = start.origin + found["time"].values[:, None] * start.velocity
    centre = centre - trial.feature.radius * np.array(start.forward)
    far = np.linalg.norm(point - centre, axis=1)[touched]
    np.testing.assert_allclose(far, 1.0 + WHISKER.radius[6], atol=0.06)


def test_a_round_antenna_lies_down_and_stands_up_again():
    flat = feeler.presets.cockroach("linear").replace(rest_angle=np.linspace(0.0, 0.01, 140))
    both = flat.unflatten()
    assert both.planes == ("x", "z") and both.flatten() == flat and both.unflatten() is both
    np.testing.assert_array_equal(both.stiffness[0], both.stiffness[1])
    np.testing.assert_allclose(both.shape()[:, :2], flat.shape(), atol=1e-12)
    assert not both.rest_angle[1].any()


def test_a_breach_is_named(touches):
    wrong = touches.isel(axis=slice(2))
    assert "'tip' must have 3 axes in space, got 2" in find_errors(wrong)
    flat = touches.isel(plane=0, drop=True)
    assert any("got ('trial', 'time', 'axis')" in words for words in find_errors(flat))


SLOW = [pytest.param(ending, marks=pytest.mark.slow) for ending in ("mat", "nwb")]


@pytest.mark.parametrize("ending", ["nc", *SLOW])
def test_files_give_them_back(touches, tmp_path, ending):
    feeler.save(touches, tmp_path / f"set.{ending}")
    again = feeler.load(tmp_path / f"set.{ending}")
    assert again["angle"].dims == touches["angle"].dims
    np.testing.assert_array_equal(again["angle"], touches["angle"])
    np.testing.assert_array_equal(again["axis"], touches["axis"])


def test_encoders_and_indices_see_planes_as_more_sensors(touches):
    bending = np.maximum(touches["angle"], 0)
    folded, _ = read_tensors(bending)
    assert folded.shape == (9, 6, 12)
    np.testing.assert_array_equal(folded[:, 3:], bending.isel(plane=1))
    np.testing.assert_array_equal(
        check_tensors(touches["angle"])[:, :3], touches["angle"][:, 0]
    )
    assert compute_dispersion(bending, indices=["mse"]).groups == ("",)
    flat = touches["angle"].isel(plane=0, drop=True)
    xr.testing.assert_identical(stack_planes(flat), flat)
    assert stack_planes(touches["angle"])["plane"].values.tolist() == ["x"] * 3 + ["z"] * 3


def test_postures_come_from_the_sensors(touches):
    points = reconstruct_posture(touches, WHISKER)
    np.testing.assert_allclose(
        points[:, 0], np.broadcast_to(WHISKER.shape(), (9, 11, 3)), atol=1e-9
    )


def test_curvature_is_the_length_of_its_vector(touches):
    found = take_curvature(touches)
    wanted = np.hypot(*np.moveaxis(touches["curvature"].values, 1, 0))
    np.testing.assert_allclose(found, wanted)


def test_a_base_that_turns_in_space_is_labelled_and_recorded():
    base = feeler.BaseMotion(velocity=(0.0, 0.01, 0.0), turn=(0.0, 0.0, -0.002))
    found = feeler.touch(WHISKER, TRIALS[4].replace(base=base), duration=8)
    assert found["base"].item() == "velocity 0 0.01 0 mm/ms, turn 0 0 -0.002 rad/ms"
    np.testing.assert_allclose(found["base_pose"][0, -1], [0, 0.07, 0, 0, 0, -0.014], atol=1e-9)


def test_an_accuracy_is_reached_in_space():
    found = feeler.touch(WHISKER, TRIALS[1], duration=10, accuracy=0.02)
    assert float(found["error"].max()) <= 0.02


def test_an_exported_scene_begins_as_the_trial_does(tmp_path):
    """MuJoCo reads it, and its keyframe carries the peg against the whisker."""
    path = write_mjcf(WHISKER, TRIALS[4], tmp_path / "scene.xml")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    found = data.qpos[7:27].reshape(10, 2).T
    np.testing.assert_allclose(found, BEND, atol=1e-6)
    mujoco.mj_step(model, data, nstep=round(8.0 / model.opt.timestep))
    assert data.ncon


def test_a_planar_antenna_has_no_azimuth():
    with pytest.raises(InvalidInput, match=r"azimuth=60°.*lies in it"):
        place(WHISKER.flatten(), TRIALS[1])


STREAM = Flow(drag=2e-5, velocity=(0.3, -0.2, 0.1))


@pytest.mark.parametrize("engine", ["chain-consistent", "mujoco"])
def test_a_touch_in_a_flow_is_that_of_a_simulation(engine):
    options = {"engine": engine, "timestep": 0.005}
    found = feeler.touch(
        WHISKER, TRIALS[1], duration=6, flow=STREAM, all_hinges=True, **options
    )
    runs = feeler.Simulation(WHISKER, TRIALS[1], flow=STREAM, **options)
    runs.step(5.0)
    np.testing.assert_array_equal(found["angle"][0, :, :, 5], runs.angle)
    assert np.abs(runs.angle - BEND).max() > 1e-3


def test_a_flow_belongs_to_what_a_set_was_made_with(tmp_path):
    store = tmp_path / "set.zarr"
    found = feeler.touch(WHISKER, TRIALS[:1], duration=4, flow=STREAM, store=store)
    assert json.loads(found.attrs["configuration"])["flow"] == to_jsonable(STREAM)
    still = feeler.touch(WHISKER, TRIALS[:1], duration=4)
    assert "flow" not in still.attrs["configuration"]
    for other in (None, STREAM.replace(drag=1e-5)):
        with pytest.raises(StoreError, match=r"another configuration .*flow"):
            feeler.touch(WHISKER, TRIALS[:1], duration=4, flow=other, store=store)


def test_where_a_flow_would_be_ignored_it_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="flow drags antennae in space only, and 'bent'"):
        feeler.touch(WHISKER.flatten(), TRIALS[0], flow=STREAM, store=tmp_path / "a.zarr")
