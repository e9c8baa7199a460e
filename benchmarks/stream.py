"""Time per sample of the streaming decoder on one core: 30 classes, 8 channels, surrogate
recordings at 1 kHz.

Wall time counts other work on a shared machine too; CPU time is the decoder's own.
"""

import json
import platform
import time
from pathlib import Path

import numpy as np
from kept import write_kept

from feeler.robot import draw_robots, make_decoder, touch_robots

LIMIT = 1.0  # ms per sample: what 1 kHz leaves
RESULTS = Path(__file__).parent / "results" / "stream.json"


def measure(n_robots: int = 3, seed: int = 0) -> dict[str, float | str]:
    """Replay six tip contacts per robot, tensor update included; percentiles of the time per sample
    [ms].
    """
    decoder = make_decoder(seed=seed)
    wall, cpu = [], []
    for touches in touch_robots(draw_robots(1.0, n_robots, seed)):
        for motion in touches.motions:
            stream = decoder.start()
            for sample in motion.T:
                start, busy = time.perf_counter(), time.thread_time()
                stream.update(sample)
                wall.append(time.perf_counter() - start)
                cpu.append(time.thread_time() - busy)
    ranks = {"median": 50, "p99": 99, "max": 100}
    return {
        "samples": len(wall),
        **{
            f"{name}_wall_ms": float(1e3 * np.percentile(wall, rank))
            for name, rank in ranks.items()
        },
        **{
            f"{name}_cpu_ms": float(1e3 * np.percentile(cpu, rank))
            for name, rank in ranks.items()
        },
        "limit_ms": LIMIT,
        "machine": f"{platform.machine()}, one core",
    }


if __name__ == "__main__":
    result = measure()
    for name, value in result.items():
        print(f"{name:12} {value:.4g}" if isinstance(value, float) else f"{name:12} {value}")
    RESULTS.parent.mkdir(exist_ok=True)
    write_kept(RESULTS, json.dumps(result, indent=1) + "\n")
