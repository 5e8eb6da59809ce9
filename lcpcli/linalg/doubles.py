"""The numbers of double precision, and the one bound of what rounding leaves in a row of w."""

from __future__ import annotations

import numpy as np

EPS = float(np.finfo(np.float64).eps)  # from 1 to the next number
SMALLEST_NORMAL = float(np.finfo(np.float64).smallest_normal)  # more than an underflow can take away
LARGEST = float(np.finfo(np.float64).max)
ROW_ROUNDING = 8 * EPS  # of the terms of a row: what is lost where w = M z + q is computed, at most
