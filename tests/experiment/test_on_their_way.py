"""Every option of a set reaches each of its trials, and of many trials each keeps what is its own:
numbers differ in everything, orders are none of the usual, and hardly anything is simulated.
"""

import json
import signal
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from awkward_touches import INTERVAL, N_SAMPLES, list_trials, make_antenna, make_set
from tensors._sets import CONFIGURATION, make_trial

import feeler
from feeler import files as disk
from feeler.errors import (
    AccuracyWarning,
    InvalidInput,
    ModelValidityWarning,
    OutOfMemory,
    SimulationDivergedError,
    StoreError,
)
from feeler.execute import ProcessExecutor, processes, run_batch
from feeler.execute.batch import _window
from feeler.experiments import mechanics as impulse
from feeler.experiments import runner as gather
from feeler.experiments import runner as job
from feeler.experiments import tactile as touch
from feeler.experiments.mechanics import release
from feeler.physics.contact import get_contact
from feeler.physics.scene import Clock
from feeler.presets import make_preset
from feeler.tensors import store as folder
from feeler.tensors.store import find_inner, open_store, read_store, write_group
from feeler.tensors.transforms import label_like, project_planes, scale_common, stack_planes

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
    return job.WorkerTask(**known | more)


class Variants(list):
    """Antennas that differ in their names and in one number."""

    @property
    def columns(self):
        """Of each number, those of all antennas."""
        return {"scale": np.array([0.7, 1.1, 1.9])}


SPATIAL = make_preset("rat-whisker")
PLANES = len(SPATIAL.planes)
VARIANTS = Variants(make_antenna().replace(name=name) for name in ("a", "b", "c"))


def spawn(seed, index):
    sequence = np.random.SeedSequence(seed, spawn_key=(index,))
    return int(sequence.generate_state(1, np.uint32)[0])


def test_trial_k_touches_antenna_k_modulo_their_number_and_says_so():
    own = make_job(variants=VARIANTS)
    assert [own.get_antenna(k).name for k in (7, 2, 3)] == ["b", "c", "a"]
    labels = own._label_antennas([7, 2, 3])
    assert labels == {
        "antenna": ["awkward 1", "awkward 2", "awkward 0"],
        "antenna_scale": [1.1, 1.9, 0.7],
    }


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


def test_a_worker_simulates_each_trial_with_its_own_antenna_and_what_all_share(monkeypatch):
    """Lanes come in another order than trials, and one of them fails."""
    asked, reduced = [], []
    contact = get_contact("hard")
    motions = [object.__new__(job.Motion) for _ in range(3)]
    monkeypatch.setattr(job, "make_scene", lambda *given: asked.append(given) or len(asked) - 1)
    monkeypatch.setattr(job, "make_groups", lambda scenes, engine, times: [[2, 0], [1]])

    def run(scenes, clock, engine, accuracy):
        assert (clock, engine, accuracy) == (own.clock, own.engine, 0.02)
        return [ValueError(k) if k == 0 else motions[k] for k in scenes]

    monkeypatch.setattr(job, "run_lanes", run)
    monkeypatch.setattr(job, "reduce_motion", lambda *given: reduced.append(given) or given[1])
    own = make_job(
        variants=VARIANTS,
        contact=contact,
        flow="flow",
        accuracy=0.02,
        save=["tip"],
        dtype="float32",
    )
    done = own.perform(([7, 2, 3], ["t7", "t2", "t3"], None))
    assert asked == [
        (VARIANTS[k], trial, contact, "flow") for k, trial in ((1, "t7"), (2, "t2"), (0, "t3"))
    ]
    assert done.readings == {3: motions[2], 2: motions[1]}
    assert {index: error.args for index, error in done.errors.items()} == {7: (0,)}
    assert all(given[2:] == (["tip"], "float32") for given in reduced)


@pytest.mark.parametrize(
    ("antenna", "save", "dtype", "numbers"),
    [
        (make_antenna(), ["angle"], "float64", 5 * N_SAMPLES),
        (make_antenna(), ["angle", "tip"], "float32", 7 * N_SAMPLES),
        (SPATIAL, ["angle"], "float64", PLANES * SPATIAL.sensors.size * N_SAMPLES),
        (SPATIAL, ["tip"], "float32", (PLANES * SPATIAL.sensors.size + 3) * N_SAMPLES),
    ],
)
def test_a_trial_s_bytes_are_counted_by_what_is_saved_of_it(antenna, save, dtype, numbers):
    own = make_job(antenna=antenna, save=save, dtype=dtype)
    blank = own.make_blank()
    assert sum(values.nbytes for values in blank.values()) == np.dtype(dtype).itemsize * numbers


def test_a_worker_of_another_feeler_says_which_and_what_is_wanted():
    with pytest.raises(
        StoreError, match=r"with physics 1 \(wanted: feeler 1 with physics 2\)\. Install"
    ):
        job.check_origin(2, {"feeler": "1"})
    job.check_origin(job.PHYSICS, {"feeler": job.find_version("feeler")})


class Told:
    """Progress that keeps what it is told."""

    def __init__(self):
        self.states = []

    def tell(self, **state):
        self.states.append(state)

    def __call__(self, *counts):
        self.states[-1]["done"] = counts


def test_progress_counts_trials_and_bytes_of_all_groups_and_failures_by_their_kind(monkeypatch):
    def stored(index, n_bytes):
        labels = xr.Dataset(coords={"trial": [index]})
        return job.ShareResult(labels=labels, n_bytes=n_bytes)

    failed = job.ShareResult(errors={5: ValueError("a"), 6: ValueError("b")})
    found = [
        ([0, 1, 2, 3], stored(3, 700)),
        ([4, 5, 6], failed),
        ([8, 9], SimulationDivergedError("x", time=1.0)),
        ([7], stored(7, 11)),
    ]
    admitted, told = [], Told()
    monkeypatch.setattr(gather, "run_groups", lambda *given, **how: found)
    monkeypatch.setattr(gather, "check_room", lambda *given: None)
    store = SimpleNamespace(
        finished=np.zeros(10, bool),
        path="p",
        group_size=4,
        create=lambda like: None,
        admit=lambda indices, labels: admitted.append(indices),
    )
    own = make_job(save=["angle"])
    _, errors = gather.run_trials(own, list_trials()[:1] * 10, store, None, told)
    assert [state["done"] for state in told.states] == [(4, 10), (7, 10), (9, 10), (10, 10)]
    assert [state["stored"] for state in told.states] == [700, 700, 700, 711]
    assert told.states[-1]["failed"] == {"ValueError": 2, "SimulationDivergedError": 2}
    assert sorted(errors) == [5, 6, 8, 9] and admitted == [[3], [7]]


def test_groups_are_what_is_not_finished_of_each_and_whole_ones_are_ranges():
    """Groups of four of ten trials: of the last there are two."""
    finished = np.zeros(10, bool)
    groups = gather.list_missing(finished, 4)
    assert groups == [range(4), range(4, 8), range(8, 10)]
    finished[[1, 4, 5, 6, 7, 9]] = True
    assert gather.list_missing(finished, 4) == [[0, 2, 3], [8]]


def test_what_lacks_room_is_what_is_not_finished(tmp_path, monkeypatch):
    told, own = [], make_job(save=["tip"], dtype="float32")
    monkeypatch.setattr(gather, "check_room", lambda *given: told.append(given))
    monkeypatch.setattr(gather, "run_groups", lambda *given, **how: [])
    with open_store(tmp_path / "a.zarr", {}, 3) as store:
        store.finished[1] = True
        gather.run_trials(own, list_trials(), store, None, Told())
    n_bytes = 4 * (5 + 2) * N_SAMPLES
    assert told == [(tmp_path / "a.zarr", 2 * n_bytes, "2 trials")]


def test_how_many_touches_missed_their_accuracy_is_told():
    labels = {name: ("trial", [0.1, 0.2, 0.3, 0.4]) for name in ("location", "speed")}
    labels |= {"trial": [7, 8, 9, 10], "feature": ("trial", ["ball"] * 4)}
    tensors = xr.Dataset({"error": ("trial", [0.001, np.inf, 0.05, 0.02])}, labels)
    words = (
        r"2 of 4 .* reach accuracy=0\.03 \(8: ball at 0.2 L, 0.2 m/s; 9: .*, 0.05 of the peak\)"
    )
    with pytest.warns(AccuracyWarning, match=words):
        touch._warn(tensors, 0.03, get_contact(), fixed=False)


def test_the_fastest_of_a_set_is_what_a_timestep_must_follow(monkeypatch):
    asked = []
    monkeypatch.setattr(
        touch,
        "list_validity_warnings",
        lambda *given, fixed: asked.append(given[2:]) or ["fast"],
    )
    clock = make_job().clock
    with pytest.warns(ModelValidityWarning, match="fast"):
        touch._warn_of_speed(make_antenna(), list_trials(), get_contact(), clock, fixed=True)
    assert asked == [(0.61, STEP)]


def test_one_moving_base_among_others_is_recorded():
    first, second, moving = list_trials()
    for trials, moved in (([first, moving, second], True), ([first, second], False)):
        assert touch._survey(make_antenna(), trials) is moved


def test_of_several_errors_the_first_trial_s_is_raised_with_what_the_others_gave(
    monkeypatch, tmp_path
):
    monkeypatch.setattr(touch.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(touch.tempfile, "tempdir", str(tmp_path))
    for k in range(7):
        errors = {
            9: ValueError("later"),
            4: SimulationDivergedError(
                "x", 2.5, angle=np.full(3, 0.1 * k), velocity=np.full(3, -2.0)
            ),
        }
        with pytest.raises(SimulationDivergedError, match=r"diverged at 2\.5 ms") as caught:
            touch._hand_over("others", errors)
    assert caught.value.tensors == "others"
    kept = np.load(caught.value.state_file)
    np.testing.assert_allclose(kept["angle"], 0.6)
    np.testing.assert_allclose(kept["velocity"], -2.0)
    assert kept["time"] == 2.5
    assert len([*tmp_path.glob("feeler-diverged-*.npz")]) == touch._KEEP


def test_a_set_says_what_it_was_made_with():
    own = touch._describe_attributes(
        make_antenna(), make_job().clock, get_contact(), "chain", 17, 0.02, {"flow": 3}
    )
    told = own["configuration"]
    names = ("seed", "accuracy", "flow", "engine", "units")
    assert [told[name] for name in names] == [17, 0.02, 3, "chain", "g, mm, ms"]
    assert (own["engine"], own["timestep"], own["timestep_units"]) == ("chain", STEP, "ms")


def test_a_release_says_where_and_how_far_it_was_held():
    antenna = make_antenna()
    tensors = release(antenna, at=7.0, deflection=0.4, duration=3.0, sample_interval=0.5)
    assert tensors["location"].values == pytest.approx([7.0 / antenna.length])
    told = json.loads(tensors.attrs["configuration"])
    assert (told["at"], told["deflection"]) == (7.0, 0.4)
    assert tensors["angle"].sizes == {"trial": 1, "sensor": 11, "time": 6}
    with pytest.raises(InvalidInput, match=r"smaller than `at` = 0\.3 mm, got 0\.4 mm"):
        release(antenna, at=0.3, deflection=0.4)
    with pytest.raises(InvalidInput, match=r"angle must be 11 finite numbers .* shape \(3,\)"):
        release(antenna, angle=np.zeros(3))


def test_a_hit_is_as_long_as_its_cylinder_travels_and_has_its_own_friction(monkeypatch):
    asked = []
    monkeypatch.setattr(impulse, "run_scene", lambda *given: asked.append(given))
    monkeypatch.setattr(impulse, "measure_impulse", lambda scene, motion, points: points)
    antenna = make_antenna()
    assert impulse.hit(antenna, speed=0.4, friction=0.3, points=(0.2, 0.9, 1.0)) == (
        0.2,
        0.9,
        1.0,
    )
    impulse.hit(antenna, duration=11.0, engine="chain", timestep=0.01, radius=1.7)
    (scene, clock, _), (second, short, other) = asked
    assert clock.duration == pytest.approx(0.6 * antenna.length / 0.4 + 80.0 + 2.0)
    assert (short.duration, short.timestep, other) == (13.0, 0.01, "chain")
    cylinder, larger = scene.objects[0], second.objects[0]
    assert cylinder.friction == 0.3 and larger.friction != 0.3
    assert (cylinder.feature.rounding, larger.feature.rounding) == (2.5, 1.7)
    np.testing.assert_allclose(np.linalg.norm(cylinder.velocity), 0.4)


def test_a_lever_swings_away_from_the_base_and_its_cylinder_s_middle_is_behind_its_front():
    antenna = make_antenna()
    scene = impulse.make_impulse_scene(antenna, speed=0.4, lever=9.0)
    quarter = 9.0 * np.pi / 2 / 0.4
    time = np.array([0.0, 2.0, 2.0 + quarter, 12.0 + quarter])
    motion = SimpleNamespace(time=time, angle=np.zeros((4, 11)), force=np.zeros((4, 2)))
    moved = impulse.measure_impulse(scene, motion)
    forward = np.asarray(scene.objects[0].forward)
    start = np.asarray(scene.objects[0].place) - 2.5 * forward
    ways = moved.object - start
    along = np.column_stack([ways @ forward, ways[:, 1]])
    wanted = [[0, 0], [0.8, 0], [0.8 + 9.0, 9.0], [0.8 + 9.0, 9.0 + 4.0]]
    np.testing.assert_allclose(along, wanted, atol=0.1)  # in 36 legs
    np.testing.assert_allclose(moved.time, time - 2.0)


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


def test_processes_say_how_many_they_are_and_share_what_is_free(monkeypatch):
    monkeypatch.setattr(processes, "_find_free_memory", lambda: 10 * 2**30)
    for workers, words in (
        (1, "1 process, at most 8.0 GiB each"),
        (2, "2 processes, at most 4.0"),
    ):
        assert ProcessExecutor(workers).describe().startswith(words)
    limited = ProcessExecutor(3, memory_limit=3 * 2**29)
    assert limited.describe() == "3 processes, at most 1.5 GiB each"
    with pytest.raises(InvalidInput, match=r"at least 67,108,864 bytes \(64 MiB\), got 5"):
        ProcessExecutor(1, memory_limit=5)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (-9, "killed by SIGKILL before it had answered. The system may have run out of memory"),
        (-11, "killed by SIGSEGV before it had answered."),
        (9, "with exit code 9 before it had answered."),
        (0, "with exit code 0 before it had answered."),
    ],
)
def test_how_a_worker_ended_is_told_and_memory_blamed_for_a_kill_alone(code, words):
    said = str(processes._explain_end(code))
    assert words in said and ("memory" in said) is (code == -9)


def test_an_aborted_worker_is_one_without_memory():
    assert isinstance(processes._explain_end(-signal.SIGABRT), OutOfMemory)


def test_two_items_a_worker_are_in_flight_and_of_unknown_workers_64_are_taken():
    counts = [
        _window(SimpleNamespace(**of)) for of in ({"workers": 3}, {"_max_workers": 5}, {})
    ]
    assert counts == [6, 10, 128]
    with pytest.raises(InvalidInput, match="retries must be ≥ 0 and window ≥ 1, got 2 and 0"):
        next(run_batch(str, [], retries=2, window=0))


def test_trials_come_in_any_order_and_each_keeps_its_own(tmp_path):
    path, made = tmp_path / "a.zarr", [{"speed": k} for k in range(8)]
    trials = xr.concat(
        [make_trial(k) for k in (6, 2, 4)], "trial", data_vars="minimal", coords="minimal",
        compat="override",
    )  # fmt: skip
    with open_store(path, CONFIGURATION, 8, group_size=4, made=made) as store:
        store.append([6, 2, 4], trials)
        store.append(5, make_trial(5))
    found = read_store(path)
    assert found["location"].values == pytest.approx([0.2, 0.4, 0.5, 0.6])
    assert found["feature"].values.tolist() == ["triangle", "ball", "box", "triangle"]
    assert [one["speed"] for one in json.loads(found.attrs["trials"])] == [2, 4, 5, 6]
    for row, index in enumerate((2, 4, 5, 6)):
        np.testing.assert_array_equal(found["tip"][row], make_trial(index)["tip"][0])


def test_what_a_group_takes_on_disk_is_all_of_its_shards(tmp_path):
    path = tmp_path / "a.zarr"
    with open_store(path, CONFIGURATION, 6, group_size=4) as store:
        store.create(make_trial(0))
        n_bytes = write_group(path, [5], make_trial(5))
        files = [*path.glob("*/c.1.0.0")]
        assert len(files) == 3 and n_bytes == sum(file.stat().st_size for file in files)
        assert not store.finished.any()


def test_a_worker_that_sees_no_store_says_so(tmp_path):
    with pytest.raises(StoreError, match=r"sees no store at .*a\.zarr.*shared by all workers"):
        write_group(tmp_path / "a.zarr", [5], make_trial(5))


def test_a_damaged_last_group_is_called_by_the_trials_that_there_are(tmp_path):
    path = tmp_path / "a.zarr"
    with open_store(path, CONFIGURATION, 6, group_size=4, made=[*"abcdef"]) as store:
        for index in (5, 0, 4):
            store.append(index, make_trial(index))
        assert np.flatnonzero(store.finished).tolist() == [0, 4, 5]
    shard = path / "angle" / "c.1.0.0"
    shard.write_bytes(shard.read_bytes()[:-1] + b"?")
    words = r"trials 4 to 5 will be computed again: .*c\.1\.0\.0 is missing or damaged"
    with (
        pytest.warns(UserWarning, match=words),
        open_store(path, CONFIGURATION, 6, group_size=4) as store,
    ):
        assert np.flatnonzero(store.finished).tolist() == [0]


def test_a_disk_that_is_full_says_what_is_safe(tmp_path, monkeypatch):
    path = tmp_path / "a.zarr"
    with open_store(path, CONFIGURATION, 9, group_size=4) as store:
        store.append(0, make_trial(0))

        def fail(*_, **how):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("feeler.tensors.store.write_atomic", fail)
        pair = xr.concat([make_trial(5), make_trial(7)], "trial", data_vars="minimal",
                         coords="minimal", compat="override")  # fmt: skip
        with pytest.raises(StoreError, match="trials 5 to 7 are not stored; the finished ones"):
            store.append([5, 7], pair)
        monkeypatch.setattr("feeler.tensors.store.write_atomic", fail)
        with pytest.raises(StoreError, match="trials 2 to 2 are not stored; the finished ones"):
            store.append(2, make_trial(2))
        monkeypatch.undo()
        assert np.flatnonzero(store.finished).tolist() == [0]


def test_differences_are_told_from_stored_to_asked_and_cut_at_their_ends():
    stored = {"a": {"b": [1, 2.5]}, "c": "x" * 80, "e": 1}
    asked = {"a": {"b": [1, 3.5]}, "d": None, "c": "y" * 80, "e": 1}
    assert folder.find_differences(stored, asked) == [
        "a.b[1]: 2.5 → 3.5",
        'c: "' + "x" * 56 + '… → "' + "y" * 56 + "…",
    ]
    many = folder.find_differences(dict.fromkeys("abcdefgh", 1), dict.fromkeys("abcdefgh", 2))
    assert many == [f"{name}: 1 → 2" for name in "abcde"]


def test_chunks_are_whole_parts_of_their_groups():
    for group, inner in ((8, 8), (32, 32), (40, 20), (45, 15), (64, 32), (67, 1)):
        assert find_inner(group) == inner


def test_a_folder_is_as_large_as_all_that_is_in_it(tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    for name, size in (("x", 3), ("a/y", 50), ("a/b/z", 700)):
        (tmp_path / name).write_bytes(bytes(size))
    (tmp_path / "link").symlink_to(tmp_path / "a" / "b" / "z")
    assert disk.measure_folder(tmp_path) == 753


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


def test_a_set_is_scaled_by_its_greatest_magnitude_whichever_its_sign():
    tensors = make_spatial()
    low = tensors.copy()
    low[1, 2, 3, 4] = -9.0
    for given in (low, low.values):
        scaled = scale_common(given)
        np.testing.assert_allclose(scaled, low.values / 9.0)
    with pytest.raises(InvalidInput, match=r"greatest magnitude is 0\.0; did any contact"):
        scale_common(np.zeros((1, 2, 3)))


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


def test_a_word_of_a_dataset_shows_what_was_asked_for(monkeypatch):
    """Its trial, variable, axes and movie's options, of the antenna that it was made with."""
    from feeler.plotting import results

    told = []
    monkeypatch.setattr(
        results, "plot_trial", lambda *given: told.append(given) or SimpleNamespace(figure="f")
    )
    monkeypatch.setattr(
        results, "write_trial_movie", lambda *given, **how: told.append((*given, how))
    )
    tensors = make_set()
    assert tensors.feeler.plot(2, "angle", "ax") == "f"
    assert told[-1][1:] == (2, "angle", "ax")
    tensors.feeler.movie("a.mp4", 1, slower=9.0)
    _, antenna, path, trial, how = told[-1]
    assert (antenna, str(path), trial, how) == (make_antenna(), "a.mp4", 1, {"slower": 9.0})
    other = make_antenna().replace(name="other")
    tensors.feeler.movie("a.mp4", antenna=other)
    assert told[-1][1] == other and told[-1][3] == 0
    points = tensors.feeler.posture()
    assert points.sizes == {"trial": 3, "time": N_SAMPLES, "joint": 12, "axis": 2}
