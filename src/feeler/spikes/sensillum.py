"""Sensilla: how a receptor turns bending into a rate of spikes, and adapts."""

from typing import Annotated

from feeler.records.record import Ge, Gt, Record, Unit


class Sensillum(Record):
    """A mechanoreceptor whose threshold follows the stimulus.

    With the stimulus u ≥ 0, which is the gain of a unit times the bending towards its side, and the
    adapting threshold x,

        y = max(0, a (u − x) + c u + d + v du/dt) and τ dx/dt = sign(u − x) |u − x|^b,

    at most ``ceiling``. A step of u adapts as a power law, a ramp soon reaches
    a (τ du/dt)^(1/b) above the tonic part. The defaults are those of the proximal campaniform
    sensilla on the cockroach's tibia, fitted to one recording, in which u is a force in mN [B].

    Attributes
    ----------
    tau : float
        τ, time of adaptation [ms, for u in units of 1].
    a : float
        Phasic gain [Hz]; 0: no adapting part.
    b : float
        Power of adaptation, ≥ 1; 1 is an exponential.
    c : float
        Tonic gain [Hz].
    d : float
        Offset [Hz]; below 0 it is a threshold.
    v : float
        Gain for the rate of change [Hz·ms], that of hair sensilla.
    ceiling : float
        Greatest rate [Hz], chosen [C].

    Raises
    ------
    InvalidInput
        A field outside its range.

    Notes
    -----
    Szczecinski, Dallmann, Quinn & Zill 2021, doi:10.1088/1748-3190/ac1ced.
    """

    tau: Annotated[float, Gt(0), Unit("ms")] = 3.8595
    a: Annotated[float, Ge(0), Unit("Hz")] = 707.6
    b: Annotated[float, Ge(1)] = 2.2615
    c: Annotated[float, Ge(0), Unit("Hz")] = 54.287
    d: float = -41.1551
    v: Annotated[float, Ge(0)] = 0.0
    ceiling: Annotated[float, Gt(0), Unit("Hz")] = 1000.0

    @property
    def phasic(self) -> "Sensillum":
        """The same without its tonic part: c = d = 0."""
        return self.replace(c=0.0, d=0.0)

    @property
    def tonic(self) -> "Sensillum":
        """The same without its phasic part: a = v = 0."""
        return self.replace(a=0.0, v=0.0)


CAMPANIFORM = Sensillum()
"""The cockroach's tibial campaniform sensilla [B]."""
HAIR = Sensillum(a=0.0, c=0.0, d=0.0, v=5000.0)
"""A hair sensillum by the rate of bending alone; 400 Hz at u = 0.08 per ms [C]."""
