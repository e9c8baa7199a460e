"""The network: the paper's layers, seeded, honest early stopping, weights without pickle."""

import numpy as np
import pytest

from feeler.decoding.network import TouchNetwork, _make_network
from feeler.errors import InvalidInput

SHAPE = (14, 20)
QUICK = {"shape": SHAPE, "max_epochs": 6, "batch_size": 8}


def make_touches(n_each=12, seed=0):
    """Three classes: a blob in another place each."""
    rng = np.random.default_rng(seed)
    sensor, time = np.mgrid[: SHAPE[0], : SHAPE[1]]
    blobs = [
        np.exp(-((sensor - s) ** 2 + (time - t) ** 2) / 8)
        for s, t in ((3, 4), (7, 10), (11, 16))
    ]
    return np.tile(blobs, (n_each, 1, 1)) + 0.1 * rng.normal(
        size=(3 * n_each, *SHAPE)
    ), np.tile(list("abc"), n_each)


@pytest.fixture(scope="module")
def trained():
    pytest.importorskip("torch")
    return TouchNetwork(**QUICK | {"max_epochs": 2}).fit(*make_touches())


def test_layers_are_the_papers():
    torch = pytest.importorskip("torch")
    with torch.device("meta"):  # shapes alone
        network = _make_network(torch, (56, 380), 30)
        answer = network(torch.zeros(2, 1, 56, 380))
    shapes = [tuple(p.shape) for p in network.parameters()]
    assert shapes == [
        (32, 1, 15, 15),
        (32,),
        (32,),
        (32,),
        (50, 32 * 23 * 185),
        (50,),
        (30, 50),
        (30,),
    ]
    kinds = [type(layer).__name__ for layer in network]
    assert kinds == [
        "Conv2d",
        "BatchNorm2d",
        "MaxPool2d",
        "ReLU",
        "Flatten",
        "Linear",
        "Dropout",
        "Linear",
    ]
    assert answer.shape == (2, 30)


def test_pooling_before_the_relu_changes_no_answer_and_no_gradient():
    torch = pytest.importorskip("torch")
    torch.manual_seed(3)
    ours = _make_network(torch, SHAPE, 3).eval()
    papers = torch.nn.Sequential(
        *(ours[k] for k in (0, 1, 3, 2, 4, 5, 6, 7))
    )  # the ReLU before the pooling
    images, answers = torch.randn(5, 1, *SHAPE), []
    for network in (ours, papers):
        network.zero_grad()
        scores = network(images)
        scores.square().sum().backward()
        answers.append([scores.detach(), *(p.grad.clone() for p in ours.parameters())])
    for mine, theirs in zip(*answers, strict=True):
        torch.testing.assert_close(mine, theirs)


@pytest.mark.long
def test_touches_are_learned_and_equal_seeds_give_equal_weights():
    torch = pytest.importorskip("torch")
    torch.manual_seed(5)
    before = torch.random.get_rng_state()
    models = [TouchNetwork(**QUICK, random_state=s).fit(*make_touches()) for s in (1, 1, 2)]
    assert (
        torch.random.get_rng_state() == before
    ).all()  # the caller's generator is left alone
    weights = [model.network_[0].weight.detach().cpu().numpy() for model in models]
    np.testing.assert_array_equal(weights[0], weights[1])
    assert (weights[0] != weights[2]).any()
    X, y = make_touches(seed=9)
    assert (models[0].predict(X) == y).mean() > 0.9
    np.testing.assert_allclose(models[0].predict_proba(X).sum(axis=1), 1, atol=1e-5)


def test_training_stops_on_the_validation_part_and_keeps_its_best():
    pytest.importorskip("torch")
    X, y = make_touches()
    y = np.random.default_rng(0).permutation(y)  # nothing to learn: validation loss soon rises
    model = TouchNetwork(shape=SHAPE, max_epochs=60, patience=2, batch_size=8).fit(X, y)
    assert model.n_epochs_ == model.best_epoch_ + 3 < 60
    assert model.validation_loss_.argmin() == model.best_epoch_


def test_normalisation_does_not_see_the_validation_part():
    pytest.importorskip("torch")
    X, y = make_touches()
    model = TouchNetwork(**QUICK | {"max_epochs": 1})
    _, targets = np.unique(y, return_inverse=True)
    train, validate = model._split(targets)
    assert not set(train) & set(validate) and set(targets[validate]) == {0, 1, 2}
    X[validate] += 100.0
    model.fit(X, y)
    assert model.mean_.max() < 10


def test_weights_survive_the_disk(trained, tmp_path):
    X, _ = make_touches()
    trained.save(tmp_path / "touch.safetensors")
    loaded = TouchNetwork.load(tmp_path / "touch.safetensors", device="cpu")
    np.testing.assert_allclose(loaded.predict_proba(X), trained.predict_proba(X), atol=1e-6)
    assert loaded.get_params() == trained.get_params() | {"device": "cpu"}


@pytest.mark.parametrize(
    ("model", "labels", "message"),
    [
        (TouchNetwork(**QUICK), np.zeros(36), "only one class"),
        (TouchNetwork(**QUICK), np.arange(5), "36 tensors but 5 labels"),
        (TouchNetwork((10, 28)), np.arange(36), "at least 12 × 12"),
        (TouchNetwork((56, 380)), np.arange(36), "do not have the shape"),
        (TouchNetwork(SHAPE, validation_share=0.0), np.arange(36), "validation_share"),
    ],
)
def test_bad_input_is_refused(model, labels, message):
    pytest.importorskip("torch")
    with pytest.raises(InvalidInput, match=message):
        model.fit(make_touches()[0], labels)


def test_another_version_or_a_damaged_file_says_so(trained, tmp_path):
    from feeler.tensors.formats import Model, _read_model, save_model

    trained.save(tmp_path / "good")
    good = _read_model(tmp_path / "good")
    later = Model(
        kind=good.kind, version=good.version + 1, arrays=good.arrays, settings=good.settings
    )
    arrays = {name: values for name, values in good.arrays.items() if "bias" not in name}
    save_model(later, tmp_path / "later")
    save_model(
        Model(kind=good.kind, version=good.version, arrays=arrays, settings=good.settings),
        tmp_path / "part",
    )
    save_model(Model(kind="lda", version=1), tmp_path / "lda")
    for name, words in {
        "later": "holds version 2",
        "part": "no complete TouchNetwork",
        "lda": "of kind 'lda'",
    }.items():
        with pytest.raises(InvalidInput, match=words):
            TouchNetwork.load(tmp_path / name, device="cpu")


@pytest.mark.long
def test_a_tracker_gets_each_epoch_with_its_loss_and_may_end_the_training():
    pytest.importorskip("torch")
    X, y = make_touches()
    network, logged = TouchNetwork(**QUICK | {"max_epochs": 3}), []

    def log(done, total):
        logged.append((done, total, network.validation_loss_[-1]))

    network.fit(X, y, progress=log)
    losses = [*zip(range(1, 4), [3] * 3, network.validation_loss_, strict=False)]
    assert logged == losses[: network.n_epochs_]

    class PrunedError(Exception):
        """As Optuna's."""

    def prune(done, total):
        if done == 2:
            raise PrunedError

    with pytest.raises(PrunedError):
        network.fit(X, y, progress=prune)
    assert network.n_epochs_ == 2
