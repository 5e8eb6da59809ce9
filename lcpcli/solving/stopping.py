"""Stopping rules from other packages: functions of a TraceRow, found by the names under which these declare them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from lcpcli.additions import addition, names, package
from lcpcli.errors import OptionError, likely, raised
from lcpcli.methods.stages import PackageFault

if TYPE_CHECKING:
    from lcpcli.solving.trace import TraceRow


class Rule(NamedTuple):
    """A stopping rule, called as a `callback` is: a true value ends the run. package : its name and version."""

    name: str
    decide: Callable[[TraceRow], object]
    package: str

    def __call__(self, row: TraceRow) -> bool:
        try:
            return bool(self.decide(row))
        except StopIteration:
            return True
        except Exception as error:
            fault = f"the stopping rule {self.name} of {self.package} raises {raised(error)}"
            raise PackageFault(fault) from error

    @property
    def clause(self) -> str:
        """Return how a run has ended that the rule ended, as a clause for its status."""
        return f"by the stopping rule {self.name} of {self.package}"


def rule(name: str) -> Rule:
    """Return the stopping rule of that name; raise an OptionError that suggests a name if no package has it."""
    decide = addition("stopping", name)
    if decide is None:
        known = sorted(names("stopping"))
        none = "no installed package adds one; see lcp help development"
        raise OptionError("stop", f"{name!r} is unknown", likely(name, known) if known else none)
    if not callable(decide):
        raise OptionError(
            "stop", f"{name} of {package('stopping', name)} is not a function", "see lcp help development"
        )
    return Rule(name, decide, package("stopping", name) or "another package")
