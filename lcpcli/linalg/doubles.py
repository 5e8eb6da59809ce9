"""Constants of double precision, and the one bound on the rounding error in a row of w."""

from __future__ import annotations

import numpy as np

EPS = float(np.finfo(np.float64).eps)  # from 1 to the next number
SMALLEST_NORMAL = float(np.finfo(np.float64).smallest_normal)  # bounds the error of an underflow
LARGEST = float(np.finfo(np.float64).max)
ROW_ROUNDING = 8 * EPS  # relative to the terms of a row: a bound on the rounding error in w = M z + q
