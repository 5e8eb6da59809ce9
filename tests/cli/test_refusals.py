"""Command lines that cannot be run are refused in one line with the option or the file,
the fault and how to mend it, before anything is solved or written."""

import json
from pathlib import Path

import pytest

from ..refusals import commands
from . import models

GOOD = {
    "good.json": '{"M": [[2, 0], [0, 2]], "q": [-1, -1]}',
    "none.json": '{"M": [[0, -1], [1, 0]], "q": [-1, -1]}',
    "M.csv": "2,0\n0,2\n",
    "q.csv": "-1\n-1\n",
    "results": None,
    "loop": Path("loop"),
}
LONG_NAME = "a" * 300
CUT_NAME = f"{'a' * 40}...{'a' * 40}"

WORDS = commands(
    r"""
zzz
    => COMMAND: {UNKNOWN:'zzz'}; choose one of solve, compare, path, bench, check,
    inspect, why, kernels, make, convert, completion, help
solv good.json => COMMAND: {UNKNOWN:'solv'}; {DID_YOU_MEAN:solve}
good.json => COMMAND: {UNKNOWN:'good.json'}; {DID_YOU_MEAN:lcp solve good.json}
completion bahs => SHELL: {UNKNOWN:'bahs'}; {DID_YOU_MEAN:bash}
help metods => TOPIC: {UNKNOWN:'metods'}; {DID_YOU_MEAN:methods}
help "" => TOPIC: is empty; lcp help lists the topics
make murtty => FAMILY: {UNKNOWN:'murtty'}; {DID_YOU_MEAN:murty}
solve => FILE: {MISSING}; {SEE_HELP:solve}
inspect a b c => inspect: got unexpected extra argument (c); {SEE_HELP:inspect}
check a => FILE [Q_FILE] SOLUTION: {FILES_NOT:2|3|1}; {ALL_FILES_OF_CHECK}
check good.json => FILE [Q_FILE] SOLUTION: {FILES_NOT:2|3|1}; {ALL_FILES_OF_CHECK}
check good.json missing.json => missing.json: {NO_SUCH_FILE}; {CHECK_PATH}
check good.json 1,1,1 -q => 1,1,1: z: {ENTRIES:3 entries|2 unknowns}; {AGREE}
check good.json 1,1,
    => 1,1,: lacks an entry before or behind a comma; write the entry, or remove the
    comma
check good.json [1,,1]
    => [1,,1]: lacks an entry before or behind a comma; write the entry, or remove the
    comma
solve good.json --z0 ,1,1
    => --z0: lacks an entry before or behind a comma; write the entry, or remove the
    comma
solve good.json --upper none,
    => --upper: lacks an entry before or behind a comma; write the entry, or remove the
    comma
path good.json --direction 1, --to 1
    => --direction: lacks an entry before or behind a comma; write the entry, or remove
    the comma
solve good.json --trace --columns k,
    => --columns: lacks an entry before or behind a comma; write the entry, or remove
    the comma
check good.json -x1 => -x1: {NO_OPTION:lcp check}; {SEE_HELP:check}
check good.json -1,4 -x => -x: {NO_OPTION:lcp check}; {SEE_HELP:check}
solve --game --lsq A.csv b.csv => --game: has no effect with --lsq; {LEAVE_ONE_OUT}
solve --lsq --game A.csv b.csv => --lsq: has no effect with --game; {LEAVE_ONE_OUT}
solve good.json -n 3 => -n: {NO_OPTION:lcp solve}; {SEE_HELP:solve}
solve good.json --toll=1 => --toll: {NO_OPTION:lcp solve}; {DID_YOU_MEAN:--tol}
solve good.json --k_star 3 => --k_star: {NO_OPTION:lcp solve}; {DID_YOU_MEAN:--k-star}
solve good.json --json => --json: {NO_OPTION:lcp solve}; {DID_YOU_MEAN:--format json}
solve good.json --newton
    => --newton: {NO_OPTION:lcp solve}; {DID_YOU_MEAN:--method newton}
solve good.json -max-iterations 1
    => -max-iterations: {NO_OPTION:lcp solve}; {DID_YOU_MEAN:--max-iterations}
solve good.json --method newton-raphson
    => --method: {UNKNOWN:'newton-raphson'}; {DID_YOU_MEAN:newton}
solve good.json --format xml
    => --format: {UNKNOWN:'xml'}; choose one of table, json, csv, markdown, latex, html
solve good.json --tol => --tol: {NEEDS_ARGUMENT}; {SEE_HELP:solve}
make murty -n => -n: {NEEDS_ARGUMENT}; {SEE_HELP:make}
make murty --seed => --seed: {NEEDS_ARGUMENT}; {SEE_HELP:make}
solve good.json --quiet=3 => --quiet: does not take a value; {SEE_HELP:solve}
solve good.json --tol 1 --tol 2 => --tol: {GIVEN_TWICE}; {GIVE_ONCE}
check good.json 1,1 --tol -1 --tol -1 => --tol: {GIVEN_TWICE}; {GIVE_ONCE}
compare good.json --method shi --p 10 --p 100
    => --p: {GIVEN_TWICE}; {GIVE_ONCE}
solve good.json --k-star 1 --k-star 2
    => --k-star: {GIVEN_TWICE}; {GIVE_ONCE}
check coordination-4 1,0,0,0 0,1,0,0
    => 1,0,0,0: is one file or list too many after coordination-4; give row and column
    in one list, as in 1,0,0,1, or in one JSON file with these keys
solve good.json --maximum 3
    => --maximum: {NO_OPTION:lcp solve}; {DID_YOU_MEAN:--maximize}
solve good.json --output-folder a
    => --output-folder: {NO_OPTION:lcp solve}; {DID_YOU_MEAN:--output}
solve good.json --columns k,tme => --columns: 'tme' is not a column; {DID_YOU_MEAN:time}
solve bimatrx => bimatrx: {NO_SUCH_FILE}; {DID_YOU_MEAN:bimatrix, which is shipped}
solve paper-exmple-1.json
    => paper-exmple-1.json: {NO_SUCH_FILE};
    {DID_YOU_MEAN:paper-example-1, which is shipped}
solve problems/bimatrix.json
    => problems/bimatrix.json: {NO_SUCH_FILE};
    {DID_YOU_MEAN:bimatrix, which is shipped}
solve nowhere/klee-minty.mps
    => nowhere/klee-minty.mps: {NO_SUCH_FILE};
    {DID_YOU_MEAN:klee-minty, which is shipped}
""",
    GOOD,
)

NUMBERS = commands(
    r"""
solve good.json --tol 0 => --tol: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_TOL}}
solve good.json --max-iterations -1
    => --max-iterations: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
solve good.json --time-limit 0
    => --time-limit: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_SECONDS}}
solve good.json --threads 100000000000000000000000000000
    => --threads: {OUT_OF_RANGE:100000000000000000000000000000};
    {IT_MUST_BE:{WHOLE_TO:1|1024}}
solve good.json --every 0 => --every: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE:1}}
solve good.json --infinity 0 => --infinity: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_SIZE}}
solve good.json --all --max-solutions 0
    => --max-solutions: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE:1}}
solve good.json --method shi --p 0 => --p: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_P}}
solve good.json --method shi --p large
    => --p: 'large' is not a number; {IT_MUST_BE:{OF_P}}
solve good.json --tol abc => --tol: 'abc' is not a number; {IT_MUST_BE:{OF_TOL}}
solve good.json --method shi --k-star 0
    => --k-star: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE:1}}
solve good.json --method shi --k-star 1.5
    => --k-star: {OUT_OF_RANGE:1.5}; {IT_MUST_BE:{WHOLE:1}}
solve good.json --method shi --rho 0.5
    => --rho: {OUT_OF_RANGE:0.5}; {IT_MUST_BE:{OF_RHO}}
solve good.json --method shi --sigma 1
    => --sigma: {OUT_OF_RANGE:1.0}; {IT_MUST_BE:{OF_SIGMA}}
solve good.json --method shi --rho .3 --sigma .3
    => --sigma: {OUT_OF_RANGE:0.3}; {WITH_RHO:0.3}
solve good.json --method fixed-point:omega=0
    => --method: omega: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_OMEGA}}
solve good.json --method fixed-point:anderson=-1
    => --method: anderson: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
solve good.json --omega auto
    => --omega: {NO_OPTION:lcp solve}; write --method fixed-point:omega=auto
solve good.json -m shi:p=3 --no-scale
    => --no-scale: {NO_OPTION:lcp solve}; write --method shi:p=3,scale=false
compare good.json --method lemke --cover=7 --ties lexicographic
    => --cover: {NO_OPTION:lcp compare}; write --method lemke:cover=7
solve good.json --method reflections:walkers=2000000
    => --method: walkers: {OUT_OF_RANGE:2000000};
    {IT_MUST_BE:{WHOLE_TO:1|1000000}}
""",
    GOOD,
)

METHODS = commands(
    r"""
solve good.json --k-star 2
    => --k-star: {NO_EFFECT:auto}; {IT_BELONGS:shi: add --method shi}
compare good.json --method newton --method lemke --k-star 2
    => --k-star: {NO_EFFECT:newton and lemke}; {IT_BELONGS:shi: add --method shi}
solve good.json --method fixed-point --x1 1,1
    => --x1: {NO_EFFECT:fixed-point};
    {IT_BELONGS:shi: leave it out, or give --method shi}
compare good.json --method shi:p=1 --p 5
    => --p: {NO_EFFECT:shi:p=1}; {IT_BELONGS:shi: leave it out, or give --method shi}
compare good.json --method newton:p=1
    => --method: newton has no option p; {IT_BELONGS:shi}
compare good.json --method shi:kstar=1
    => --method: shi has no option kstar; {DID_YOU_MEAN:k-star}
compare good.json --method sho:p=1 => --method: {UNKNOWN:'sho'}; {DID_YOU_MEAN:shi}
compare good.json --method shi:p
    => --method: {NO_VALUE:'p'}; write METHOD:OPTION=VALUE, as in shi:p=10
compare good.json --method shi:p=x
    => --method: p: 'x' is not a number; {IT_MUST_BE:{OF_P}}
compare good.json --method shi:p=-1
    => --method: p: {OUT_OF_RANGE:-1.0}; {IT_MUST_BE:{OF_P}}
compare good.json --method shi:p=1,p=2
    => --method: p is set twice in shi:p=1,p=2; {LEAVE_ONE_OUT}
compare good.json --method fixed-point:scale=perhaps
    => --method: scale: 'perhaps' is neither true nor false; write true or false
compare good.json --sweep p => --sweep: {LACKS_VALUE:'p'}; {WRITE_SWEEP}
compare good.json --sweep p=1,,2 => --sweep: {LACKS_VALUE:'p=1,,2'}; {WRITE_SWEEP}
compare good.json --sweep q=1,2
    => --sweep: 'q' is not an option of any method; choose one of p, k-star, rho, sigma,
    omega, anderson, start-slack, regularization, cover, ties, beta, walkers, seed,
    restarts, scale, finish, presolve
compare good.json --sweep k-star=2.5
    => --sweep: k-star: {OUT_OF_RANGE:2.5}; {IT_MUST_BE:{WHOLE:1}}
compare good.json --sweep rho=0.1,0.95
    => --sweep: rho: {OUT_OF_RANGE:0.95}; {IT_MUST_BE:{OF_RHO}}
compare good.json --sweep p=1,10 --p 5
    => --sweep: --p cannot be combined with it; {LEAVE_ONE_OUT}
compare good.json --method shi:p=3 --sweep p=1,10
    => --sweep: p is also set by shi:p=3; {LEAVE_ONE_OUT}
compare good.json --method newton --sweep p=1,10
    => --sweep: p has no effect with newton; add --method shi
""",
    GOOD,
)

STARTS = commands(
    r"""
solve good.json --x0 1 => --x0: {ENTRIES:1 entry|2 unknowns}; {AGREE}
solve good.json --x0 1,nan => --x0[1]: {HAS_NOT_FINITE:'nan'}; {FINITE}
solve good.json --x0 start.csv => --x0: {NOT_TYPED:'start.csv'}; {TYPE_NUMBERS}
solve good.json --z0 a,b => --z0: {NOT_TYPED:'a,b'}; {TYPE_NUMBERS}
solve good.json --z0 1e308,1 => good.json: M z0 + q[0]: {NOT_FINITE}; {FINITE}{FROM_0}
{"z": [0.5, 0.5], "w": [0, 0]} > r.json
solve good.json --x0 r.json --z0 1,1 => --z0: {TWO_STARTS:--x0}; {LEAVE_ONE_OUT}
solve paper-example-1 --basis basic,basic,basic,basic --z0 1,1,1,1
    => --basis: {TWO_STARTS:--z0}; {LEAVE_ONE_OUT}
solve paper-example-1 --basis basic,basic,basic,basic --method lemke
    => --basis: {NO_START:lemke}; {LEAVE_IT_OUT}
solve paper-example-1 --method lemke --x0 1,1,1,1
    => --x0: {NO_START:lemke}; {LEAVE_IT_OUT}
solve paper-example-1 --method milp --z0 1,1,1,1
    => --z0: {NO_START:milp}; {LEAVE_IT_OUT}
compare paper-example-1 --method lemke --method milp --z0 1,1,1,1
    => --z0: {NO_EFFECT:lemke and milp, which use no starting point}; {LEAVE_IT_OUT}
solve paper-example-1 --basis missing.json
    => --basis: 'missing.json' is neither a file nor a basis; write lower,basic,upper or
    name a file
solve paper-example-1 --basis Basic,basic,basic,basic
    => --basis[0]: {IS:the text 'Basic'}; {A_STATE}{FROM_0}
solve paper-example-1 --basis basic,upper,lower,basic
    => --basis[1]: {NO_SUCH_BOUND:upper}; {OTHER_STATE}{FROM_0}
{"M": [[2, 0], [0, 2]], "q": [-1, -1], "lower": [0, null], "upper": 1} > mixed.json
solve mixed.json --basis lower,lower
    => --basis[1]: {NO_SUCH_BOUND:lower}; {OTHER_STATE}{FROM_0}
{"M": [[2, 0], [0, 2]], "q": [-1, -1], "lower": [0, null], "upper": 1} > mixed.json
solve mixed.json --basis upper,upper,lower
    => --basis: {ENTRIES:3 entries|2 unknowns}; {AGREE}
""",
    GOOD,
)

BOUNDS = commands(
    r"""
solve good.json --lower zero => --lower: {NOT_TYPED:'zero'}; {TYPE_BOUNDS}
compare good.json good.json --lower zero => --lower: {NOT_TYPED:'zero'}; {TYPE_BOUNDS}
solve good.json --lower 1 --upper 0
    => --lower[0]: {ABOVE:1|upper[0]|0}; {IN_ORDER}{FROM_0}
solve good.json --upper 1/0,2 => --upper: {HAS_NO_FRACTION:'1/0'}; {FRACTIONS}
solve good.json --lower 5 --upper 9 --infinity 4
    => --infinity: lower[0]: {INFINITE_AS:infinite|5|4}; {NO_BOUND_BELOW}{FROM_0}
{"A": [[1]], "B": [[1]]} > game.json
solve game.json --lower 1 => --lower: {FOR_M_AND_Q:a game}; {LEAVE_IT_OUT}
bench quick --infinity 1e20
    => --infinity: {NO_EFFECT_ON:the problems of a suite}; name a file, or leave it out
0\n0\n | solve good.json --lower - --upper -
    => standard input: {READ_ONCE}; {NAME_A_FILE}
0\n0\n | check good.json 1,1 --lower - --upper -
    => standard input: {READ_ONCE}; {NAME_A_FILE}
0\n0\n | inspect good.json --lower - --upper -
    => standard input: {READ_ONCE}; {NAME_A_FILE}
0\n0\n | compare good.json --lower - --upper -
    => standard input: {READ_ONCE}; {NAME_A_FILE}
""",
    GOOD,
)

# M, M and q in one file, and q in a file.
OF_Q = commands(
    r"""
solve M.csv --q q.csv => --q: {NO_OPTION:lcp solve}; {Q_BY_NAME}
path M.csv --q=q.csv => --q: {NO_OPTION:lcp path}; {Q_BY_NAME}
solve good.json q.csv => q.csv: {NOT_NEEDED:good.json}; {GIVE_ALONE}
inspect good.json none.json => none.json: {NOT_NEEDED:good.json}; {GIVE_ALONE}
solve q.csv M.csv => q.csv: holds q, and M.csv M; name M first: M.csv q.csv
solve M.csv Mq.csv => Mq.csv: {BEGINS_WITH_M}; {ALONE_IF_M_AND_Q}
convert good.json own.mat => own.mat: {NO_SUCH_FILE}; to write it, give -o own.mat
""",
    {**GOOD, "Mq.csv": "2,0,-1\n0,2,-1\n"},
)

OUTPUTS = commands(
    rf"""
solve good.json -o nowhere/x.json
    => nowhere/x.json: there is no folder FOLDER/nowhere; {{CREATE_FIRST}}
solve good.json -o good.json/x.json
    => good.json/x.json: there is no folder FOLDER/good.json; {{CREATE_FIRST}}
solve good.json -o results => results: {{DIRECTORY}}; {{NAME_A_FILE}}
solve good.json -o '' => the name of the output is empty; {{NAME_A_FILE}}
solve good.json -o /proc/x.json
    => /proc/x.json: {{CANNOT_BE_WRITTEN:No such file or directory}}; {{OTHER_PLACE}}
solve good.json -o loop
    => loop: {{CANNOT_BE_WRITTEN:Too many levels of symbolic links}}; {{OTHER_PLACE}}
solve good.json -o {LONG_NAME}
    => {CUT_NAME}: {{CANNOT_BE_WRITTEN:File name too long}}; {{OTHER_PLACE}}
solve good.json -o json
    => --output: json is a format; {{GIVE_JSON}}, or a name with a suffix
solve good.json -o result.pdf => result.pdf: {{NO_FORMAT:.pdf}}; {{SUFFIXES}}
solve good.json -o result.xlsx => result.xlsx: {{NO_FORMAT:.xlsx}}; {{SUFFIXES}}
solve good.json --trace --format json -q
    => --trace: {{NO_EFFECT:--quiet}}; {{LEAVE_IT_OUT}}
solve good.json --bound -q => --bound: {{NO_EFFECT:--quiet}}; {{LEAVE_IT_OUT}}
solve good.json --bound --format csv
    => --bound: {{NO_EFFECT_ON:the format csv, which holds no proofs}}; {{LEAVE_IT_OUT}}
solve good.json --columns k --format json
    => --columns: has no effect on the iterates in json, which have these anyway;
    {{LEAVE_IT_OUT}}
solve good.json --columns k -q
    => --columns: has no effect where no iterates are shown; {{LEAVE_IT_OUT}}
convert bimatrix -o b.mps
    => b.mps: is for programs, and the problem is not made from one; use .json, .npz or
    .mat
""",
    GOOD,
)

PROBLEM = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}'
INPUTS = {
    "p.json": PROBLEM,
    "soft.json": Path("p.json"),
    "to.json": PROBLEM.replace("-5", "5"),
    "v.json": "[1, 1]",
    "g.json": '{"A": [[1, 0], [0, 1]], "B": [[0, 1], [1, 0]]}',
    "M.csv": "2,1\n1,2\n",
    "q.csv": "-5\n-6\n",
    "p.q.mtx": "%%MatrixMarket matrix array real general\n2 1\n-5\n-6\n",
    "in/a.json": PROBLEM,
}
OVERWRITTEN = commands(
    r"""
solve p.json -o p.json => p.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
solve p.json -o in/../p.json => in/../p.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
solve p.json -o soft.json => soft.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
solve M.csv q.csv -o q.csv => q.csv: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
solve in -o in/a.json => in/a.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
solve p.json --lower v.json -o v.json => v.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
solve p.json --x0 v.json -o v.json => v.json: {INPUT_OF_RUN}; {OTHER_OUTPUT}
solve p.json --basis v.json -o v.json => v.json: {INPUT_OF_RUN}; {OTHER_OUTPUT}
solve p.json --all -o p.json => p.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
compare p.json -o p.json => p.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
convert p.json -o p.json => p.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
convert M.csv p.q.mtx -o p.mtx => p.q.mtx: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
1\n1\n > t.csv
convert M.csv q.csv --upper t.csv -o t.csv => t.csv: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
bench p.json -o p.json => p.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
bench in -o in/a.json => in/a.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
path p.json to.json -o to.json => to.json: {HOLDS_PROBLEM}; {OTHER_OUTPUT}
""",
    INPUTS,
)

MANY = commands(
    r"""
solve good.json none.json --trace => --trace: {BUT_IN_JSON}; {GIVE_JSON}
solve good.json none.json --every 3 => --every: {BUT_IN_JSON}; {GIVE_JSON}
solve good.json none.json --format latex
    => --format: latex is for one problem only; {OR_COMPARE}
solve good.json none.json --jobs 2 --cluster tcp://nowhere:1
    => --jobs: {NO_EFFECT:--cluster, which uses the workers of the
    cluster}; {LEAVE_IT_OUT}
solve good.json none.json --resume nowhere/log.jsonl
    => nowhere/log.jsonl: there is no folder FOLDER/nowhere; {CREATE_FIRST}
solve good.json none.json --resume l6.csv
    => --resume: there is no log l6.csv; name a log or a new FILE.jsonl
solve good.json none.json --resume q.csv => q.csv: {NO_LOG}; {A_LOG}
{"M": [[2]], "q": [-1] > bad.json
solve good.json none.json --resume bad.json => bad.json: {NO_LOG}; {A_LOG}
solve good.json none.json --resume log.jsonl -o b.jsonl
    => --output: {NO_EFFECT:--resume, which continues its file}; {LEAVE_IT_OUT}
solve steps --sequence --format json --method lemke
    => --method: {STATES_OF_LAST}; {LEAVE_IT_OUT}
solve steps --sequence --format json --jobs 1
    => --jobs: {STATES_OF_LAST}; {LEAVE_IT_OUT}
solve steps --sequence --format json --cluster tcp://localhost:1
    => --cluster: {STATES_OF_LAST}; {LEAVE_IT_OUT}
solve steps --sequence --format json --trace
    => --trace: {STATES_OF_LAST}; {LEAVE_IT_OUT}
solve steps --sequence --format json --z0 1,1,1
    => --z0: {STATES_OF_LAST}; {LEAVE_IT_OUT}
solve steps --sequence --format json --method auto:presolve=false
    => --method: {STATES_OF_LAST}; {LEAVE_IT_OUT}
solve steps --sequence --format json --p 2 => --p: {STATES_OF_LAST}; {LEAVE_IT_OUT}
solve steps/0.json --sequence --all => --sequence: {OWN_METHOD}; {LEAVE_IT_OUT}
solve inside/deeper.json
    => inside/deeper.json: is a folder without problem files; their suffixes are .json,
    .csv, .mtx, .npz, .npy, .mat, .mps, .qps, .lp, .nfg, .nl, .efg, .json.gz, .csv.gz,
    .mtx.gz, .mps.gz, .qps.gz, .lp.gz, .nfg.gz, .nl.gz, .efg.gz
""",
    {
        **GOOD,
        "inside/deeper.json": None,
        "steps/0.json": '{"M": [[2, 1], [1, 2]], "q": [-1, -1]}',
        "steps/1.json": '{"M": [[2, 1], [1, 2]], "q": [-1, -2]}',
    },
)

# A matrix whose unknowns all depend on each other.
LARGE = {
    "format": "coo",
    "shape": [900, 900],
    "rows": [*range(900), *range(899)],
    "cols": [*range(900), *range(1, 900)],
    "values": [2] * 900 + [1] * 899,
}
ALL = commands(
    r"""
solve murty.json --all --p 3 => --p: {OWN_METHOD}; {LEAVE_IT_OUT}
solve murty.json --all --z0 1,1 => --z0: {OWN_METHOD}; {LEAVE_IT_OUT}
solve murty.json --all --trace => --trace: {OWN_METHOD}; {LEAVE_IT_OUT}
solve murty.json --all --jobs 2 => --jobs: {OWN_METHOD}; {LEAVE_IT_OUT}
solve murty.json --all --method shi => --method: {OWN_METHOD}; {LEAVE_IT_OUT}
solve murty.json other.json --all
    => --all: {ONE_PROBLEM}; give the others to another run
solve murty.json --max-solutions 3
    => --max-solutions: has no effect without --all; add --all
solve large.json --all => large.json: M: {DEPENDENT:900}; {UP_TO_500}
solve nowhere.json --all => nowhere.json: {NO_SUCH_FILE}; {DID_YOU_MEAN:other.json}
solve murty.json --minimize z1 --all => --minimize: {NO_EFFECT:--all}; {LEAVE_ONE_OUT}
solve murty.json --minimize z1 --maximize z2
    => --maximize: {NO_EFFECT:--minimize}; {LEAVE_ONE_OUT}
solve murty.json --maximize z1 --method lemke
    => --method: {NO_EFFECT:--maximize, which has a fixed method}; {LEAVE_IT_OUT}
solve murty.json --maximize z1 --trace
    => --trace: {NO_EFFECT:--maximize, which has a fixed method}; {LEAVE_IT_OUT}
solve murty.json --minimize z1 --plot a.svg
    => --plot: {NO_EFFECT:--minimize}; {LEAVE_IT_OUT}
solve murty.json --minimize foo => --minimize: {NAMES:'foo'}; {USE_NAMES:2}
solve murty.json --minimize z9 => --minimize: {NAMES:'z9'}; {USE_NAMES:2}
solve murty.json --minimize 'z1 +'
    => --minimize: {IN_PLACE_OF:'+'|a term}; write numbers and names with + and -
    between them, such as 2 z1 - 1/3 z2 + "a name with blanks"
solve sexes.json --maximize '"payoff of Ann"'
    => --maximize: {NAMES:'payoff of Ann'};
    {USE_NAMES:4, or 'payoff of row', or 'payoff of column'}
solve sexes.json --maximize '"payoff of row" + opera'
    => --maximize: has 'opera' in addition to payoffs, which are not linear in the
    unknowns; use 'payoff of row' and 'payoff of column' alone
""",
    {
        "murty.json": '{"M": [[1, 2], [2, 1]], "q": [-1, -1], "names": ["price", "s"]}',
        "other.json": '{"M": [[2, 1], [1, 3]], "q": [-5, -6]}',
        "sexes.json": (
            '{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["opera", "match"]}'
        ),
        "large.json": json.dumps({"M": LARGE, "q": [-1] * 900}),
    },
)

PATHS = commands(
    r"""
path first.json
    => FROM TO: {FILES_NOT:2|3|1}; give two problems, or a file with M and two with q,
    or a problem and --direction
path first.json last.json other.json --direction 1,1 --to 1
    => --direction: takes 1 or 2 files, not 3; give one problem: a file, or a file with
    M and one with q
path first.json --direction 1,1 => --direction: has no last t; add --to, the last t
path first.json --direction 1,1,1 --to 1
    => --direction: {ENTRIES:3 entries|2 unknowns}; {AGREE}
path first.json --direction 1,x --to 1 => 1,x: {NO_SUCH_FILE}; {CHECK_PATH}
path first.json --direction 1,1e300 --to 1e300
    => --direction: q[1]: {NOT_FINITE}; {FINITE}{FROM_0}
path first.json other.json => other.json: M: {OTHER_M}; {ONE_M}
path first.json other.json -o q.csv => other.json: M: {OTHER_M}; {ONE_M}
path first.json larger.json => larger.json: n: {TWO_VALUES:2|3}; {SAME_UNKNOWNS}
path first.json bounded.json
    => bounded.json: upper[0]: {FINITE_IN_ONE}; {FINITE_IN_BOTH}{FROM_0}
path first.json last.json --from 1
    => --to: is 1, and the path begins at t = 1; give a larger number
path first.json last.json --to nan => --to: {HAS_NOT_FINITE:'nan'}; {FINITE}
path first.json last.json --to 1e400
    => --to: is too large; give a number in double precision
path first.json last.json --at 2
    => --at: is 2, and the path goes from 0 to 1; give values between these
path first.json last.json --at a => --at: 'a' is not a list of numbers; write 0,0.5,1
path first.json last.json --max-breakpoints 0
    => --max-breakpoints: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE:1}}
path first.json last.json -o json
    => --output: json is a format; {GIVE_JSON}, or a name with a suffix
path first.json last.json -o a.xyz => a.xyz: {NO_FORMAT:.xyz}; {SUFFIXES}
path - - => standard input: {READ_ONCE}; {NAME_A_FILE}
""",
    {
        "first.json": '{"M": [[2, 1], [1, 2]], "q": [1, 1]}',
        "last.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
        "other.json": '{"M": [[2, 1], [1, 3]], "q": [-5, -6]}',
        "larger.json": '{"M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "q": [1, 1, 1]}',
        "bounded.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "upper": [1, null]}',
        "q.csv": "1,1\n",
    },
)

MAKE = commands(
    r"""
make => FAMILY: {MISSING}; name a family; lcp make --list shows them
make murty -n 0 => -n: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE_TO:1|100000000}}
make murty -n 100000000000000000000000000000
    => -n: {OUT_OF_RANGE:100000000000000000000000000000};
    {IT_MUST_BE:{WHOLE_TO:1|100000000}}
make curtis-han-robinson -n 10
    => -n: is 10, and curtis-han-robinson has 3 unknowns; {LEAVE_IT_OUT}
make murty --seed 1
    => --seed: {NO_EFFECT_ON:murty, which has no random entries}; {LEAVE_IT_OUT}
make lp --seed -1 => --seed: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
make lp -n many
    => -n: 'many' is not a number; {IT_MUST_BE:{WHOLE_TO:1|100000000}}
make contact --set seed=1
    => --set: {NO_PARAMETER:'seed'|contact}; choose one of friction, compliance
make contact --set frictoin=3
    => --set: {NO_PARAMETER:'frictoin'|contact}; {DID_YOU_MEAN:friction}
make contact --set friction=much => --set: {NO_VALUE_OF:'much'|friction}; {A_NUMBER}
make contact --set friction=nan
    => friction: {OUT_OF_RANGE:nan}; {IT_MUST_BE:{OF_FRICTION}}
make diagonal --set decades => --set: {NO_VALUE:'decades'}; write NAME=VALUE
make diagonal --set decades= => --set: {NO_VALUE_OF:''|decades}; {A_WHOLE_NUMBER}
make diagonal --set decades=1_0 => --set: {NO_VALUE_OF:'1_0'|decades}; {A_WHOLE_NUMBER}
make diagonal --set decades=3 --set decades=4
    => --set: decades is set twice; {LEAVE_ONE_OUT}
make harker-pang --set symmetric=maybe
    => --set: {NO_VALUE_OF:'maybe'|symmetric}; give true or false
make --list murty => FAMILY: {NO_EFFECT:--list}; {LEAVE_ONE_OUT}
""",
    {
        "program.json": '{"Q": [[2, 0], [0, 2]], "c": [-3, 1]}',
        "game.json": '{"A": [[3, 0], [0, 2]], "B": [[0, 2], [3, 0]]}',
    },
)

MODELS = commands(
    r"""
solve market.nl --exact => --exact: {NO_EFFECT_ON:a nonlinear model}; {LEAVE_IT_OUT}
check market.nl 2,3 --exact => --exact: {NO_EFFECT_ON:a nonlinear model}; {LEAVE_IT_OUT}
solve market.nl --upper 3 => --upper: {NO_EFFECT_ON:a nonlinear model}; {LEAVE_IT_OUT}
solve market.nl --x0 1,1 => --x0: {NO_EFFECT_ON:a nonlinear model}; {LEAVE_IT_OUT}
solve market.nl --basis basic,basic
    => --basis: {NO_EFFECT_ON:a nonlinear model}; {LEAVE_IT_OUT}
solve market.nl --p 2 => --p: {NO_EFFECT_ON:a nonlinear model}; {LEAVE_IT_OUT}
solve market.nl --method auto:presolve=false
    => --method: auto:presolve=false solves linear problems only, and this model is
    nonlinear; {JOSEPHY_NEWTON}
solve market.nl --method lemke
    => --method: lemke solves linear problems only, and this model is nonlinear;
    {JOSEPHY_NEWTON}
compare market.nl --method shi
    => --method: shi solves linear problems only, and this model is nonlinear;
    {JOSEPHY_NEWTON}
compare market.nl linear.nl
    => --method: fixed-point solves linear problems only, and this model is nonlinear;
    {JOSEPHY_NEWTON}
solve market.nl --method josephy-newton:restarts=-1
    => --method: restarts: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
solve choice.nl --method lemke
    => --method: {NO_EFFECT:the model's objective, which has a fixed method};
    {LEAVE_IT_OUT}
solve market.nl --all => market.nl: {NONLINEAR}; {HELP_MODELS}
solve market.nl --minimize z1 => market.nl: {NONLINEAR}; {HELP_MODELS}
convert market.nl => market.nl: {NONLINEAR}; {HELP_MODELS}
solve market.nl --z0 1 => --z0: {ENTRIES:1 entry|2 unknowns}; {AGREE}
check market.nl 2 => 2: z: {ENTRIES:1 entry|2 unknowns}; {AGREE}
solve undefined.nl --z0 1
    => undefined.nl: z0: F is nan there, in row v0; {WHERE_F_IS_DEFINED}{FROM_0}
solve empty.nl => empty.nl: {EMPTY}; write the model again
two\n\nOptions\n3\n1\n1\n0\n1\n0\n1\n1\n1.5\nobjno 0 0\n > one.sol
check market.nl one.sol
    => one.sol: {ENTRIES:1 value of 1 variable|3 of the model}; {SOLVE_AGAIN}
cut\n\nOptions\n3\n1\n1\n0\n2\n0\n3\n3\n2.5\n3 > cut.sol
check market.nl cut.sol
    => cut.sol: {ENTRIES:2 values of 3 variables|3 of the model}; {SOLVE_AGAIN}
nothing > bad.sol
check market.nl bad.sol
    => bad.sol: is no .sol file in text; write it as solvers for AMPL do, in text
market -AMPL to=1 => 'to=1': unknown option; {DID_YOU_MEAN:tol=}
market -AMPL tol=2 => --tol: {OUT_OF_RANGE:2.0}; {IT_MUST_BE:{OF_TOL}}
market -AMPL tol=x => tol: {IS:'x'}; {IT_MUST_BE:{OF_TOL}}
linear -AMPL restarts=2 => restarts: {NO_EFFECT_ON:a linear model}; {LEAVE_IT_OUT}
twice -AMPL
    => twice.nl: clearing: complements price, and so does market; {A_VARIABLE_EACH}
none -AMPL => none.nl: {NO_SUCH_FILE}; {DID_YOU_MEAN:none.json}
""",
    {**models.FILES, "none.json": "[]"},
)

TREE = (
    'EFG 2 R "entry" { "entrant" "incumbent" }\np "" 1 1 "" { "in" "out" } 0\n'
    'p "" 2 1 "after entry" { "fight" "share" } 0\nt "" 1 "" { -1 -1 }\n'
    't "" 2 "" { 1 1 }\nt "" 3 "" { 0 2 }\n'
)
ANSWERS = commands(
    r"""
check good.json 1,1,1 --exact --tol 0.1 => --tol: {NO_EFFECT:--exact}; {LEAVE_IT_OUT}
{"z": [0], "w": [-1], "certificate": {"kind": "farkas", "vector": [1, 0]}} > proof.json
check none.json proof.json --tol 1e-3 => --tol: {NO_EFFECT_ON:a proof}; {LEAVE_IT_OUT}
{"x": [1, 2]} > answer
check portfolio answer => answer: x: {ENTRIES:2 entries|3 unknowns}; {AGREE}
{"x": [1, 2, 3], "y": [1]} > answer
check portfolio answer => answer: y: {ENTRIES:1 entry|2 unknowns}; {AGREE}
[1, 2] > answer
check portfolio answer
    => answer: z: {ENTRIES:2 entries|6 unknowns}; give 3 for x, 5 for x and y or 6 for z
check entry.efg 1,0,1,1
    => 1,0,1,1: information set after entry of incumbent: has 1, 1 as the probabilities
    of its actions; {PROBABILITIES}
{"information_sets": [{"player": "entrant", "set": 1, "probabilities": ["0", "1"]}]} \
> own.json
check entry.efg own.json
    => own.json: information_sets: {ENTRIES:2 entries|10 unknowns}; give 4 for the
    probabilities of all actions or 10 for z
{"plans": [["1", "1", "0"], ["1", "0", "1"]]} > own.json
check entry.efg own.json --exact => own.json: {NO_Z}; {A_LIST_OR_RESULT}
{"file": "a.json", "digest": "1", "z": [0]}\n{"file": "b.json", "digest": "2", "z": \
[0]} > log.jsonl
check good.json log.jsonl -q => log.jsonl: {ENTRIES:no results|good}; {AS_A_FILE}
{"problem": "good", "z": [0]}\n{"problem": "good", "z": [1]}\n{"problem": "good", "z": \
[2]} > trials.jsonl
check good.json trials.jsonl => trials.jsonl: {ENTRIES:3 results|good}; {AS_A_FILE}
""",
    {**GOOD, "entry.efg": TREE},
)

OTHERS = commands(
    r"""
help solve csv => WORDS: 'solve' is no page; {LEAVE_IT_OUT}
help csv --all => --all: shows all options of a command; name one: lcp help solve --all
solve paper-example-1 --method shi --columns k,aplha
    => --columns: 'aplha' is not a column; {DID_YOU_MEAN:alpha}
solve paper-example-1 --method shi --columns k,factor
    => --columns: shi has no factor; {IT_BELONGS:fixed-point}
solve paper-example-1 --method shi --columns z0
    => --columns: shi has no z0; {IT_BELONGS:lemke}
compare paper-example-1 --method shi --columns k,aplha
    => --columns: 'aplha' is not a column; {DID_YOU_MEAN:alpha}
compare paper-example-1 --method shi --columns k,factor
    => --columns: shi has no factor; {IT_BELONGS:fixed-point}
compare paper-example-1 --method shi --columns z0
    => --columns: shi has no z0; {IT_BELONGS:lemke}
compare paper-example-1 --columns entering
    => --columns: fixed-point and shi have no entering; {IT_BELONGS:lemke}
compare --vary p=1,2
    => --vary: has been removed in version 2.0.0; use --sweep, with -o table.csv or
    --plot figure.svg
compare --sweep q=1
    => --sweep: 'q' is not an option of any method; choose one of p, k-star, rho, sigma,
    omega, anderson, start-slack, regularization, cover, ties, beta, walkers, seed,
    restarts, scale, finish, presolve
make murty -o own.xyz
    => own.xyz: has the unknown suffix .xyz; use .json, .csv, .mtx, .npz, .npy, .mat, or
    .mps or .qps for a program
make murty -o nowhere/own.json
    => nowhere/own.json: there is no folder FOLDER/nowhere; {CREATE_FIRST}
inspect market.nl linear.nl
    => linear.nl: {IS:not needed: market.nl is a model}; {GIVE_ALONE}
inspect market.nl market.nl
    => market.nl: {IS:not needed: market.nl is a model}; {GIVE_ALONE}
solve market.nl q.csv => q.csv: {IS:not needed: market.nl is a model}; {GIVE_ALONE}
inspect linear.nl linear.nl => linear.nl: {NOT_NEEDED:linear.nl}; {GIVE_ALONE}
inspect linear.nl market.nl => market.nl: {NOT_NEEDED:linear.nl}; {GIVE_ALONE}
solve linear.nl q.csv => q.csv: {NOT_NEEDED:linear.nl}; {GIVE_ALONE}
solve good.json --method schafer
    => --method: {UNKNOWN:'schafer'}; {DID_YOU_MEAN:fixed-point}
solve good.json --method Schaefer
    => --method: {UNKNOWN:'Schaefer'}; {DID_YOU_MEAN:fixed-point}
solve good.json --method PSOR => --method: {UNKNOWN:'PSOR'}; {DID_YOU_MEAN:fixed-point}
solve good.json --method vector-division
    => --method: {UNKNOWN:'vector-division'}; {DID_YOU_MEAN:shi}
solve good.json --method simplex => --method: {UNKNOWN:'simplex'}; {DID_YOU_MEAN:lemke}
solve good.json --method ipm => --method: {UNKNOWN:'ipm'}; {DID_YOU_MEAN:interior}
solve good.json --method interior-point
    => --method: {UNKNOWN:'interior-point'}; {DID_YOU_MEAN:interior}
{"M": [], "q": []} > empty.json
solve empty.json --minimize z1
    => --minimize: {NAMES:'z1'}; leave it out: the problem has no unknowns
{"M": [], "q": []} > empty.json
why empty.json --keep z1
    => --keep: 'z1' names nothing in this problem; leave it out: the problem has none
""",
    {**GOOD, **models.FILES},
)

REFUSALS = [
    *(*WORDS, *NUMBERS, *METHODS, *STARTS, *BOUNDS, *OF_Q, *OUTPUTS, *OVERWRITTEN),
    *(*MANY, *ALL, *PATHS, *MAKE, *MODELS, *ANSWERS, *OTHERS),
]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_a_command_line_that_cannot_be_run_is_refused(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line


@pytest.mark.parametrize(
    "command",
    [
        "solve {}",
        "bench {}",
        "kernels {}",
        "solve good.json --{}",
        "solve good.json -m {}",
        "solve good.json -m shi:{}=1",
        "solve good.json -o {}.json",
        "solve good.json --plot {}",
        "solve good.json --maximize {}",
        "path good.json good.json --at {}",
        "why good.json --weights {}",
    ],
)
def test_a_name_of_thousands_of_letters_is_cut_in_the_line(command, refused):
    line = refused(command.format("a" * 5000), GOOD)
    assert "a" * 40 in line
    assert "a" * 41 not in line
    assert len(line) < 300
