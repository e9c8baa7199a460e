"""Sine and cosine together, from plain arithmetic: the same bits on every machine and in every
lane.
"""

import numpy as np

from feeler.compiled import lean
from feeler.physics.chain.lanes import choose, floor, fma

# π/2 in three parts of 33 bits, so that subtracting small multiples is exact (Cody & Waite 1980)
_HALF_PI_1, _HALF_PI_2, _HALF_PI_3 = (
    1.57079632673412561417e00,
    6.07710050630396597660e-11,
    2.02226624879595063154e-21,
)
_TWO_OVER_PI = 2 / np.pi
# fdlibm's polynomials on ±π/4, highest power first
_S6, _S5, _S4 = 1.58969099521155010221e-10, -2.50507602534068634195e-08, 2.75573137070700676789e-06
_S3, _S2, _S1 = -1.98412698298579493134e-04, 8.33333333332248946124e-03, -1.66666666666666324348e-01
_C6, _C5, _C4 = -1.13596475577881948265e-11, 2.08757232129817482790e-09, -2.75573143513906633035e-07
_C3, _C2, _C1 = 2.48015872894767294178e-05, -1.38888888888741095749e-03, 4.16666666666666019037e-02


@lean
def sincos(x):
    """(sin x, cos x) to one unit in the last place for |x| below 1e5."""
    quadrant = floor(x * _TWO_OVER_PI + 0.5)
    r = ((x - quadrant * _HALF_PI_1) - quadrant * _HALF_PI_2) - quadrant * _HALF_PI_3
    z = r * r
    s = fma(fma(fma(fma(fma(_S6, z, _S5), z, _S4), z, _S3), z, _S2), z, _S1)
    s = fma(r * z, s, r)
    c = fma(fma(fma(fma(fma(_C6, z, _C5), z, _C4), z, _C3), z, _C2), z, _C1)
    c = 1.0 - (0.5 * z - z * z * c)
    half = quadrant * 0.5
    odd = half - floor(half) > 0.25
    sine, cosine = choose(odd, c, s), choose(odd, s, c)
    quarter = quadrant * 0.25
    turn = quarter - floor(quarter)  # quadrant / 4 within a full turn
    flip_cosine = (turn > 0.125) & (turn < 0.625)
    return choose(turn > 0.375, -sine, sine), choose(flip_cosine, -cosine, cosine)
