"""The kernels of the extra `fast`, compiled by numba. The ways in are `compiled`, `compiled_mixed` and
`compiled_interior`."""
