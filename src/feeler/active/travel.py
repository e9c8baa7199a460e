"""Templates against distance travelled: the plain decoder of touches at any speed."""

from typing import Annotated

import numpy as np
from scipy.special import softmax

from feeler.active.noticing import Noticer, make_noticer
from feeler.active.recorded import Recorded
from feeler.active.task import TouchTask
from feeler.checked import checked
from feeler.errors import InvalidInput

BIN = 0.6  # [C] mm


@checked
class TravelDecoder:
    """What each object feels like by how far the body has gone since contact, and how much that
    varies.

    Parameters
    ----------
    task
        Whose objects are told apart, with its noise.
    recorded
        Episodes to learn from.

    Notes
    -----
    ln p(object) = −½ Σ [(y − m)² / v + ln v] over sensors and samples since contact was noticed,
    with mean m and variance v of each object's episodes within each 0.6 mm, the noise added. It
    takes neighbouring samples as independent, which they are not, so that its probabilities are too
    sure until ``temperature`` makes up for it.
    """

    def __init__(
        self, task: TouchTask, recorded: Recorded, temperature: Annotated[float, "> 0"] = 1.0
    ) -> None:
        if task.n_outputs < 2:
            raise InvalidInput("templates tell objects apart; the task asks for something else.")
        self.n_objects, self.noise, self.temperature = task.n_outputs, task.noise, temperature
        self.noticer: Noticer = make_noticer(recorded, task.noise)
        place = self._place(recorded.base, self.noticer.notice(recorded.angle))
        n_bins, n_sensors = int(place.max()) + 1, recorded.angle.shape[2]
        self.mean = np.zeros((self.n_objects, n_bins, n_sensors))
        self.variance = np.full((self.n_objects, n_bins, n_sensors), task.noise**2)
        for known in range(self.n_objects):
            own = recorded.target == known
            for k in range(n_bins):
                some = recorded.angle[own][place[own] == k]
                if len(some):
                    self.mean[known, k] = some.mean(axis=0)
                    self.variance[known, k] += some.var(axis=0)

    def _place(self, base: np.ndarray, onset: np.ndarray) -> np.ndarray:
        """Number of the bin (episode, sample) since contact was noticed, −1 before."""
        n = base.shape[1]
        way = base[:, :, 0]
        began = np.take_along_axis(way, np.minimum(onset, n - 1)[:, None], 1)
        after = np.arange(n) >= onset[:, None]
        return np.where(after, np.maximum((way - began) // BIN, 0), -1).astype(int)

    def decode(self, felt: np.ndarray, base: np.ndarray) -> np.ndarray:
        """Probability of each object (episode, sample, object) of what is felt (episode, sample,
        sensor) [rad] by bodies that went as ``base`` (episode, sample, 4) says."""
        place = np.minimum(self._place(base, self.noticer.notice(felt)), self.mean.shape[1] - 1)
        evidence = np.zeros((*place.shape, self.n_objects))
        for known in range(self.n_objects):
            m, v = self.mean[known][place], self.variance[known][place]
            evidence[..., known] = -0.5 * ((felt - m) ** 2 / v + np.log(v)).sum(axis=2)
        evidence[place < 0] = 0.0
        return softmax(np.cumsum(evidence, axis=1) / self.temperature, axis=2)
