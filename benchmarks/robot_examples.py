"""Makes the example files of ``feeler robot example`` again: python benchmarks/robot_examples.py
FOLDER.

The recorded touch that is shipped was made before contact became smooth: it differs from this one
from contact on.
"""

import sys
from pathlib import Path

import numpy as np

from feeler.robot.description import EXAMPLES, make_robot, make_touches
from feeler.robot.fit import make_posture, simulate_release
from feeler.robot.recordings import save_recording
from feeler.robot.repair import repair
from feeler.robot.surrogate import make_surrogate

SEED = 2025


def main(folder: Path) -> None:
    """Write the three files; they all belong to one surrogate robot."""
    robot = make_surrogate(np.random.default_rng(SEED), name="surrogate-example")
    table = robot.sensing.bench(np.random.default_rng(SEED + 1))
    columns = np.stack(
        [table["hinge"], np.rad2deg(table["angle"]), table["capacitance"], table["time"]],
        axis=1,
    )
    with open(folder / EXAMPLES["calibration"], "w", encoding="utf-8", newline="\n") as file:
        file.write(
            f"# source: surrogate\n# robot: {robot.name}\nhinge,angle_deg,capacitance_pF,time_ms\n"
        )
        np.savetxt(file, columns, fmt=("%d", "%.2f", "%.4f", "%d"), delimiter=",")
    fast_ball = make_touches(locations=(0.9,), speeds=(0.27,))[0]
    save_recording(robot.touch([fast_ball])[0], folder / EXAMPLES["recording"], digits=5)
    posture = np.append(np.zeros(robot.antenna.n_segments - 8), make_posture(make_robot()))
    motion = simulate_release(robot.antenna, posture + robot.antenna.rest_angle, 1500.0)
    angles = repair(
        robot.record(motion).to_angles(robot.calibration, outside="extend"), gaps="bridge"
    )
    save_recording(angles, folder / EXAMPLES["release"], digits=4)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
