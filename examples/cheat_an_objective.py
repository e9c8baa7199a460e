"""A pitfall: objectives that reward ringing.

A soft tip that rings scores best until noise, damping and bending are part of the objective.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import feeler
from feeler.antenna import compute_modes
from feeler.design import Constraints, DesignTask, score
from feeler.objects import Common, Relative

TASK = DesignTask(
    objects=("ball:radius=1.5", "box", "triangle"),
    locations=(0.7, 0.9),
    speeds=(0.6,),
    deadline=50.0,
    test=3,
)
FLOORS = {"absolute noise of 0.1 rad": Common(0.1), "relative, 1 peak": Relative(1.0)}


def make_floppy(antenna: feeler.Antenna) -> feeler.Antenna:
    """The same with a distal fifth that is ever softer, to a twentieth, and hardly damped."""
    ramp = np.interp(antenna.hinge_position / antenna.length, (0.8, 1.0), (0.0, 1.0))
    stiffness, damping = antenna.stiffness * 0.05**ramp, antenna.damping * 0.002**ramp
    return antenna.replace(stiffness=stiffness, damping=damping, name="floppy tip")


def main(out: Path) -> None:
    animal = feeler.presets.cockroach()
    figure = Figure(figsize=(7, 3), layout="constrained")
    ax = figure.subplots()
    for antenna in (animal.replace(name="the paper's"), make_floppy(animal)):
        trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.6)
        motion = feeler.touch(antenna, trial, duration=120.0, all_hinges=True)
        tip = np.degrees(
            motion["angle"].values[0, -30:].sum(axis=0)
        )  # how far the last thirty segments turn together
        ax.plot(motion["time"], tip, label=antenna.name)
        told = {
            name: score(antenna, TASK.replace(noise=noise)).bits
            for name, noise in FLOORS.items()
        }
        ratio = compute_modes(antenna, 6).damping_ratio.min()
        broken = Constraints(damping_share=1.0).check(antenna, animal)["damping_share"]
        words = ", ".join(f"{bits:.2f} bits ({name})" for name, bits in told.items())
        print(
            f"{antenna.name}: {words}; least damping ratio of six modes {ratio:.2g}; "
            + (
                f"excluded, a mode lacks a factor {np.exp(broken):.0f} of damping"
                if broken
                else "keeps all constraints"
            )
        )
    ax.set(xlabel="time [ms]", ylabel="bend of the tip [degrees]")
    ax.legend(frameon=False)
    figure.savefig(out / "cheat_an_objective.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
