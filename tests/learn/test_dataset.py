"""Every trial once an epoch, with its own target, whatever workers, and no twin on two sides."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from feeler import learn
from feeler.errors import InvalidInput

from .conftest import N, make_touches


@pytest.fixture(scope="module", autouse=True)
def torch():
    """PyTorch, loaded by the tests and not where they are collected."""
    return pytest.importorskip("torch", reason="needs the extra `cnn`")


def collect(loader):
    """Which trials came, and their targets."""
    pairs = [(x.reshape(len(x), -1)[:, 0].numpy(), y.numpy()) for x, y in loader]
    return np.concatenate([x for x, _ in pairs]).astype(int), np.concatenate(
        [y for _, y in pairs]
    )


@pytest.mark.parametrize("workers", [0, 2])
@pytest.mark.parametrize("batch_size", [None, 50])
def test_each_trial_comes_once_with_its_own_target(store, workers, batch_size, torch):
    dataset = learn.TouchDataset(store, target="size", batch_size=batch_size)
    loader = torch.utils.data.DataLoader(
        dataset, batch_size=50 if batch_size is None else None, num_workers=workers
    )
    trials, targets = collect(loader)
    assert sorted(trials) == [*range(N)]
    assert (np.diff(trials) < 0).mean() > 0.3  # shuffled
    np.testing.assert_allclose(targets, make_touches()["size"].values[trials], rtol=1e-6)


def test_epochs_differ_and_the_order_follows_the_seed(store, torch):
    dataset = learn.TouchDataset(store, target="size", batch_size=50)
    torch.manual_seed(0)
    first, second = collect(dataset)[0], collect(dataset)[0]
    torch.manual_seed(0)
    assert (collect(dataset)[0] == first).all() and (first != second).any()


def test_texts_become_classes_and_several_of_them_their_combinations(store):
    dataset = learn.TouchDataset(store, target="feature", shuffle=False)
    assert dataset.classes == ["ball", "box", "triangle"]
    assert [dataset.classes[k] for k in dataset.targets[:4]] == [
        "ball",
        "box",
        "triangle",
        "ball",
    ]
    both = learn.TouchDataset(store, target=["feature", "antenna"])
    assert both.classes[int(both.targets[31])] == ("box", "exponential 1")
    assert learn.TouchDataset(store, target=["size", "location"]).targets.shape == (N, 2)


def test_noise_is_fresh_and_as_large_as_asked_for(store, torch):
    dataset = learn.TouchDataset(store, noise=0.5, batch_size=N, shuffle=False)
    clean = dataset.read(slice(None))
    one, two = (torch.cat([*dataset]) - clean for _ in range(2))
    assert one.std().item() == pytest.approx(0.5, rel=0.05)
    assert abs(np.corrcoef(one.flatten(), two.flatten())[0, 1]) < 0.05
    doubled = learn.TouchDataset(store, noise=lambda x, rng: 2 * x, batch_size=N, shuffle=False)
    assert torch.equal(torch.cat([*doubled]), 2 * clean)


@pytest.mark.parametrize(
    "by", ["antenna", "feature", "location", "twin", ["feature", "location"]]
)
def test_sides_share_no_group(by):
    tensors = make_touches()
    sides = learn.split_trials(tensors, by)
    assert {*sides} == {"train", "validate", "test"}
    if by == "location":  # held-out stretches of the antenna
        place = tensors.location.values
        cell = (20 * (place - place.min()) / np.ptp(place)).astype(int).clip(max=19)
    else:
        cell = tensors[
            "feature" if by == "feature" else "antenna" if by == "antenna" else "seed"
        ].values
    groups = [{*cell[sides == side].tolist()} for side in ("train", "validate", "test")]
    assert not groups[0] & groups[1] and not groups[0] & groups[2] and not groups[1] & groups[2]


@given(copies=st.integers(2, 4), seed=st.integers(0, 100))
@settings(max_examples=10, deadline=None)
def test_twins_stay_together(copies, seed):
    once = make_touches(60)
    twins = xr.concat([once] * copies, "trial").assign_coords(
        seed=("trial", np.arange(60 * copies))
    )
    sides = learn.split_trials(twins, seed=seed).reshape(copies, 60)
    assert (sides == sides[0]).all()
    assert (sides == "train").mean() == pytest.approx(0.8, abs=0.05)


def test_sides_of_a_dataset_are_read_alone(store):
    sides = learn.split_trials(make_touches(), "antenna")
    dataset = learn.TouchDataset(
        store, target="size", split="test", by="antenna", batch_size=16
    )
    assert sorted(collect(dataset)[0]) == [*np.flatnonzero(sides == "test")]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"target": "taste"},
            r"target='taste' is no coordinate of the trials; valid: antenna, feature",
        ),
        ({"target": "angle"}, "is no coordinate"),
        ({"target": "time"}, "is no coordinate"),
        ({"variable": "time"}, "no variable 'time' of trials; valid: angle, curvature"),
        ({"split": "exam"}, "no side; valid: test, train, validate"),
        ({"split": "train", "by": "colour"}, "by='colour' is no coordinate"),
        (
            {
                "split": "train",
                "by": "feature",
                "shares": {"a": 0.25, "b": 0.25, "c": 0.25, "d": 0.25},
            },
            "too few for 4",
        ),
        ({"split": "train", "shares": {"train": 0.5}}, "add up to 1"),
        ({"noise": -1.0}, "noise must be"),
        ({"batch_size": 0}, "batch_size must be"),
    ],
)
def test_what_the_store_does_not_have_is_refused(store, options, words):
    with pytest.raises(InvalidInput, match=words):
        learn.TouchDataset(store, **options)
