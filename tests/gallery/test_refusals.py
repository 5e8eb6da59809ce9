"""Parameters out of their range make no problem of the gallery."""

import pytest

from lcpcli.gallery.families import make

from ..refusals import calls, raised

NAMES = {"make": make}
REFUSALS = calls(
    "OptionError",
    r"""
"nothing" => family: {UNKNOWN:'nothing'}; lcp make --list shows the families
"murty", decades=3 => parameters: {NO_PARAMETER:'decades'|murty}; {LEAVE_IT_OUT}
"diagonal", decades=151 => decades: {OUT_OF_RANGE:151}; {IT_MUST_BE:0 <= decades <= 150}
"ill-scaled", decades=51 => decades: {OUT_OF_RANGE:51}; {IT_MUST_BE:0 <= decades <= 50}
"journal-bearing", eccentricity=1.0
    => eccentricity: {OUT_OF_RANGE:1.0}; {IT_MUST_BE:0 < eccentricity < 1}
"american-put", rate=nan => rate: {OUT_OF_RANGE:nan}; {IT_MUST_BE:0.001 <= rate <= 10}
"american-put", volatility=0.001
    => rate: {OUT_OF_RANGE:0.1};
    {IT_MUST_BE:small compared with the square of the volatility}
"american-put", strike=3.0
    => strike: {OUT_OF_RANGE:3.0}; {IT_MUST_BE:0.5 <= strike <= 2}
"ben-gharbia-gilbert", alpha=1.0
    => alpha: {OUT_OF_RANGE:1.0}; {IT_MUST_BE:1 < alpha <= 1e6}
"near-singular", epsilon=0.0
    => epsilon: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:1e-12 <= epsilon <= 1}
"contact", friction=-1.0
    => friction: {OUT_OF_RANGE:-1.0}; {IT_MUST_BE:{OF_FRICTION}}
"contact", compliance=inf
    => compliance: {OUT_OF_RANGE:inf}; {IT_MUST_BE:0 <= compliance <= 10}
"rigid-boxes", friction=-1.0
    => friction: {OUT_OF_RANGE:-1.0}; {IT_MUST_BE:{OF_FRICTION}}
"rigid-boxes", kind="towr" => kind: {UNKNOWN:'towr'}; {DID_YOU_MEAN:tower}
"beam", support="clampd" => support: {UNKNOWN:'clampd'}; {DID_YOU_MEAN:clamped}
"plate", support="springs"
    => support: {UNKNOWN:'springs'}; choose one of clamped, hinged
"frame", contrast=0.5
    => contrast: {OUT_OF_RANGE:0.5}; {IT_MUST_BE:1 <= contrast <= 1e9}
"beam", mass=-1.0 => mass: {OUT_OF_RANGE:-1.0}; {IT_MUST_BE:0 <= mass <= 1e30}
"planted", entries=-1
    => entries: {OUT_OF_RANGE:-1}; {IT_MUST_BE:0 <= entries <= 1000}
"frontier", target=1.5 => target: {OUT_OF_RANGE:1.5}; {IT_MUST_BE:0 <= target <= 1}
"frontier", weight=-1.0 => weight: {OUT_OF_RANGE:-1.0}; {IT_MUST_BE:0 <= weight <= 1e6}
"lasso", penalty=3.0 => penalty: {OUT_OF_RANGE:3.0}; {IT_MUST_BE:0 <= penalty <= 2}
"lasso", samples=0 => samples: {OUT_OF_RANGE:0}; {IT_MUST_BE:1 <= samples <= 1e5}
"two-obstacles", load=nan
    => load: {OUT_OF_RANGE:nan}; {IT_MUST_BE:-1e6 <= load <= 1e6}
"spatial-prices", tax=inf => tax: {OUT_OF_RANGE:inf}; {IT_MUST_BE:-1e6 <= tax <= 1e6}
"all-cones", t=inf => t: {OUT_OF_RANGE:inf}; {IT_MUST_BE:-1e15 <= t <= 1e15}
""",
    "make({})",
)


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_a_parameter_out_of_range_is_refused(refusal):
    assert raised(refusal.command, NAMES) == refusal.line
