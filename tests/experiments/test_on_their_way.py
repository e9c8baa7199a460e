"""Every option of a set reaches each of its trials, and of many trials each keeps what is its own:
numbers differ in everything, orders are none of the usual, and hardly anything is simulated.
"""

import json
import re
import signal
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from awkward_touches import INTERVAL, N_SAMPLES, list_trials, make_antenna, make_set
from tensors._sets import CONFIGURATION, make_trial

import feeler
from feeler.errors import (
    InvalidInput,
    OutOfMemory,
    StoreError,
)
from feeler.execute import workers
from feeler.experiments import mechanics as impulse
from feeler.experiments import tactile as job
from feeler.experiments.mechanics import release
from feeler.physics.contact import get_contact
from feeler.physics.scene import Clock
from feeler.tensors.store import open_store
from feeler.tensors.transforms import label_like, project_planes, stack_planes

STEP = 0.05


def make_job(**more):
    """What every trial of the awkward set is simulated with."""
    known = {
        "antenna": make_antenna(),
        "contact": get_contact("smooth"),
        "clock": Clock(duration=INTERVAL * N_SAMPLES, sample_interval=INTERVAL, timestep=STEP),
        "engine": "chain-consistent",
        "accuracy": None,
        "save": None,
        "dtype": "float64",
        "seed": 5,
        "attrs": {},
    }
    return job._WorkerTask(**known | more)


def spawn(seed, index):
    sequence = np.random.SeedSequence(seed, spawn_key=(index,))
    return int(sequence.generate_state(1, np.uint32)[0])


def test_a_trial_s_seed_is_that_of_its_number_whoever_it_is_beside():
    whole = make_set()
    assert whole["seed"].values.tolist() == [spawn(5, k) for k in range(3)]
    assert json.loads(whole.attrs["configuration"])["seed"] == 5
    made = make_job().list_made([7, 2], list_trials()[:2])
    assert [one["seed"] for one in made] == [spawn(5, 7), spawn(5, 2)]
    assert [one["location"] for one in made] == [0.83, 0.52]
    reading = {"angle": np.zeros((5, N_SAMPLES))}
    readings = {2: reading, 7: reading}
    tensors = make_job(save=["angle"]).make_tensors([7, 2], list_trials()[:2], readings)
    assert tensors["seed"].values.tolist() == [spawn(5, 7), spawn(5, 2)]
    assert tensors["trial"].values.tolist() == [7, 2]
    names = [one.name for one in list_trials()[:2]]
    assert tensors["feature"].values.tolist() == names


def test_labels_of_trials_are_their_own_parameters():
    tensors, trials = make_set(), list_trials()
    for name in ("location", "speed", "approach", "side", "lead", "friction"):
        assert tensors[name].values.tolist() == [getattr(trial, name) for trial in trials]
    assert tensors["base"].values.tolist() == [
        "",
        "",
        "velocity 0.03 -0.02 mm/ms, turn 0.004 rad/ms",
    ]


def test_a_worker_of_another_feeler_says_which_and_what_is_wanted():
    with pytest.raises(
        StoreError, match=r"with physics 1 \(wanted: feeler 1 with physics 2\)\. Install"
    ):
        job._check_origin(2, {"feeler": "1"})
    job._check_origin(job.PHYSICS, {"feeler": job.find_version("feeler")})


def test_a_release_says_where_and_how_far_it_was_held():
    antenna = make_antenna()
    tensors = release(antenna, at=7.0, deflection=0.4, duration=3.0, sample_interval=0.5)
    assert tensors["location"].values == pytest.approx([7.0 / antenna.length])
    told = json.loads(tensors.attrs["configuration"])
    assert (told["at"], told["deflection"]) == (7.0, 0.4)
    assert tensors["angle"].sizes == {"trial": 1, "sensor": 11, "time": 6}
    with pytest.raises(InvalidInput, match=r"smaller than `at` = 0\.3 mm, got 0\.4 mm"):
        release(antenna, at=0.3, deflection=0.4)
    with pytest.raises(InvalidInput, match=r"angle must be 11 finite numbers, .* shape \(3,\)"):
        release(antenna, angle=np.zeros(3))


def test_a_lever_swings_away_from_the_base_and_its_cylinder_s_middle_is_behind_its_front():
    antenna = make_antenna()
    scene = impulse.make_impulse_scene(antenna, speed=0.4, lever=9.0)
    quarter = 9.0 * np.pi / 2 / 0.4
    time = np.array([0.0, 2.0, 2.0 + quarter, 12.0 + quarter])
    motion = SimpleNamespace(time=time, angle=np.zeros((4, 11)), force=np.zeros((4, 2)))
    moved = impulse.measure_impulse(scene, motion)
    forward = np.asarray(scene.objects[0].forward)
    start = np.asarray(scene.objects[0].place) - 2.5 * forward
    ways = moved["object"].values - start
    along = np.column_stack([ways @ forward, ways[:, 1]])
    wanted = [[0, 0], [0.8, 0], [0.8 + 9.0, 9.0], [0.8 + 9.0, 9.0 + 4.0]]
    np.testing.assert_allclose(along, wanted, atol=0.1)  # in 36 legs
    np.testing.assert_allclose(moved["time"], time - 2.0)


def test_each_load_bends_by_itself_where_it_acts():
    antenna = make_antenna()
    loads = feeler.bend(antenna, [3e-4, -1e-4], at=0.6)
    assert loads["force"].values.tolist() == [3e-4, -1e-4] and loads.attrs["at"] == 0.6
    alone = feeler.bend(antenna, -1e-4, at=0.6)
    np.testing.assert_allclose(loads["angle"][1], alone["angle"][0])
    rest = antenna.tip()[0]
    tips = loads["tip"].values[:, 0] - rest
    assert tips[0] > 0 > tips[1]
    free = antenna.hinge_position > 0.6 * antenna.length
    away = loads["angle"].values[:, free] - antenna.rest_angle[free]
    np.testing.assert_allclose(away, 0.0, atol=1e-9)
    with pytest.raises(
        InvalidInput, match=r"a number or a list of numbers, got \[\[1\.0, 2\.0\]\]"
    ):
        feeler.bend(antenna, [[1.0, 2.0]])


def test_an_aborted_worker_is_one_without_memory():
    assert isinstance(workers._explain_end(-signal.SIGABRT), OutOfMemory)


def test_a_damaged_last_group_is_called_by_the_trials_that_there_are(tmp_path):
    path = tmp_path / "a.zarr"
    with open_store(path, CONFIGURATION, 6, group_size=4, made="abcdef".__getitem__) as store:
        for index in (5, 0, 4):
            store.append([index], make_trial(index))
        assert np.flatnonzero(store.finished).tolist() == [0, 4, 5]
    shard = path / "angle" / "c.1.0.0"
    shard.write_bytes(shard.read_bytes()[:-1] + b"?")
    with (
        pytest.warns(UserWarning, match="will be computed again") as warned,
        open_store(path, CONFIGURATION, 6, group_size=4) as store,
    ):
        assert np.flatnonzero(store.finished).tolist() == [0]
    assert re.search(r"trials 4 to 5, in .*c\.1\.0\.0", warned[0].message.details)


def make_spatial():
    values = np.random.default_rng(1).normal(size=(2, 3, 4, 6))
    dims = ("trial", "plane", "sensor", "time")
    coords = {"sensor": [3, 5, 8, 9], "place": ("trial", [0.2, 0.7])}
    return xr.DataArray(values, dims=dims, coords=coords, attrs={"units": "rad"})


def test_planes_are_folded_one_after_the_other_and_projected_by_angle():
    tensors = make_spatial()
    folded = stack_planes(tensors)
    np.testing.assert_array_equal(folded, tensors.values.reshape(2, 12, 6))
    assert folded.dims == ("trial", "sensor", "time")
    sides = project_planes(tensors, (0.0, 90.0, 30.0), turn=10.0)
    for side, around in enumerate((0.0, 90.0, 30.0)):
        for sensor in range(4):
            at = np.deg2rad(around + 10.0 * sensor)
            x, z = tensors.values[:, 0, sensor], tensors.values[:, 1, sensor]
            np.testing.assert_allclose(sides[:, side, sensor], x * np.cos(at) + z * np.sin(at))
    assert sides["around"].values.tolist() == [0.0, 90.0, 30.0]
    assert sides.attrs == {"units": "rad"}
    flat = project_planes(tensors.isel(plane=0, drop=True), 60.0)
    np.testing.assert_allclose(flat[:, 0], 0.5 * tensors.values[:, 0])


def test_what_comes_back_keeps_the_labels_that_fit_it_and_no_other():
    tensors = make_spatial()
    dims = ("trial", "component", "time")
    coded = label_like(np.zeros((2, 5, 6)), tensors, dims, "code", units="1")
    assert coded["place"].values.tolist() == [0.2, 0.7] and "sensor" not in coded.coords
    assert (coded.name, coded.dims, coded.attrs) == ("code", dims, {"units": "1"})
    shorter = label_like(np.zeros((1, 5, 6)), tensors, dims, "code")
    assert "place" not in shorter.coords
    plain = np.zeros((2, 5, 6))
    assert label_like(plain, tensors.values, dims, "code") is plain
