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


@pytest.mark.parametrize(
    ("workers", "drop_last", "batch_size"),
    [
        (0, False, 50),
        (0, False, 64),
        (0, True, 50),
        (0, True, 64),
        pytest.param(2, False, 64, marks=pytest.mark.long),
    ],
)
def test_batches_are_as_many_and_as_large_as_is_said(
    store, workers, drop_last, batch_size, torch
):
    """A scheduler of ``len(loader)`` steps has as many; each touch comes once with its target."""
    how = {"batch_size": batch_size, "drop_last": drop_last}
    batches = learn.TouchBatches(store, target="size", **how)
    loader = torch.utils.data.DataLoader(batches, batch_size=None, num_workers=workers)
    sizes = [len(x) for x, _ in loader]
    assert len(sizes) == len(loader) == N // batch_size + (not drop_last and N % batch_size > 0)
    assert sorted(sizes)[1:] == [batch_size] * (len(sizes) - 1)
    trials, targets = collect(loader)
    assert len({*trials}) == len(trials) == sum(sizes)
    assert drop_last or sorted(trials) == [*range(N)]
    assert (np.diff(trials) < 0).mean() > 0.3  # shuffled
    np.testing.assert_allclose(targets, make_touches()["size"].values[trials], rtol=1e-6)


@pytest.mark.further
@pytest.mark.parametrize("drop_last", [False, True])
def test_ranks_read_equally_many_batches_and_all_touches_between_them(store, drop_last):
    def read(rank, epoch=0):
        batches = learn.TouchBatches(
            store, "size", batch_size=50, drop_last=drop_last, rank=rank, world_size=5
        )
        batches.set_epoch(epoch)
        found = [*batches]
        assert len(found) == len(batches) == (2 if drop_last else 3)
        return collect(found)[0]

    found = [read(rank) for rank in range(5)]
    together = np.concatenate(found)
    assert len({*together}) == (500 if drop_last else 600)
    np.testing.assert_array_equal(read(3), found[3])
    assert (read(3, epoch=1) != found[3]).any()


def test_touches_are_found_by_number_as_pytorch_s_tools_ask(store, torch):
    data = torch.utils.data
    dataset = learn.TouchDataset(store, target="size", transform=lambda x: 2 * x)
    size = make_touches()["size"].values
    assert len(dataset) == N
    x, y = dataset[417]
    assert x.shape == (4, 5)
    assert x[0, 0] == 2 * 417
    assert y == pytest.approx(size[417])
    assert dataset[-1][0][0, 0] == 2 * (N - 1)
    with pytest.raises(IndexError, match="touch 600 of 600"):
        dataset[N]
    parts = data.random_split(dataset, [0.75, 0.25], torch.Generator().manual_seed(0))
    loaders = [data.DataLoader(part, batch_size=32, shuffle=True) for part in parts]
    assert [len(loader) for loader in loaders] == [15, 5]
    trials = [collect(loader)[0] // 2 for loader in loaders]
    assert sorted(np.concatenate(trials)) == [*range(N)]
    some = data.DataLoader(data.Subset(dataset, [5, 500, 7]), batch_size=3, num_workers=1)
    assert collect(some)[0].tolist() == [10, 1000, 14]
    labels = learn.TouchDataset(store, target="feature").targets.numpy()
    sampler = data.WeightedRandomSampler((labels == 0).astype(float), 40)
    drawn = collect(data.DataLoader(dataset, batch_size=8, sampler=sampler))[0] // 2
    assert (labels[drawn] == 0).all()


def test_epochs_differ_and_the_order_follows_the_seed(store, torch):
    dataset = learn.TouchBatches(store, target="size", batch_size=50)
    torch.manual_seed(0)
    first, second = collect(dataset)[0], collect(dataset)[0]
    torch.manual_seed(0)
    assert (collect(dataset)[0] == first).all() and (first != second).any()


def test_texts_become_classes_and_several_of_them_their_combinations(store):
    dataset = learn.TouchDataset(store, target="feature")
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
    whole = {"batch_size": N, "shuffle": False}
    dataset = learn.TouchBatches(store, noise=0.5, **whole)
    clean = dataset.read(slice(None))
    one, two = (torch.cat([*dataset]) - clean for _ in range(2))
    singly = torch.stack(learn.TouchDataset(store, noise=0.5).__getitems__([*range(N)])) - clean
    for noise in (one, singly):
        assert noise.std().item() == pytest.approx(0.5, rel=0.05)
        assert abs(np.corrcoef(noise.flatten(), two.flatten())[0, 1]) < 0.05
    assert torch.equal(dataset.read(slice(None)), clean)
    doubled = learn.TouchBatches(store, noise=lambda x, rng: 2 * x, **whole)
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
    dataset = learn.TouchBatches(
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
        ({"rank": 2, "world_size": 2}, r"rank must lie in 0 … world_size − 1, got 2 of 2"),
        (
            {"batch_size": 200, "rank": 0, "world_size": 4},
            "are 3 batches of 200, fewer than the 4",
        ),
    ],
)
def test_what_the_store_does_not_have_is_refused(store, options, words):
    with pytest.raises(InvalidInput, match=words):
        learn.TouchBatches(store, **options)


def test_each_side_has_a_group_and_neither_rounding_nor_nan_parts_or_joins_any():
    """A place that is known to single precision is the same place; one that is not known is a
    group beside those that are.
    """
    touches = make_touches(100)
    sides = learn.split_trials(touches, "location", shares={"a": 0.4, "b": 0.01, "c": 0.59})
    assert {*sides} == {"a", "b", "c"}
    places = np.resize([0.3, 0.5, 0.7, 0.9], 100)
    places[50:] = places[50:].astype(np.float32)
    parted = learn.split_trials(touches.assign_coords(location=("trial", places)), "location")
    assert all(len({*parted[np.abs(places - place) < 1e-6]}) == 1 for place in places)
    places = np.linspace(0.2, 0.9, 100)
    places[::3] = np.nan
    halves = {"train": 0.5, "test": 0.5}
    parted = learn.split_trials(
        touches.assign_coords(location=("trial", places)), "location", shares=halves
    )
    assert len({*parted[::3]}) == 1
    assert {*parted[np.isfinite(places)]} == {*halves}
