"""The kernels of the extra `fast`, compiled by numba. The way in is `compiled`."""
