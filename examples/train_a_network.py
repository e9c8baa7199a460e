"""Train a small network on random touches read from a store, and let it say while a touch happens what is felt."""

import sys
import time
from pathlib import Path

import numpy as np
import torch
from matplotlib.figure import Figure

import feeler
from feeler.decoding import StreamDecoder
from feeler.learn import TouchDataset

DURATION, NOISE = 60, 0.003  # ms, rad
SCALE = 50.0  # brings angles of some 0.02 rad to 1


def main(out: Path, n: int = 400, epochs: int = 25) -> None:
    torch.manual_seed(0)
    torch.set_num_threads(2)  # so small a network gains nothing from more
    trials = feeler.sample_trials(n, speeds=(0.3, 0.6), sizes=(1.0, 3.0), seed=1)
    options = {
        "duration": DURATION,
        "save": ("angle",),
        "dtype": "float32",
        "store": out / "touches.zarr",
        "load": False,
    }
    feeler.touch(feeler.sample_antennas(20), trials, **options)
    sides = {
        side: TouchDataset(options["store"], "feature", split=side, by="antenna", noise=NOISE, batch_size=32)
        for side in ("train", "test")
    }
    began = time.perf_counter()
    network, losses = train(sides["train"], epochs)
    accuracy = test(network, sides["test"])
    print(
        f"{n} touches, {epochs} epochs in {time.perf_counter() - began:.0f} s: {100 * accuracy:.0f} % of touches of antennas"
    )
    print("never felt before are called by the right shape; chance is 33 %")

    decoder = StreamDecoder(window=DURATION, onset=0.004, model=lambda felt: ask(network, felt))
    decoder.adopt(sides["test"].classes, sides["test"].shape[0])
    touch, label = sides["test"].read([0])
    states = decoder.replay(touch[0].numpy())
    draw(losses, states, decoder.classes_, decoder.classes_[int(label[0])], out)


def train(touches: TouchDataset, epochs: int) -> tuple[torch.nn.Module, list[float]]:
    """Two convolutions over time; parts of touches too, so that the network knows what a touch is like while it happens."""
    network = torch.nn.Sequential(
        torch.nn.Conv1d(touches.shape[0], 32, 7, stride=2), torch.nn.ReLU(),
        torch.nn.Conv1d(32, 32, 5, stride=2), torch.nn.ReLU(),
        torch.nn.Flatten(), torch.nn.LazyLinear(len(touches.classes)),
    )  # fmt: skip
    losses = []
    network(torch.zeros(1, *touches.shape))  # the last layer learns its size
    optimiser = torch.optim.Adam(network.parameters(), lr=2e-3)
    for _ in range(epochs):
        for felt, label in torch.utils.data.DataLoader(touches, batch_size=None):
            until = torch.randint(10, touches.shape[1] + 1, (len(felt), 1, 1))
            felt = SCALE * felt * (torch.arange(touches.shape[1]) < until)
            loss = torch.nn.functional.cross_entropy(network(felt), label)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            losses.append(loss.item())
    return network.eval(), losses


def test(network: torch.nn.Module, touches: TouchDataset) -> float:
    """Share of touches called by the right name."""
    with torch.no_grad():
        right = [(network(SCALE * felt).argmax(1) == label).float() for felt, label in touches]
    return torch.cat(right).mean().item()


def ask(network: torch.nn.Module, felt: np.ndarray) -> np.ndarray:
    """Probabilities of the shapes for what has been felt so far, NaN where nothing has."""
    with torch.no_grad():
        scores = network(SCALE * torch.from_numpy(np.nan_to_num(felt)).float()[None])
    return torch.softmax(scores, 1)[0].numpy()


def draw(losses: list[float], states: list, classes: list[str], true: str, out: Path) -> None:
    """The loss while it learns, and the probabilities while it feels."""
    figure = Figure(figsize=(7, 2.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(losses, lw=0.8)
    left.set(xlabel="batch", ylabel="cross-entropy", ylim=(0, None))
    known = np.array([[np.nan] * len(classes) if s.label is None else s.posterior for s in states])
    for name, values in zip(classes, known.T, strict=True):
        right.plot(values, label=name)
    right.set(xlabel="time [ms]", ylabel="probability", ylim=(0, 1), title=f"a {true}, as it is felt")
    right.legend(frameon=False)
    figure.savefig(out / "train_a_network.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."), *[int(value) for value in sys.argv[2:4]])
