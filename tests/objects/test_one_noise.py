"""A noise added in one place works wherever noise is added: by sd alone, or by add alone."""

import numpy as np
import pytest
import xarray as xr

import feeler
from feeler.active import Arena, TouchTask
from feeler.decoding import IdealObserver, TemplateClassifier, compute_sweep
from feeler.design import DesignTask, load_plan, measure_sensors, score
from feeler.objects import NOISES, Noise, Task
from feeler.tradeoff import load_declared

from .test_noise import Dropout

ANTENNA = feeler.Antenna(
    segment_length=np.full(6, 4.0), segment_mass=2e-4, radius=0.3, stiffness=0.3, damping=2.0
)
OBJECTS = (feeler.Ball(radius=1.5), feeler.Box(half_width=1.5, half_height=1.5))


class Proportional(Noise):
    """Gaussian; each entry has an sd of its own."""

    def sd(self, tensors):
        return 5 * self.size**2 * (np.abs(tensors) + 0.01)


@pytest.fixture(params=[Proportional, Dropout], ids=["by its sd", "by its draws"])
def name(request):
    NOISES.register("ours", request.param)
    yield "ours:0.3"
    NOISES.unregister("ours")


def make_bumps(n=6):
    time, place = np.arange(60), np.linspace(15, 45, n)[:, None]
    return np.exp(-0.5 * ((time - place) / 2) ** 2)[:, None, :] * np.ones((1, 4, 1))


def make_design(noise):
    return DesignTask(
        objects=OBJECTS,
        locations=(0.6, 0.9),
        speeds=(0.6,),
        deadline=15.0,
        train=2,
        test=2,
        noise=noise,
    )


def test_a_noise_registered_once_works(name):
    """In tasks and sweeps: the more of it, the fewer are discriminated."""
    noise = Task(noise=name).noise
    sweep = compute_sweep(
        make_bumps(), np.arange(6), ratios=(0.0, 0.95), n_repeats=2, n_copies=5, noise=noise
    )
    assert sweep.noisy[0].mean() == 1.0 > sweep.noisy[1].mean()


def test_in_classifiers_that_know_their_noise(name):
    noise = Task(noise=name).noise
    touches = np.concatenate([make_bumps(), 1.1 * make_bumps()]) + 0.01
    labels = np.tile(np.arange(6), 2)
    noisy = noise.add(touches, np.random.default_rng(0))
    for classifier in (IdealObserver(noise), TemplateClassifier(noise)):
        assert classifier.fit(touches, labels).score(noisy, labels) > 0.5


def test_in_designs(name):
    found = score(ANTENNA, make_design(name), workers=1)
    assert found.bits < 2 and found.errors < 0.75
    more = score(ANTENNA, make_design(name.replace("0.3", "0.95")), workers=1)
    assert more.errors > found.errors
    assert np.isfinite(measure_sensors(ANTENNA, make_design(name), [1, 3])).all()


def test_in_design_files_of_the_command_line(name, tmp_path):
    feeler.save_antenna(ANTENNA, tmp_path / "small.toml")
    path = tmp_path / "design.toml"
    path.write_text(
        f'schema = "feeler.design/1"\nantenna = "small.toml"\n[task]\nnoise = "{name}"\n'
    )
    assert str(load_plan(path).task.noise) == name


def test_in_the_trade_off(name):
    study = load_declared(
        sets=1, speeds=(0.6,), levels={"ours": (0.3,)}, draws=3, objects=OBJECTS
    )
    found = study.run({"a": feeler.presets.cockroach()}, workers=1)
    assert found["level"].values.tolist() == ["ours 0.3"] and (found["bits"] > 0).any()


def test_in_active_touch(name):
    task = TouchTask(features=OBJECTS, pool=4, duration=30.0, noise=name)
    arena = Arena(task, n=1)
    arena.begin(0, np.random.default_rng(0))
    assert np.isfinite(arena.observe()["angle"]).all()


def test_in_what_networks_learn_from(name):
    from feeler.learn import TouchDataset  # loads PyTorch, which collecting need not

    values = make_bumps()
    store = xr.Dataset({"angle": (("trial", "sensor", "time"), values)})
    clean, noisy = (TouchDataset(store, noise=n)[0] for n in (0.0, name))
    assert clean.shape == noisy.shape and not np.array_equal(clean, noisy)
