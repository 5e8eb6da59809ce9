"""PATH 5.2, called through its library, which the package gamspy_base includes: also
for nonlinear problems.

S. P. Dirkse, M. C. Ferris, The PATH solver: a non-monotone stabilization scheme for
mixed complementarity problems, Optim. Methods Softw. 5 (1995) 123-156.

The library calls for F and its Jacobian the functions of the problem, as the methods of
this package do; the seconds, from the functions to the answer, include their
evaluations. PATH begins at the start of a nonlinear problem, and at the z within its
bounds nearest to 0 for a linear one. The tolerance is PATH's convergence_tolerance,
absolute; all other options have the defaults of PATH. Without a licence, which the
environment variable PATH_LICENSE_STRING may hold, the library takes up to 300 unknowns
and 2,000 entries of the Jacobian.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from ctypes import (
    CDLL,
    CFUNCTYPE,
    POINTER,
    Structure,
    byref,
    c_char_p,
    c_double,
    c_int,
    c_void_p,
)
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from lcpcli import clock
from lcpcli.errors import missing
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.peers.packages import PackageSolver, PeerOutcome
from lcpcli.typing import Matrix

NO_LIMIT = 1e10  # seconds, instead of infinity
FILES = {"win32": "path52.dll", "darwin": "libpath52.dylib"}
INFINITY = 1e20  # of PATH
MAX_UNKNOWNS, MAX_ENTRIES = 300, 2000  # without a licence
ENDINGS = (  # of PATH, by their numbers from 1
    "solution found, no progress, major iteration limit, minor iteration limit, "
    "time limit, interrupted, bound error, "
    "domain error, infeasible, error, license error"
)
SIGNATURES = (  # of the functions of the library
    "Output_SetInterface pointer, Options_Create, Path_AddOptions pointer, "
    "Options_Default pointer, "
    "Options_Set pointer text, Options_Destroy pointer, MCP_Create int int, "
    "MCP_SetInterface pointer pointer, "
    "MCP_Destroy pointer, MCP_GetX pointer, Path_Solve pointer pointer"
)
_Doubles, _Integers = POINTER(c_double), POINTER(c_int)
_Print = CFUNCTYPE(None, c_void_p, c_int, c_char_p)
_Flush = CFUNCTYPE(None, c_void_p, c_int)
_Size = CFUNCTYPE(None, c_void_p, _Integers, _Integers)
_Bounds = CFUNCTYPE(None, c_void_p, c_int, _Doubles, _Doubles, _Doubles)
_Function = CFUNCTYPE(c_int, c_void_p, c_int, _Doubles, _Doubles)
_Jacobian = CFUNCTYPE(
    c_int,
    c_void_p,
    c_int,
    _Doubles,
    c_int,
    _Doubles,
    _Integers,
    _Integers,
    _Integers,
    _Integers,
    _Doubles,
)


class _Output(Structure):
    _fields_ = (("data", c_void_p), ("print", _Print), ("flush", _Flush))


class _Interface(Structure):
    _fields_ = (
        ("data", c_void_p),
        ("size", _Size),
        ("bounds", _Bounds),
        ("function", _Function),
        ("jacobian", _Jacobian),
        ("optional", c_void_p * 6),
    )


class _Information(Structure):
    _fields_ = (
        ("numbers", c_double * 5),
        ("counts", c_int * 12),
        ("use_start", c_int),
        ("flags", c_int * 3),
    )


_SILENT = _Output(
    None, _Print(lambda _data, _mode, _text: None), _Flush(lambda _data, _mode: None)
)


def _prepared(problem: Problem | NonlinearProblem) -> tuple[NonlinearProblem, Matrix]:
    """Return the functions of a problem, and the Jacobian at the start."""
    if isinstance(problem, Problem):
        M, _, lower, upper = conditions_of(problem)
        problem = NonlinearProblem(problem.w, lambda _: M, lower=lower, upper=upper)
    return problem, Evaluations(problem).jacobian(problem.x0)


def _unlicensed(problem: Problem | NonlinearProblem) -> str:
    if path_start.version() is None:
        return "; ".join(missing(path_start.module))
    made, J = _prepared(problem)
    licence = (
        f"licence: without one, up to {MAX_UNKNOWNS} unknowns and {MAX_ENTRIES} "
        "entries of the Jacobian"
    )
    return (
        "" if _functions().Path_CheckLicense(made.n, int((J != 0).sum())) else licence
    )


def _solved(
    _: Any,
    problem: Problem | NonlinearProblem,
    prepared: tuple[NonlinearProblem, Matrix],
    tol: float,
    limit: float,
) -> PeerOutcome:
    (made, J), path = prepared, _functions()
    n, max_entries = made.n, J.nnz if is_sparse(J) else made.n**2
    max_entries = max_entries if path.Path_CheckLicense(n, max_entries) else MAX_ENTRIES
    scale = (
        max(float(np.abs(problem.q).max()), 1.0)
        if isinstance(problem, Problem)
        else 1.0
    )
    options = {
        "convergence_tolerance": tol * scale,
        "time_limit": min(limit, NO_LIMIT),
        "output": "no",
    }
    began, faults = clock.seconds(), list[BaseException]()
    options_handle = path.Options_Create()
    path.Path_AddOptions(options_handle)
    path.Options_Default(options_handle)
    for name, value in options.items():
        path.Options_Set(options_handle, f"{name} {value}".encode())
    run = path.MCP_Create(n, max_entries)
    interface = _called(made, max_entries, faults)
    information = _Information(use_start=1)
    path.MCP_SetInterface(run, byref(interface))
    ending = path.Path_Solve(run, byref(information))
    z = np.ctypeslib.as_array(path.MCP_GetX(run), (n,)).copy()
    path.MCP_Destroy(run)
    path.Options_Destroy(options_handle)
    seconds = clock.seconds() - began
    if faults and isinstance(faults[0], BufferError):
        return (
            None,
            None,
            False,
            f"the Jacobian has more than {max_entries} entries",
            seconds,
        )
    if faults:
        raise faults[0]
    return z, None, ending == 1, ENDINGS.split(", ")[ending - 1], seconds


def _path() -> Path:
    return Path(
        import_module("gamspy_base").directory, FILES.get(sys.platform, "libpath52.so")
    )


@cache
def _functions() -> Any:
    path = CDLL(str(_path()))
    kinds = {"pointer": c_void_p, "int": c_int, "text": c_char_p}
    for name, *types in map(str.split, SIGNATURES.split(", ")):
        getattr(path, name).argtypes = [kinds[kind] for kind in types]
    path.Options_Create.restype = path.MCP_Create.restype = c_void_p
    path.MCP_GetX.restype = _Doubles
    path.Output_SetInterface(byref(_SILENT))
    return path


class _Library(PackageSolver):
    def version(self) -> str | None:
        package_version = super().version()
        return (
            f"GAMS {package_version}"
            if package_version is not None and _path().exists()
            else None
        )


path_start = _Library("gamspy_base", _solved, (_unlicensed,), _prepared)


def _called(
    problem: NonlinearProblem, max_entries: int, faults: list[BaseException]
) -> _Interface:
    """Return what PATH calls for a problem. max_entries : the entries of the
    Jacobian that there is memory for. faults : gets the first error in a call, which
    PATH cannot pass on; from then on F is treated as undefined."""
    evaluations = Evaluations(problem)

    def guarded(evaluate: Callable[..., int]) -> Callable[..., int]:
        def call(_data: Any, n: int, *arguments: Any) -> int:
            if not faults:
                try:
                    return evaluate(n, *arguments)
                # Also Ctrl-C; the caller raises it when PATH returns.
                except BaseException as error:
                    faults.append(error)
            return n  # values are undefined: all of them after an error

        return call

    def size(_data: Any, n: Any, entries: Any) -> None:
        n[0], entries[0] = problem.n, max_entries

    def bounds(_data: Any, n: int, z: Any, lower: Any, upper: Any) -> None:
        finite_bounds = (
            np.clip(bound, -INFINITY, INFINITY)
            for bound in (problem.lower, problem.upper)
        )
        for target, values in zip(
            (z, lower, upper), (problem.x0, *finite_bounds), strict=True
        ):
            np.ctypeslib.as_array(target, (n,))[:] = values

    def function(n: int, z: Any, F: Any) -> int:
        values = evaluations.values(np.ctypeslib.as_array(z, (n,)).copy())
        np.ctypeslib.as_array(F, (n,))[:] = values
        return int(np.count_nonzero(~np.isfinite(values)))

    def jacobian(
        n: int, z: Any, wants: int, F: Any, entries: Any, *targets: Any
    ) -> int:
        undefined = function(n, z, F) if wants else 0
        J = csc_array(evaluations.jacobian(np.ctypeslib.as_array(z, (n,)).copy()))
        if J.nnz > max_entries:
            raise BufferError
        entries[0] = J.nnz
        begins_lengths_rows_values = (
            J.indptr[:-1] + 1,
            np.diff(J.indptr),
            J.indices + 1,
            J.data,
        )
        for target, part in zip(targets, begins_lengths_rows_values, strict=True):
            np.ctypeslib.as_array(target, (part.size,))[:] = part
        return undefined + int(np.count_nonzero(~np.isfinite(J.data)))

    return _Interface(
        None,
        _Size(size),
        _Bounds(bounds),
        _Function(guarded(function)),
        _Jacobian(guarded(jacobian)),
    )
