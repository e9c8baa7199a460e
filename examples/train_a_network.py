"""Train a network on touches.

A small network learns from random touches read from a store, and classifies while a touch goes
on.
"""

import sys
import time
from pathlib import Path

import numpy as np
import torch
from matplotlib.figure import Figure

import feeler
from feeler.decoding import StreamDecoder
from feeler.learn import TouchBatches

DURATION, WINDOW = 60, 48  # ms of a touch, samples of it from contact on
NOISE, ONSET, CONFIRM = (
    0.001,
    0.005,
    3,
)  # rad; contact is three samples beyond ONSET, as StreamDecoder notices it
SCALE = 50.0  # brings angles of some 0.02 rad to 1


def main(out: Path, n: int = 600, epochs: int = 25) -> float:
    torch.manual_seed(0)
    torch.set_num_threads(1)  # so small a network only waits for more
    store, began = out / "touches.zarr", time.perf_counter()
    trials = feeler.sample_trials(n, speeds=(0.3, 0.6), sizes=(1.0, 3.0), seed=1)
    options = {
        "duration": DURATION,
        "save": ("angle",),
        "dtype": "float32",
        "store": store,
        "load": False,
    }
    feeler.touch(feeler.sample_antennas(20), trials, **options)
    felt = time.perf_counter()
    shares = {
        "train": 0.8,
        "test": 0.2,
    }  # of the 20 antennas: no touch of a tested antenna is trained with
    train, test = (
        TouchBatches(
            store,
            "feature",
            split=side,
            by="antenna",
            shares=shares,
            noise=NOISE,
            batch_size=32,
        )
        for side in shares
    )
    network, losses = learn(train, epochs)
    trained = time.perf_counter()
    accuracy = judge(network, test)
    print(f"{n} touches in {felt - began:.0f} s, {epochs} epochs in {trained - felt:.0f} s")
    print(
        f"{100 * accuracy:.0f} % of {len(test.rows)} touches with antennas never felt before are"
        " called by the right"
    )
    print("shape; chance is 33 %")

    decoder = StreamDecoder(
        window=WINDOW, onset=ONSET, confirm=CONFIRM, model=lambda felt: ask(network, felt)
    )
    decoder.adopt(test.classes, test.shape[0])
    touches, labels = test.read(slice(0, 100))
    streams = [decoder.replay(touch.numpy()) for touch in touches]
    right = [
        states[-1].label == test.classes[label]
        for states, label in zip(streams, labels, strict=True)
    ]
    print(
        f"streamed sample by sample, {100 * np.mean(right):.0f} % of {len(right)} of them end with"
        " the right answer"
    )
    draw(losses, streams[0], test.classes, test.classes[labels[0]], out)
    return accuracy


def learn(touches: TouchBatches, epochs: int) -> tuple[torch.nn.Module, list[float]]:
    """Two convolutions over time; half of each batch is cut short, to know what a touch is like
    while it happens.
    """
    network = torch.nn.Sequential(
        torch.nn.Conv1d(touches.shape[0], 32, 7, stride=2), torch.nn.ReLU(),
        torch.nn.Conv1d(32, 32, 5, stride=2), torch.nn.ReLU(),
        torch.nn.Flatten(), torch.nn.LazyLinear(len(touches.classes)),
    )  # fmt: skip
    losses = []
    network(torch.zeros(1, touches.shape[0], WINDOW))  # the last layer learns its size
    optimiser = torch.optim.Adam(network.parameters())
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, total_steps=epochs + 1)
    for _ in range(epochs):
        for felt, label in torch.utils.data.DataLoader(touches, batch_size=None):
            felt = cut(felt)
            until = torch.randint(5, WINDOW + 1, (len(felt), 1, 1))
            until[::2] = WINDOW
            loss = torch.nn.functional.cross_entropy(
                network(turn(felt * (torch.arange(WINDOW) < until))), label
            )
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            losses.append(loss.item())
        schedule.step()
    return network.eval(), losses


def cut(felt: torch.Tensor) -> torch.Tensor:
    """From contact on, as a stream gives it; 0 where the touch is over."""
    contact = (felt.abs().amax(1) > ONSET).float().argmax(1) + CONFIRM - 1
    place = (contact[:, None, None] + torch.arange(WINDOW)).expand(-1, felt.shape[1], -1)
    return torch.nn.functional.pad(felt, (0, WINDOW)).gather(2, place)


def turn(felt: torch.Tensor) -> torch.Tensor:
    """Scaled, and what came from the right mirrored: a straight antenna feels the mirror image, and
    half is to be learnt.
    """
    return SCALE * felt * felt.sum((1, 2), keepdim=True).sign()


def judge(network: torch.nn.Module, touches: TouchBatches) -> float:
    """Share of touches called by the right name."""
    with torch.no_grad():
        right = [
            (network(turn(cut(felt))).argmax(1) == label).float() for felt, label in touches
        ]
    return torch.cat(right).mean().item()


def ask(network: torch.nn.Module, felt: np.ndarray) -> np.ndarray:
    """Probabilities of the shapes for what has been felt so far, NaN where nothing has."""
    with torch.no_grad():
        scores = network(turn(torch.from_numpy(np.nan_to_num(felt)).float()[None]))
    return torch.softmax(scores, 1)[0].numpy()


def draw(losses: list[float], states: list, classes: list[str], true: str, out: Path) -> None:
    """The loss while it learns, and the probabilities while it feels."""
    figure = Figure(figsize=(7, 2.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(losses, lw=0.8)
    left.set(xlabel="batch", ylabel="cross-entropy", ylim=(0, None))
    known = np.array(
        [[np.nan] * len(classes) if s.label is None else s.posterior for s in states]
    )
    for name, values in zip(classes, known.T, strict=True):
        right.plot(values, label=name)
    right.set(
        xlabel="time [ms]", ylabel="probability", ylim=(0, 1), title=f"a {true}, as it is felt"
    )
    right.legend(frameon=False)
    figure.savefig(out / "train_a_network.png", dpi=160)


if __name__ == "__main__":
    main(
        Path(sys.argv[1] if len(sys.argv) > 1 else "."),
        *[int(value) for value in sys.argv[2:4]],
    )
