"""Linear least squares with signs, bounds and equations: coefficients of a fit, without
the product A'A."""
