"""The kernels of the extra `fast`, which are loaded with this module, if there is
numba: the processes of a run of tests compile them between them."""

from importlib.util import find_spec

if find_spec("numba") is not None:
    from lcpcli.kernels.loading import MODULES, load

    load(*MODULES)
