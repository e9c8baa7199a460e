"""The paper's convolutional network on tactile tensors (Fig. S4).

PyTorch is imported only when a network is used.
"""

from pathlib import Path
from typing import Any

import numpy as np
from sklearn.base import clone
from sklearn.model_selection import train_test_split

from feeler.decoding.classifiers import Classifier, check_labels
from feeler.errors import InvalidInput, require_extra
from feeler.progress import show_progress
from feeler.tensors.formats import Model, load_model, save_model
from feeler.tensors.transforms import find_scale

_MODEL_KIND, _MODEL_VERSION = "TouchNetwork", 1
# [P] supplement, CNN layers
_KERNEL, _CHANNELS, _PADDING, _POOL, _HIDDEN, _DROPOUT = 15, 32, 2, 2, 50, 0.25


_PART = 256  # [C] tensors that are converted to single precision at once


class TouchNetwork(Classifier):
    """The paper's convolutional network.

    Convolution 15 × 15 × 32 with padding 2, batch norm, ReLU, max pool 2 × 2, a layer of 50,
    dropout 0.25, one output per class, softmax.

    A scikit-learn classifier of tensors, flat ones too, so that ``compute_sweep`` takes it
    (``n_jobs=1``: PyTorch has threads of its own). Training is seeded; it stops early on a
    validation part of the *training* set, and keeps the weights of the best validation loss.

    Parameters
    ----------
    shape
        (sensor, time) of a tensor, the paper's is (56, 380); None: that of the tensors it is
        fitted on, which flat ones do not have.
    max_epochs, patience, validation_share, batch_size, learning_rate
        Adam; the paper states none of these [C]. Training ends ``patience`` epochs after the best
        validation loss.
    device
        ``auto`` takes a GPU if there is one; or any PyTorch device.
    random_state
        Seed of weights, order and dropout.

    Attributes
    ----------
    classes_, network_, n_epochs_, best_epoch_, validation_loss_ (epoch,), mean_ (sensor · time,),
    scale_

    Notes
    -----
    Paper, supplement, "Other classification methods". Inputs are centred by the training mean
    image, as MATLAB's input layer does, and divided by one training sd.
    """

    def __init__(
        self,
        shape: tuple[int, int] | None = None,
        *,
        max_epochs: int = 30,
        patience: int = 4,
        validation_share: float = 0.2,
        batch_size: int = 32,
        learning_rate: float = 1e-3,
        device: str = "auto",
        random_state: int = 0,
    ):
        self.shape = shape
        self.max_epochs = max_epochs
        self.patience = patience
        self.validation_share = validation_share
        self.batch_size = batch_size
        self.learning_rate = learning_rate
        self.device = device
        self.random_state = random_state

    def fit(self, X, y, progress=None):
        """Train on tensors ``X`` (trial, sensor · time) or (trial, sensor, time).

        ``progress`` is called with the number of epochs done and their number, at most, after each;
        ``validation_loss_`` holds the losses so far. Default: a bar that appears after 5 s.

        Raises
        ------
        MissingDependencyError
            PyTorch is not installed.
        InvalidInput
            Fewer than two classes, labels that do not match, a shape the layers do not fit.
        """
        torch = import_torch()
        self._keep(X, y)
        self.shape_ = self.shape_ if self.shape is None else tuple(self.shape)
        images, y = self._flatten(X), np.asarray(y)
        self._check(images, y)
        self.classes_, targets = np.unique(y, return_inverse=True)
        train, validate = self._split(targets)
        self.mean_ = images[train].mean(axis=0)
        size = find_scale(images)  # squares of tiny and huge numbers are none
        self.scale_ = float(((images[train] - self.mean_) / size).std()) * size or 1.0
        self.device_ = _choose_device(torch, self.device)
        data = torch.from_numpy(self._normalise(images)).to(self.device_)
        targets = torch.from_numpy(targets).to(self.device_)
        with torch.random.fork_rng():
            torch.manual_seed(self.random_state)
            self.network_ = _make_network(torch, self.shape_, self.classes_.size).to(
                self.device_
            )
            parts = torch.from_numpy(train), torch.from_numpy(validate)
            with show_progress(progress, "epochs, at most") as advance:
                self._train(torch, data, targets, *parts, advance)
        return self

    def _decide(self, X):
        """Probability of each class, (trial, class)."""
        torch = import_torch()
        data = torch.from_numpy(self._normalise(self._flatten(X))).to(self.device_)
        self.network_.eval()
        with torch.no_grad():
            parts = [
                torch.softmax(self.network_(part), dim=1).cpu().numpy()
                for part in data.split(64)
            ]
        return np.concatenate(parts)

    def save(self, path: str | Path) -> None:
        """Weights and settings as a versioned safetensors file; never pickle."""
        self._require()
        arrays = {
            key: values.cpu().numpy() for key, values in self.network_.state_dict().items()
        }
        parameters = self.get_params() | {"shape": self.shape_}
        del parameters["device"]
        settings = {
            "classes": self.classes_.tolist(),
            "scale": float(self.scale_),
            "parameters": parameters,
        }
        arrays["input_mean"] = np.asarray(self.mean_)
        save_model(
            Model(kind=_MODEL_KIND, version=_MODEL_VERSION, arrays=arrays, settings=settings),
            path,
        )

    @classmethod
    def load(cls, path: str | Path, *, device: str = "auto") -> "TouchNetwork":
        """A trained network from a file that ``save`` wrote.

        Raises
        ------
        InvalidInput
            No such file, damaged, or of another kind or version.
        """
        torch, file = import_torch(), load_model(path, kind=_MODEL_KIND, version=_MODEL_VERSION)
        try:
            return cls._rebuild(torch, file, device)
        except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
            raise InvalidInput(
                f"{path} is no complete TouchNetwork ({str(error)[:150]}). Save it again."
            ) from error

    @classmethod
    def _rebuild(cls, torch: Any, file: Model, device: str) -> "TouchNetwork":
        parameters = dict(file.settings["parameters"])
        shape = parameters["shape"] = tuple(int(n) for n in parameters["shape"])
        state = dict(file.arrays)
        mean = state.pop("input_mean")
        if (
            len(shape) != 2 or min(shape) < 1 or mean.shape != (shape[0] * shape[1],)
        ):  # before memory is taken for it
            raise ValueError(f"the shape {shape} does not fit a mean of {mean.size} values")
        model = cls(**parameters, device=device)
        model.shape_ = shape
        model.classes_, model.scale_, model.mean_ = (
            np.array(file.settings["classes"]),
            file.settings["scale"],
            mean,
        )
        model.device_ = _choose_device(torch, device)
        model.network_ = _make_network(torch, shape, model.classes_.size).to(model.device_)
        model.network_.load_state_dict(
            {key: torch.from_numpy(values) for key, values in state.items()}
        )
        return model

    def _renew(self) -> "TouchNetwork":
        return clone(self).set_params(shape=None)

    def _flatten(self, X) -> np.ndarray:
        images = np.asarray(X, dtype=float)
        if not np.isfinite(images).all():
            raise InvalidInput(
                "the tensors hold NaN or infinite entries; drop such trials, or fill the gaps."
            )
        if len(self.shape_) != 2 or images[0].size != np.prod(self.shape_):
            raise InvalidInput(
                f"tensors of {images[0].size} entries do not have the shape {self.shape_} given."
            )
        return images.reshape(len(images), -1)

    def _normalise(self, images: np.ndarray) -> np.ndarray:
        found = np.empty(images.shape, np.float32)  # only now: its range is small
        for k in range(0, len(images), _PART):
            found[k : k + _PART] = (images[k : k + _PART] - self.mean_) / self.scale_
        return found.reshape(-1, 1, *self.shape_)

    def _check(self, images: np.ndarray, y: np.ndarray) -> None:
        check_labels(images, y.tolist())
        least = _KERNEL - 2 * _PADDING + _POOL - 1
        if min(self.shape_) < least:
            raise InvalidInput(
                f"the layers need at least {least} × {least} entries, got {self.shape_}; use"
                " make_lda()."
            )
        if not 0 < self.validation_share < 1:
            raise InvalidInput(
                f"validation_share must lie in (0, 1), got {self.validation_share}."
            )

    def _split(self, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Training and validation positions, with every class on both sides where possible."""
        n_classes = targets.max() + 1
        n_validate = max(round(self.validation_share * targets.size), n_classes)
        even = np.bincount(targets).min() >= 2 and targets.size - n_validate >= n_classes
        return train_test_split(
            np.arange(targets.size),
            test_size=n_validate if even else self.validation_share,
            stratify=targets if even else None,
            random_state=self.random_state,
        )

    def _train(self, torch, data, targets, train, validate, advance) -> None:
        # fused: a sixth faster
        optimiser = torch.optim.Adam(
            self.network_.parameters(), lr=self.learning_rate, fused=True
        )
        best, kept, self.best_epoch_, losses = np.inf, None, 0, []
        for epoch in range(self.max_epochs):
            self.network_.train()
            for part in train[torch.randperm(len(train))].split(self.batch_size):
                if len(part) > 1:  # batch norm has no variance of one
                    optimiser.zero_grad()
                    torch.nn.functional.cross_entropy(
                        self.network_(data[part]), targets[part]
                    ).backward()
                    optimiser.step()
            self.network_.eval()
            with torch.no_grad():
                answers = self.network_(data[validate])
                losses.append(
                    torch.nn.functional.cross_entropy(answers, targets[validate]).item()
                )
            self.validation_loss_, self.n_epochs_ = np.array(losses), len(losses)
            advance(len(losses), self.max_epochs)
            if losses[-1] < best:
                best, self.best_epoch_ = losses[-1], epoch
                kept = {key: value.clone() for key, value in self.network_.state_dict().items()}
            if epoch - self.best_epoch_ >= self.patience:
                break
        if kept is not None:
            self.network_.load_state_dict(kept)


def _make_network(torch: Any, shape: tuple[int, ...], n_classes: int) -> Any:
    """The layers, softmax left to the loss."""
    height, width = ((n + 2 * _PADDING - _KERNEL + 1) // _POOL for n in shape)
    layers = torch.nn.Sequential(
        torch.nn.Conv2d(1, _CHANNELS, _KERNEL, stride=1, padding=_PADDING),
        torch.nn.BatchNorm2d(_CHANNELS),
        torch.nn.MaxPool2d(
            _POOL
        ),  # ReLU after it gives the same values on a quarter of the entries
        torch.nn.ReLU(),
        torch.nn.Flatten(),
        torch.nn.Linear(_CHANNELS * height * width, _HIDDEN),
        torch.nn.Dropout(_DROPOUT),
        torch.nn.Linear(_HIDDEN, n_classes),
    )
    return layers.to(memory_format=torch.channels_last)  # pooling is ten times as fast


def import_torch() -> Any:
    """PyTorch, or a message that says how to get it."""
    require_extra("torch", "cnn", "the network")
    import torch

    return torch


def _choose_device(torch: Any, device: str) -> Any:
    """A PyTorch device; ``auto`` is the GPU where there is one."""
    return torch.device(
        ("cuda" if torch.cuda.is_available() else "cpu") if device == "auto" else device
    )
