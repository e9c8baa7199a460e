"""Active touch speed: how fast an animal moves its antennae."""

import numpy as np

from feeler.paper import figS2
from feeler.paper.context import Context
from feeler.report.section import Section


def make(context: Context, section: Section) -> None:
    """Fig. S2 on synthetic tracks."""
    data = figS2.compute(seed=context.seed)
    mean = float(np.degrees(data.exploration.mean) * 1e3)
    section.text(
        "The tracks of the paper's cockroach were not published. These are synthetic tracks with noise and gaps, whose "
        "planted mean peak speed is the paper's; the method must give it back. They say nothing about cockroaches."
    )
    section.figure(
        "figS2_tracking",
        "Synthetic tracks: paths of four landmarks, angle and angular speed of one trial with its peaks, and the average "
        "maximum speed of every trial and side. (Fig. S2)",
        lambda figure: figS2.plot(data, figure),
        height=3.0,
    )
    section.numbers("figS2_tracking", mean_peak=data.exploration.mean_peak, planted=data.planted)
    section.values |= {
        "tracking.mean": mean,
        "tracking.lateral": float(figS2.PAPER_MEAN * context.antenna.length * 100),
    }
