"""The kernels of the extra `fast`, compiled by numba. The ways in are `compiled` and `compiled_mixed`."""
