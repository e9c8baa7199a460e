"""A recurrent decoder: a small GRU that feels every sample, knows what its body does, and says what
it touches.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from feeler.active.recorded import Recorded
from feeler.active.task import TouchTask
from feeler.checked import checked
from feeler.decoding.cnn import import_torch
from feeler.errors import InvalidInput
from feeler.tensors.models import Model, load_model, save_model

HIDDEN, BATCH, RATE = 96, 64, 3e-3  # [C]
SCALES = (20.0, 1.0, 1.0, 0.03)  # mm, rad, mm/ms, rad/ms: what the base is divided by
KIND, VERSION = "RecurrentDecoder", 1


@checked
class RecurrentDecoder:
    """GRU of 96 cells on (sensors / noise, base), softmax over objects after every sample.

    Trained on bodies whose speeds vary, it can be asked whatever the body does. Noise is drawn anew
    for each pass over the episodes. Needs PyTorch (``pip install 'feeler[active]'``).

    Parameters
    ----------
    task
        Whose objects are told apart; the decoder remembers its antenna and noise.
    """

    def __init__(
        self, task: TouchTask, *, hidden: Annotated[int, "> 0"] = HIDDEN, random_state: int = 0
    ) -> None:
        self.sensing, self.n_objects = task.describe_sensing(), task.n_outputs
        self.noise, self.random_state, self.temperature = task.noise, random_state, 1.0
        self.n_sensors, self.hidden = len(task.first_antenna.sensors), hidden
        torch = import_torch()
        torch.manual_seed(random_state)
        self.network = torch.nn.ModuleDict(
            {
                "gru": torch.nn.GRU(self.n_sensors + 4, hidden, batch_first=True),
                "out": torch.nn.Linear(hidden, self.n_objects),
            }
        )

    def fit(
        self,
        recorded: Recorded,
        *,
        passes: Annotated[int, "> 0"] = 20,
        progress: Callable[[int, int], None] | None = None,
    ) -> "RecurrentDecoder":
        """Train by Adam, with a rate that falls to nothing, on the cross entropy of every sample;
        then set the temperature on a tenth of the episodes that were kept aside."""
        torch, rng = import_torch(), np.random.default_rng(self.random_state)
        torch.set_num_threads(1)  # so small a network is slower on more
        held = np.arange(len(recorded.target)) % 10 == 9
        rows, optimiser = np.flatnonzero(~held), torch.optim.Adam(self.network.parameters(), RATE)
        n_batches = max(1, len(rows) // BATCH)
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimiser, RATE, total_steps=passes * n_batches
        )
        for done in range(passes):
            order = rng.permutation(rows)
            for part in np.array_split(order, n_batches):
                felt = recorded.angle[part] + self.noise * rng.standard_normal(
                    recorded.angle[part].shape, np.float32
                )
                scores, _ = self._run(felt, recorded.base[part])
                target = torch.from_numpy(recorded.target[part].astype(np.int64))
                loss = torch.nn.functional.cross_entropy(
                    scores.flatten(0, 1), target.repeat_interleave(scores.shape[1])
                )
                optimiser.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
                optimiser.step()
                schedule.step()
            if progress:
                progress(done + 1, passes)
        if held.any():
            self._set_temperature(recorded, held, rng)
        return self

    def _run(self, felt: np.ndarray, base: np.ndarray, state: Any = None) -> tuple[Any, Any]:
        """Scores (episode, sample, object) and the state after."""
        torch = import_torch()
        given = np.concatenate([felt / self.noise, base / np.array(SCALES)], axis=2).astype(
            np.float32
        )
        seen, state = self.network["gru"](torch.from_numpy(given), state)
        return self.network["out"](seen), state

    def _set_temperature(
        self, recorded: Recorded, rows: np.ndarray, rng: np.random.Generator
    ) -> None:
        from scipy.optimize import minimize_scalar
        from scipy.special import log_softmax

        felt = recorded.angle[rows] + self.noise * rng.standard_normal(
            recorded.angle[rows].shape, np.float32
        )
        scores, target = self.score(felt, recorded.base[rows])[0], recorded.target[rows].astype(int)

        def lose(log_temperature: float) -> float:
            likely = log_softmax(scores / np.exp(log_temperature), axis=2)
            return -float(np.take_along_axis(likely, target[:, None, None], 2).mean())

        self.temperature = float(
            np.exp(minimize_scalar(lose, bounds=(-2.0, 2.0), method="bounded").x)
        )

    def score(
        self, felt: np.ndarray, base: np.ndarray, state: Any = None
    ) -> tuple[np.ndarray, Any]:
        """Scores (episode, sample, object) of what is felt (episode, sample, sensor) [rad], and the
        state to go on from.
        """
        if felt.shape[-1] != self.n_sensors or base.shape != (*felt.shape[:2], 4):
            raise InvalidInput(
                f"a decoder of {self.n_sensors} sensors needs felt (episode, sample,"
                f" {self.n_sensors}) and base (episode, sample, 4), got {felt.shape} and"
                f" {base.shape}."
            )
        with import_torch().no_grad():
            scores, state = self._run(felt, base, state)
        return scores.numpy(), state

    def decode(self, felt: np.ndarray, base: np.ndarray) -> np.ndarray:
        """Probability of each object (episode, sample, object)."""
        from scipy.special import softmax

        return softmax(self.score(felt, base)[0] / self.temperature, axis=2)

    def check(self, task: TouchTask) -> None:
        """Refuse a task whose antenna, noise or objects this decoder was not trained for.

        Raises
        ------
        InvalidInput
            Naming what differs.
        """
        other = task.describe_sensing() | {"objects": task.n_outputs}
        for name, own in (self.sensing | {"objects": self.n_objects}).items():
            if other[name] != own:
                raise InvalidInput(
                    f"the decoder was trained for another {name}: {own}, the task has"
                    f" {other[name]}. Train one for it."
                )

    def save(self, path: Path | str) -> None:
        """Write configuration and weights as safetensors."""
        arrays = {name: value.numpy() for name, value in self.network.state_dict().items()}
        settings = {"sensing": self.sensing, "n_objects": self.n_objects, "hidden": self.hidden,
                    "random_state": self.random_state, "temperature": self.temperature}  # fmt: skip
        save_model(Model(kind=KIND, version=VERSION, arrays=arrays, settings=settings), path)

    @classmethod
    def load(cls, path: Path | str, task: TouchTask) -> "RecurrentDecoder":
        """The decoder of a file, for a task that it was trained for."""
        model, torch = load_model(path, kind=KIND, version=VERSION), import_torch()
        kept = model.settings
        made = cls(task, hidden=int(kept["hidden"]), random_state=int(kept["random_state"]))
        made.sensing, made.n_objects = kept["sensing"], int(kept["n_objects"])
        made.check(task)
        made.temperature = float(kept["temperature"])
        made.network.load_state_dict(
            {name: torch.from_numpy(value.copy()) for name, value in model.arrays.items()}
        )
        return made
