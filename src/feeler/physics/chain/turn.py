"""Sine and cosine together, from plain arithmetic: the same bits on every machine and in every lane."""

import numpy as np
from numba import njit

# π/2 in three parts of 33 bits, so that subtracting small multiples is exact (Cody & Waite 1980)
_HALF_PI_1, _HALF_PI_2, _HALF_PI_3 = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21
_TWO_OVER_PI = 2 / np.pi


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def sincos(x):
    """(sin x, cos x) to one unit in the last place for |x| below 1e6; the polynomials are fdlibm's."""
    quadrant = np.floor(x * _TWO_OVER_PI + 0.5)
    r = ((x - quadrant * _HALF_PI_1) - quadrant * _HALF_PI_2) - quadrant * _HALF_PI_3
    z = r * r
    s = r + r * z * (
        -1.66666666666666324348e-01
        + z
        * (
            8.33333333332248946124e-03
            + z
            * (
                -1.98412698298579493134e-04
                + z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))
            )
        )
    )
    c = 1.0 - (
        0.5 * z
        - z
        * z
        * (
            4.16666666666666019037e-02
            + z
            * (
                -1.38888888888741095749e-03
                + z
                * (
                    2.48015872894767294178e-05
                    + z
                    * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))
                )
            )
        )
    )
    turn = quadrant - 4.0 * np.floor(quadrant * 0.25)
    odd = (turn == 1.0) | (turn == 3.0)
    sine, cosine = (c if odd else s), (s if odd else c)
    return (-sine if turn >= 2.0 else sine), (-cosine if (turn == 1.0) | (turn == 2.0) else cosine)
