"""What Stable-Baselines3's PPO, as it comes, learns on the plain environment.

    python benchmarks/plain_learning.py --steps 200000 --seeds 3      writes docs/images/ppo.png

Nothing is tuned: PPO's own defaults, a policy of two layers, episodes of at most 100 ms with an
action every 10 ms, declared before any run. Learning is judged by the loss of the prediction at an
episode's last step, the mean of the last thousand episodes; ln 6 = 1.79 nat is guessing. What every
seed began and ended with is kept in benchmarks/results/plain_learning.json.
"""

import argparse
import json
import time
from pathlib import Path

import gymnasium
import numpy as np
from kept import write_kept
from matplotlib.figure import Figure
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

import feeler.active.environment  # noqa: F401  (makes the environments known)
from feeler.plotting import style
from feeler.plotting.style import PALETTE

ROOT = Path(__file__).parents[1]
GUESS = float(np.log(6))  # nat
_WINDOW = 200  # episodes of a running mean, in the picture only


class _Losses(BaseCallback):
    """The loss at the end of every episode, and the step at which it ended."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[int, float]] = []

    def _on_step(self) -> bool:
        for done, info in zip(self.locals["dones"], self.locals["infos"], strict=True):
            if done:
                self.found.append((self.num_timesteps, float(info["prediction"]["loss"])))
        return True


def learn(seed: int, steps: int) -> np.ndarray:
    """Steps and losses (2, episode)."""
    env = gymnasium.make("feeler/Touch-v0", duration=100.0)
    losses = _Losses()
    PPO("MlpPolicy", env, seed=seed, device="cpu").learn(steps, callback=losses)
    return np.array(losses.found).T


def draw(curves: list[np.ndarray], path: Path) -> None:
    with style():
        figure = Figure(figsize=(4.6, 3.0), layout="constrained")
        ax = figure.subplots()
        smooth = np.ones(_WINDOW) / _WINDOW
        for seed, (step, loss) in enumerate(curves):
            mean = np.convolve(loss, smooth, "valid")
            ax.plot(step[_WINDOW - 1 :] / 1e3, mean, color=PALETTE[seed], label=f"seed {seed}")
        ax.axhline(GUESS, color="0.5", ls="--", lw=1, label="guessing, ln 6")
        ax.set(xlabel="actions [thousand]", ylabel="loss at the end of an episode [nat]")
        ax.set_ylim(bottom=0)
        ax.legend()
        figure.savefig(path, dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--seeds", type=int, default=3)
    said = parser.parse_args()
    curves, began = [], time.process_time()
    for seed in range(said.seeds):
        curves.append(learn(seed, said.steps))
        print(f"seed {seed}: {curves[-1][1][-1000:].mean():.3f} nat", flush=True)
    draw(curves, ROOT / "docs" / "images" / "ppo.png")
    found = {
        "steps": said.steps,
        "guess": GUESS,
        "first": [float(loss[:1000].mean()) for _, loss in curves],
        "last": [float(loss[-1000:].mean()) for _, loss in curves],
        "seconds": time.process_time() - began,
    }
    write_kept(
        ROOT / "benchmarks" / "results" / "plain_learning.json", json.dumps(found, indent=1)
    )


if __name__ == "__main__":
    main()
