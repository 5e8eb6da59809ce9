"""Files that cannot be used are refused in one line with the place, the fault and how
to mend it: problems in each format, programs, games and models, and what is read beside
a problem."""

from functools import partial

import pytest

from ..refusals import changed, commands, contents

PAIR = {
    "good.json": '{"M": [[2, 0], [0, 2]], "q": [-1, -1]}',
    "M.csv": "2,0\n0,2\n",
    "q.csv": "-1\n-1\n",
    "results": None,
}

NAMED = commands(
    r"""
solve elsewhere.txt => elsewhere.txt: {NO_SUCH_FILE}; {CHECK_PATH}
solve goood.json => goood.json: {NO_SUCH_FILE}; {DID_YOU_MEAN:good.json}
solve M.csv qq.csv => qq.csv: {NO_SUCH_FILE}; {DID_YOU_MEAN:q.csv}
solve nowhere/good.json
    => nowhere/good.json: {NO_SUCH_FILE}; there is no folder nowhere
solve '' => the name of a file is empty; {NAME_A_FILE}
inspect results => results: {DIRECTORY}; name a file in it
solve /proc/self/mem
    => /proc/self/mem: cannot be read (Input/output error); make it readable
2,0\n0,2\n | solve - - => standard input: {READ_ONCE}; {NAME_A_FILE}
{"M": [[2, 0], [0, 2]], "q": [-1, -1]} | compare - -
    => standard input: {READ_ONCE}; {NAME_A_FILE}
\xe4 | solve - => standard input: {NOT_UTF_8}; {AS_UTF_8}
{"M": [[1]], "q": [-1]}\n{"M": [[1]], "q": [-1]}\n | inspect -
    => standard input: line 2: has another object below the first one; lcp solve takes a
    problem in each line; give other commands one line, as by sed -n 1p FILE | lcp
    inspect -
""",
    PAIR,
)

CSV = contents(
    "bad.csv",
    r"""
2,0,-1\n0,2\n => line 2: {ENTRIES_WHERE:2 columns|line 1|3}; {EQUAL_COLUMNS}
2,0,-1\n0,2,-1,7\n => line 2: {ENTRIES_WHERE:4 columns|line 1|3}; {EQUAL_COLUMNS}
,a,q\nx\n => line 2: {ENTRIES_WHERE:1 column|line 1|3}; {EQUAL_COLUMNS}
0,2,0,-1\n1,0,2,-1\n => {ROWS_OF:2|4}; {N_ROWS}{OR_HEADED}{AN_INDEX}
2,0,-1,0\n0,2,-1,0\n => {ROWS_OF:2|4}; {N_ROWS}{OR_HEADED}{AN_INDEX}
id,z1,z2,q\n11,2,-1,-1\n12,-0.5,2,0.25\n
    => {ROWS_OF:2|4}; {N_ROWS}{OR_HEADED}{AN_INDEX}
2,0,-1,0,1\n0,2,-1,0,1\n => {ROWS_OF:2|5}; {N_ROWS}{OR_HEADED}
0,1\n2,0\n0,2\n => {ROWS_OF:3|2}; {N_ROWS}{OR_A_FIT}
2,0\n0,2\n => {NO_Q:2 x 2}; {ADD_Q}
2,0,-1\n0,x,-1\n => line 2, column 2: {NO_NUMBER:'x'}; {REAL}
2,0,-1\n0,1+2j,-1\n => line 2, column 2: {NO_NUMBER:'1+2j'}; {REAL}
2;0;-1\n#NV;0;1\n0;2;-1\n => line 2, column 1: {NO_NUMBER:'#NV'}; {REAL}
2,0,-1\n0,1e,-1\n => line 2, column 2: {NO_NUMBER:'1e'}; {REAL}
2,0,-1\n0,True,-1\n => line 2, column 2: {NO_NUMBER:'True'}; {REAL}
2,1,−1\n1,2,-6\n => line 1, column 3: {NO_NUMBER:'−1'}; write the minus sign as -
2,nan,-1\n0,2,-1\n
    => line 1, column 2: {IS:'nan'}; give a finite number in double precision
# M | q\n\n2,0,-1\n0,,-1\n => line 4, column 2: {EMPTY}; {A_NUMBER}
,a,b,q,lower,upper\na,2,1,,0,1\nb,1,2,-6,0,1\n => line 2, column 4: {EMPTY}; {A_NUMBER}
1.000,5;0;-1\n0;2,5;-1\n
    => line 1, column 1: {DECIMAL_COMMA:'1.000,5'}; {ONE_DECIMAL_MARK}
1.000;0;-1\n0;2,5;-1\n
    => line 1, column 1: {DECIMAL_COMMA:'1.000'}; {ONE_DECIMAL_MARK}
a,b,c\n => {HEADER_ALONE}; {ONE_ROW_PER_LINE}
a,b,c,q\n2,1,-5\n1,2,-6\n
    => line 1: has 4 names above 3 columns; give each column one name
q;z1;z2\n1;2;3\n4;5;6\n
    => line 1, column 1: is headed q, which must be the last column; reorder the columns
a,b,lower\n2,0,0\n0,2,0\n
    => line 1: has headings of bounds, but none for q; head the column of q with q
a,b,q,q,lower\n2,0,-1,-1,0\n0,2,-1,-1,0\n => line 1: heads 2 columns q; {KEEP_ONE}
a,b,q,lb\n2,0,-1,0\n0,2,-1,0\n
    => line 1, column 4: is headed 'lb'; call it lower, if it holds bounds of z
a,b,c,q,lower\n2,0,0,-1,0\n0,2,0,-1,0\n
    => has 2 rows and 3 columns of M; give M as many columns, in addition to q and
    lower
a,b,q,lower,upper\n2,0,-1,0,1\n0,2,-1,2,1\n
    => lower[1]: {ABOVE:2|upper[1]|1}; {IN_ORDER}{FROM_0}
2,0,-1\n0,"2,-1\n => line 2: {NOT_CSV}; {CORRECT_IT_THERE}
2,0,-1\n0,"2"3,-1\n => line 2: {NOT_CSV}; {CORRECT_IT_THERE}
2,0,-1\n0,\xbd,-1\n => {NOT_UTF_8}; {AS_UTF_8}
\xff\xfe2\x00,\x00-\x001\x00\n => {NOT_UTF_8}; {AS_UTF_8}
""",
)

JSON = contents(
    "bad.json",
    r"""
=> {EMPTY}; give M and q, as JSON or CSV
{"M": [[2, 0], [0, 2]], "q": [-1, -1], "name": "Sch\xe4fer"} => {NOT_UTF_8}; {AS_UTF_8}
<!DOCTYPE html> => is HTML or XML; was a web page saved instead?
{"M": [[2, 0], [0, 2]], "q": [-1,\n
    => line 2, column 1: {ENDS_TOO_EARLY}; {FILE_CUT_OFF}
{"M": [[2, 0], [0, 2]], "q: [-1, -1]}
    => line 1, column 25: {ENDS_TOO_EARLY}; {FILE_CUT_OFF}
{\n"M": [[1]],\n"q": [1,]}
    => line 3, column 8: {COMMA_BEFORE:]}; {REMOVE_IT}
{"M": [[2, 0], [0, 2]], "q": [-1, nan]}
    => line 1, column 35: {NOT_JSON:'nan]}'}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], "q": [-1, -1,]}
    => line 1, column 37: {COMMA_BEFORE:]}; {REMOVE_IT}
'M' => line 1, column 1: {NOT_JSON:"'M'"}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], "q": [-1, -1]}{"M": [[2, 0], [0, 2]], "q": [-1, -1]}
    => line 1, column 39: {NOT_JSON:'{"M": [[2, 0'}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], "q": [-1, 0x2]}
    => line 1, column 36: {NOT_JSON:'x2]}'}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], "q": [-1, -1 -1]}
    => line 1, column 38: {NOT_JSON:'-1]}'}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], "q" [-1, -1]}
    => line 1, column 29: {NOT_JSON:'[-1, -1]}'}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], q: [-1, -1]}
    => line 1, column 25: {NOT_JSON:'q: [-1, -1]}'}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], "\\q": [-1, -1]}
    => line 1, column 26: {NOT_JSON:'\\q": [-1, -1'}; {CORRECT_IT_THERE}
{"M": [[2, 0], [0, 2]], "q\x09": [-1, -1]}
    => line 1, column 27: {NOT_JSON:'\t": [-1, -1]'}; {CORRECT_IT_THERE}
[[1, 2], [3, 4]]
    => {IS:a list}; give an object with the keys M and q, or one in each line
{"version": "1", "status": "solved", "z": [1]} => {RESULT}; {NAME_PROBLEM}
{"F": ["z1^2 - 1"]}
    => is a nonlinear problem; give M and q of a linear one, or a .nl model (lcp help
    models)
{"A": [[1]], "B": [[1]], "C": [[1]]} => {MORE_PLAYERS}; {NO_LCP}
{"A": [[[1, 2]]], "B": [[1]]} => {MORE_PLAYERS}; {NO_LCP}
{"payoffs": [[3, 0], [0, 2]]}
    => payoffs: {NO_KEY:a problem}; give the payoffs of two players as A and B; those by
    pairs of players need the key players too
{"A": [[1], [2]], "b": [1, 2]}
    => A: {NO_KEY:a problem}; give the key lsq, true, for a fit, findex for contact, or
    M and q in their place
{"A": [[1]], "q": [1]} => A: {NO_KEY:a problem}; {DID_YOU_MEAN:M}
{"matrix": [[1]], "q": [1]} => matrix: {NO_KEY:a problem}; {DID_YOU_MEAN:M}
{"q": [1]} => M: {MISSING}; add the key M
{"M": [[1]]} => {NO_Q:1 x 1}; {ADD_Q}
{"M": [[1]], "lower": 0} => q: {MISSING}; add q, or name the file of q after this one
{"M": 3, "q": [-1, -1]} => M: {IS:a number}; {A_LIST_OF_ROWS}
{"M": [2, 0], "q": [-1, -1]} => M[0]: {IS:a number}; {A_ROW}{FROM_0}
{"M": [[2, 0], [1]], "q": [-1, -1]}
    => M[1]: {ENTRIES_WHERE:1 entry|M[0]|2}; {ALIKE_ROWS}{FROM_0}
{"M": [[2, 0, 1], [0, 2, 1]], "q": [-1, -1]} => M: {SHAPE:2|3}; {SQUARE}
{"M": [], "q": [-1, -1]} => M: {SHAPE_BESIDE:0 x 0|q|2 entries}; {AGREE}
{"M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "q": [-1, -1]}
    => M: {SHAPE_BESIDE:3 x 3|q|2 entries}; {AGREE}
{"M": [[2, 0], [0, 2]], "q": [1]} => M: {SHAPE_BESIDE:2 x 2|q|1 entry}; {AGREE}
{"M": [[2, 0], ["O", 2]], "q": [-1, -1]} => M[1][0]: {IS:the text 'O'}; {REAL}{FROM_0}
{"M": [[2, "z1*z2"]], "q": [1]} => M[0][1]: {IS:the text 'z1*z2'}; {REAL}{FROM_0}
{"M": [[2, 0], [NaN, 2]], "q": [-1, -1]} => M[1][0]: {NOT_FINITE}; {FINITE}{FROM_0}
{"M": [[2, 0], [0, 1e999]], "q": [-1, -1]} => M[1][1]: {NOT_FINITE}; {FINITE}{FROM_0}
{"M": [[2, 0], [0, 2]], "q": null} => {NO_Q:2 x 2}; {ADD_Q}
{"M": [[2, 0], [0, 2]], "q": [1, false]} => q[1]: {IS:false}; {REAL}{FROM_0}
{"M": [[2, 0], [0, 2]], "q": [-1, "1+2j"]} => q[1]: {IS:the text '1+2j'}; {REAL}{FROM_0}
{"M": [[2, 0], [0, 2]], "q": [-1, {}]} => q[1]: {IS:an object}; {REAL}{FROM_0}
""",
)
LONG_INTEGER = contents(
    "bad.json",
    "=> q[0]: {NOT_FINITE}; {FINITE}{FROM_0}",
    made=lambda _: f'{{"M": [[2, 0], [0, 2]], "q": [{10**400}, 1]}}',
)

# Beside M and q.
KEYS = contents(
    "bad.json",
    r"""
"%": 1
    => %: {NO_KEY:a problem}; the keys are name, source, note, M, q, lower, upper, x0,
    x1, solution, verdict, origin, names
"q": [1, 1] => q: occurs twice; {KEEP_ONE}
"name": 3 => name: {IS:a number}; {A_TEXT}
"names": "ab" => names: {IS:the text 'ab'}; {A_LIST_OF_NAMES}
"names": ["a", 2] => names[1]: {IS:a number}; {A_TEXT}{FROM_0}
"names": ["a"] => names: {ENTRIES:1 name|2 unknowns}; {AGREE}
"x0": [1] => x0: {ENTRIES:1 entry|2 unknowns}; {AGREE}
"x1": [1, 2, 3] => x1: {ENTRIES:3 entries|2 unknowns}; {AGREE}
"solution": true => solution: {IS:true}; give a list of numbers, or a list of such lists
"solution": [[1, 2], [1]] => solution[1]: {ENTRIES:1 entry|2 unknowns}; {AGREE}
"solution": [[1, 2], [3, "4x"]] => solution[1][1]: {IS:the text '4x'}; {REAL}{FROM_0}
"verdict": "maybe" => verdict: {UNKNOWN:'maybe'}; use one of infeasible, unsolvable, ray
"lower": "O" => lower: {IS:the text 'O'}; {ONE_OR_A_LIST}
"lower": {} => lower: {IS:an object}; {ONE_OR_A_LIST}
"lower": [0, "one"] => lower[1]: {IS:the text 'one'}; {REAL}{FROM_0}
"lower": [0, NaN] => lower[1]: is not a number; give inf for no bound{FROM_0}
"lower": [0, 1e999] => lower[1]: is infinite; {NO_BOUND_BELOW}{FROM_0}
"upper": -Infinity => upper[0]: is minus infinity; {NO_BOUND_ABOVE}{FROM_0}
"upper": -1 => lower[0]: {ABOVE:0|upper[0]|-1}; {IN_ORDER}{FROM_0}
"lower": [0, 2], "upper": [1, 1] => lower[1]: {ABOVE:2|upper[1]|1}; {IN_ORDER}{FROM_0}
"lower": 0, "upper": [1] => upper: {ENTRIES:1 entry|2 unknowns}; {AGREE}
"l": 0 => l: {NO_KEY:a problem}; {DID_YOU_MEAN:lower}
"minimize": 0
    => minimize: {NO_KEY:a problem}; the keys are name, source, note, M, q, lower,
    upper, x0, x1, solution, verdict, origin, names
"L": 0 => L: {NO_KEY:a problem}; {DID_YOU_MEAN:lower}
"lb": 0 => lb: {NO_KEY:a problem}; {DID_YOU_MEAN:lower}
"lo": 0 => lo: {NO_KEY:a problem}; {DID_YOU_MEAN:lower}
"low": 0 => low: {NO_KEY:a problem}; {DID_YOU_MEAN:lower}
"lowerbound": 0 => lowerbound: {NO_KEY:a problem}; {DID_YOU_MEAN:lower}
"u": 0 => u: {NO_KEY:a problem}; {DID_YOU_MEAN:upper}
"U": 0 => U: {NO_KEY:a problem}; {DID_YOU_MEAN:upper}
"ub": 0 => ub: {NO_KEY:a problem}; {DID_YOU_MEAN:upper}
"hi": 0 => hi: {NO_KEY:a problem}; {DID_YOU_MEAN:upper}
"high": 0 => high: {NO_KEY:a problem}; {DID_YOU_MEAN:upper}
"upperbound": 0 => upperbound: {NO_KEY:a problem}; {DID_YOU_MEAN:upper}
"bounds": [0, 1] => bounds: {NO_KEY:a problem}; {BOUNDS_AS}
"box": [0, 1] => box: {NO_KEY:a problem}; {BOUNDS_AS}
""",
    made=lambda keys: f'{{"M": [[2, 0], [0, 2]], "q": [-1, -1], {keys}}}',
)

# M by its entries, for which the row has keys in place of some of these.
BY_ENTRIES = """"format": "coo", "shape": [2, 2], "rows": [0, 1], "cols": [0, 1], \
"values": [2, 2]"""
SPARSE = contents(
    "bad.json",
    r"""
"format": "coo",  ->  => M.format: {MISSING}; add the key format
"shape": [2, 2],  ->  => M.shape: {MISSING}; add the key shape
"rows": [0, 1],  ->  => M.rows: {MISSING}; add the key rows
"cols": [0, 1],  ->  => M.cols: {MISSING}; add the key cols
, "values": [2, 2] ->  => M.values: {MISSING}; add the key values
"coo" -> "csr" => M.format: {IS:the text 'csr'}; the only format is "coo"
"coo" -> 3 => M.format: {IS:a number}; the only format is "coo"
"rows" -> "row" => M.row: {NO_KEY:a problem}; {DID_YOU_MEAN:rows}
"rows": [0, 1] -> "rows": [0, 2]
    => M.rows[1]: {ENTRY_OUTSIDE:(2, 1)|2 x 2}; {WHOLE_FROM_TO:0|1}
"cols": [0, 1] -> "cols": [0, -1]
    => M.cols[1]: {ENTRY_OUTSIDE:(1, -1)|2 x 2}; {WHOLE_FROM_TO:0|1}
"cols": [0, 1] -> "cols": [0.5, 1]
    => M.cols[0]: {ENTRY_OUTSIDE:(0, 0.5)|2 x 2}; {WHOLE_FROM_TO:0|1}
"rows": [0, 1] -> "rows": [0, true] => M.rows[1]: {IS:true}; {REAL}{FROM_0}
"rows": [0, 1], "cols": [0, 1] -> "rows": [1, 1], "cols": [0, 0]
    => M.rows[1]: {ENTRY_AGAIN:(1, 0)}; {ENTRY_ONCE}{FROM_0}
"rows": [0, 1] -> "rows": [0] => M.rows: {ENTRIES:1 entry|2 values}; {AGREE}
"shape": [2, 2] -> "shape": [1000000000000, 1000000000000]
    => M.shape: {SHAPE_BESIDE:1e+12 x 1e+12|q|2 entries}; {AGREE}
"shape": [2, 2] -> "shape": 2 => M.shape: {IS:a number}; {A_LIST}
"values": [2, 2] -> "values": [2, NaN]
    => M.values[1]: {NOT_FINITE}; {FINITE}{FROM_0}
""",
    made=lambda parts: f'{{"M": {{{changed(BY_ENTRIES, parts)}}}, "q": [-1, -1]}}',
)

# Numbers may be texts; texts that are no numbers, and null, are named by their places.
TEXTS = contents(
    "bad.json",
    r"""
{"M": [[2, "x"], [1, 2]], "q": [-5, -6]} => M[0][1]: {IS:the text 'x'}; {REAL}{FROM_0}
{"M": [["1/0", 1], [1, 2]], "q": [-5, -6]}
    => M[0][0]: {IS:the text '1/0'}; {REAL}{FROM_0}
{"M": [["1.5/2", 1], [1, 2]], "q": [-5, -6]}
    => M[0][0]: {IS:the text '1.5/2'}; {REAL}{FROM_0}
{"M": [["1/-2", 1], [1, 2]], "q": [-5, -6]}
    => M[0][0]: {IS:the text '1/-2'}; {REAL}{FROM_0}
{"M": [["1 / 2", 1], [1, 2]], "q": [-5, -6]}
    => M[0][0]: {IS:the text '1 / 2'}; {REAL}{FROM_0}
{"M": [["1_000", 1], [1, 2]], "q": [-5, -6]}
    => M[0][0]: {IS:the text '1_000'}; {REAL}{FROM_0}
{"M": [["0x1", 1], [1, 2]], "q": [-5, -6]}
    => M[0][0]: {IS:the text '0x1'}; {REAL}{FROM_0}
{"M": [[" ", 1], [1, 2]], "q": [-5, -6]} => M[0][0]: {IS:the text ' '}; {REAL}{FROM_0}
{"M": [["0,5", 1], [1, 2]], "q": [-5, -6]} => M[0][0]: is the text '0,5'; {REAL}{FROM_0}
{"M": [["", 1], [1, 2]], "q": [-5, -6]} => M[0][0]: {IS:the text ''}; {REAL}{FROM_0}
{"M": [["inf", 1], [1, 2]], "q": [-5, -6]} => M[0][0]: {NOT_FINITE}; {FINITE}{FROM_0}
{"M": [["1e999", 1], [1, 2]], "q": [-5, -6]} => M[0][0]: {NOT_FINITE}; {FINITE}{FROM_0}
{"M": [["nan", 1], [1, 2]], "q": [-5, -6]}
    => M[0][0]: {IS:the text 'nan'}; {REAL}{FROM_0}
{"M": [[null, 1], [1, 2]], "q": [-5, -6]} => M[0][0]: {IS:null}; {REAL}{FROM_0}
{"M": "2", "q": [-5, -6]} => M: {IS:a number}; {A_LIST_OF_ROWS}
{"M": "two", "q": [-5, -6]} => M: {IS:the text 'two'}; {A_LIST_OF_ROWS}
{"M": [[2, 1], [1, 2]], "q": ["-5", "-6x"]} => q[1]: {IS:the text '-6x'}; {REAL}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": ["-5", "-Infinity"]}
    => q[1]: {NOT_FINITE}; {FINITE}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": "-5"} => q: {IS:a number}; {A_LIST}
{"M": [[2, 1], [1, 2]], "q": null} => {NO_Q:2 x 2}; {ADD_Q}
{"M": null, "q": [-5, -6]} => M: {MISSING}; add the key M
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "x0": ["1", "one"]}
    => x0[1]: {IS:the text 'one'}; {REAL}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "x0": ["1"]}
    => x0: {ENTRIES:1 entry|2 unknowns}; {AGREE}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "solution": [["1", "2"], ["3", "x"]]}
    => solution[1][1]: {IS:the text 'x'}; {REAL}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "names": ["a", null]}
    => names[1]: {IS:null}; {A_TEXT}{FROM_0}
{"M": {"format": "coo", "shape": [2, 2], "rows": [0, 1], "cols": [0, 1], \
"values": ["2", "b"]}, "q": [-5, -6]}
    => M.values[1]: {IS:the text 'b'}; {REAL}{FROM_0}
{"M": {"format": "coo", "shape": ["2", "2.5"], "rows": [0, 1], "cols": [0, 1], \
"values": [2, 2]}, "q": [-5, -6]}
    => M.shape: {SHAPE_BESIDE:2 x 2.5|q|2 entries}; {AGREE}
{"M": {"format": "coo", "shape": [2, 2], "rows": ["0", "5"], "cols": [0, 1], \
"values": [2, 2]}, "q": [-5, -6]}
    => M.rows[1]: {ENTRY_OUTSIDE:(5, 1)|2 x 2}; {WHOLE_FROM_TO:0|1}
{"M": {"format": "coo", "shape": [2, 2], "rows": [0, 1], "cols": ["0", null], \
"values": [2, 2]}, "q": [-5, -6]}
    => M.cols[1]: {IS:null}; {REAL}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": "none"}
    => lower: {IS:the text 'none'}; {ONE_OR_A_LIST}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": ["0", "zero"]}
    => lower[1]: {IS:the text 'zero'}; {REAL}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": "inf"}
    => lower[0]: {IS:infinite}; {NO_BOUND_BELOW}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "upper": "-inf"}
    => upper[0]: {IS:minus infinity}; {NO_BOUND_ABOVE}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "upper": ["1", "-Infinity"]}
    => upper[1]: {IS:minus infinity}; {NO_BOUND_ABOVE}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": "2", "upper": "1/2"}
    => lower[0]: {ABOVE:2|upper[0]|0.5}; {IN_ORDER}{FROM_0}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": [null]}
    => lower: {ENTRIES:1 entry|2 unknowns}; {AGREE}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": true}
    => lower: {IS:true}; {ONE_OR_A_LIST}
{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": [[0, 0]]}
    => lower[0]: {IS:a list}; {REAL}{FROM_0}
{"Q": [[2, 1], [0, 2]], "c": [-2, -4]}
    => Q[0][1]: {TWO_VALUES:1|Q[1][0] is 0, so that Q is not symmetric}; for a minimum
    give (Q + Q') / 2; for a variational inequality call it H and c h, in Python
    from_avi: see lcp help equilibria{FROM_0}
{"Q": [["2", "1/3"], ["0.3", 2]], "c": [-2, -4]}
    => Q[0][1]: {TWO_VALUES:0.333333333333333|Q[1][0] is 0.3, so that Q is not
    symmetric}; for a minimum give (Q + Q') / 2; for a variational inequality call it H
    and c h, in Python from_avi: see lcp help equilibria{FROM_0}
{"Q": [[2, "x"], [0, 2]], "c": [-2, -4]} => Q[0][1]: {IS:the text 'x'}; {REAL}{FROM_0}
{"Q": [[2, 0], [0, 2]], "c": null} => c: {MISSING}; add the objective, c'x
{"Q": [[2, 0], [0, 2]], "c": ["-2", null]} => c[1]: {IS:null}; {REAL}{FROM_0}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "A": null, "row_lower": ["1"]}
    => A: {MISSING}; {LEAVE_BOTH_OUT:row_lower}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "A": [["1", "1"]]}
    => row_lower: {MISSING}; {LEAVE_BOTH_OUT:A}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "A": [[1, 1]], "row_lower": ["inf"]}
    => row_lower[0]: {IS:infinite}; {NO_BOUND_BELOW}{FROM_0}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "A": [[1, 1]], "row_upper": ["-inf"]}
    => row_upper[0]: {IS:minus infinity}; {NO_BOUND_ABOVE}{FROM_0}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "A": [[1, 1]], "b": ["two"]}
    => b[0]: {IS:the text 'two'}; {REAL}{FROM_0}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "constant": "a"}
    => constant: {IS:the text 'a'}; {A_NUMBER}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "constant": "inf"}
    => constant: {IS:not a finite number}; {FINITE}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "free": ["2"]}
    => free[0]: {IS:2}; indices are integers from 0 to 1
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "free": ["1/2"]}
    => free[0]: {IS:0.5}; indices are integers from 0 to 1
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "rows": [1]}
    => rows[0]: {IS:a number}; {A_TEXT}{FROM_0}
{"Q": [[2, 0], [0, 2]], "c": [-2, -4], "P": null}
    => P: {TWO_WAYS:Q}; {WAYS_TO_WRITE_PROGRAMS}
{"P": [[2, 0], [0, 2]], "q": null} => q: {MISSING}; add the objective, q'x
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "G": [["1", "1"]], "h": null}
    => h: {MISSING}; {LEAVE_BOTH_OUT:G}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "G": [["1", "1"]], "h": ["-inf"]}
    => h[0]: {IS:minus infinity}; {NO_BOUND_ABOVE}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "G": null, "h": ["1"]}
    => G: {MISSING}; {LEAVE_BOTH_OUT:h}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "A": [["1", "1"]], "b": [null]}
    => b[0]: {IS:null}; {REAL}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "A": [["1", "1"]], "b": ["inf"]}
    => b[0]: {NOT_FINITE}; {FINITE}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "lb": ["inf", 0]}
    => lb[0]: {IS:infinite}; {NO_BOUND_BELOW}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "ub": "Minus"}
    => ub: {IS:the text 'Minus'}; {ONE_OR_A_LIST}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "lb": "1", "ub": "0"}
    => lb[0]: {ABOVE:1|ub[0]|0}; {IN_ORDER}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "A": [[1, 1]], "l": ["inf"], "u": [null]}
    => l[0]: {IS:infinite}; {NO_BOUND_BELOW}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "A": [[1, 1]], "l": ["x"], "u": [null]}
    => l[0]: {IS:the text 'x'}; {REAL}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-2, -4], "A": [[1, 1]], "l": null, "u": null}
    => l: {MISSING}; {LEAVE_BOTH_OUT:A}
{"A": [["3", "x"], [0, 2]], "B": [[2, 0], [0, 3]]}
    => A[0][1]: {IS:the text 'x'}; {REAL}{FROM_0}
{"A": [["3", "1/0"], [0, 2]], "B": [[2, 0], [0, 3]]}
    => A[0][1]: {IS:the text '1/0'}; {REAL}{FROM_0}
{"A": [["3", "inf"], [0, 2]], "B": [[2, 0], [0, 3]]}
    => A[0][1]: {NOT_FINITE}; {FINITE}{FROM_0}
{"A": [["3", null], [0, 2]], "B": [[2, 0], [0, 3]]}
    => A[0][1]: {IS:null}; {REAL}{FROM_0}
{"A": [[3, 0], [0, 2]], "B": null} => B: {MISSING}; add the key B, -A in a zero-sum game
{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "sense": "least"}
    => sense: {IS:'least'}; give "max" for payoffs or "min" for costs
""",
)
TEXTS += contents(
    "bad.csv",
    r"""
2,1,-5\n1,1/0,-6\n => line 2, column 2: is '1/0', a division by 0; {A_NUMBER}
2,1,-5\n1,1.5/2,-6\n
    => line 2, column 2: is '1.5/2', not a number; write integers, as in 15/29
2,1,-5\n1,1/x,-6\n
    => line 2, column 2: is '1/x', not a number; write integers, as in 15/29
2,1,-5\n1,inf,-6\n
    => line 2, column 2: is 'inf'; give a finite number in double precision
x,y,q,upper\n2,1,-5,big\n1,2,-6,1\n => line 2, column 4: is 'big', not a number; {REAL}
firm,a,b,c\n1,2,1,0\n2,1,2,0\n3,1,1,1\n
    => has M and q, or M alone beside an index 'firm'; head the column of q with q, or
    leave the heading of the index empty
a,2,-5\nb,1,-6\n
    => line 1: has the label 'a', but there is no header; name the columns of numbers in
    the first line, such as q
""",
)

ORIGINS = contents(
    "bad.json",
    r"""
3 => origin: {IS:a number}; give an object with the key kind
{} => origin.kind: {MISSING};
    add one of qp, game, contact, efg, avi, lsq, players, polymatrix
{"kind": "lp"} => origin.kind: {IS:'lp'}; {KINDS_OF_ORIGIN}
{"kind": 3} => origin.kind: {IS:a number}; {KINDS_OF_ORIGIN}
{"kind": "qp"} => origin.variables: {NO_NUMBER_OF_VARIABLES}; {FROM_ONE}
{"kind": "qp", "variables": 1.5}
    => origin.variables: {NO_NUMBER_OF_VARIABLES}; {FROM_ONE}
{"kind": "qp", "variables": 1, "free": [2]}
    => origin.free: {NO_KEY:a problem}; the keys are kind, variables, ranges, sense,
    constant, rows, columns
{"kind": "qp", "variables": 9} => origin: {OTHER_ORIGIN}; {MAKE_AGAIN}
{"kind": "qp", "variables": 1} => origin: {OTHER_ORIGIN}; {MAKE_AGAIN}
{"kind": "game", "A": [[1]]} => origin.B: {MISSING}; add the key B
""",
    made='{{"M": [[2.0, 1.0], [1.0, 2.0]], "q": [-1.0, -1.0], "origin": {}}}'.format,
)

MATRIX_MARKET = contents(
    "bad.mtx",
    r"""
{"M": [[2, 0], [0, 2]], "q": [-1, -1]}
    => line 1: is not a Matrix Market header; begin with %%MatrixMarket matrix
    array|coordinate real|integer general|symmetric|skew-symmetric
%%MatrixMarket matrix coordinate pattern general\n2 2 1\n1 1\n
    => line 1: 'pattern' cannot be read; use real or double or integer
%%MatrixMarket matrix array complex general\n1 1\n1 0\n
    => line 1: is the header of a complex matrix; {REAL}
%%MatrixMarket matrix array real general\n% comment\n
    => is cut off before its size; give the numbers of rows and columns below the header
%%MatrixMarket matrix coordinate real general\n% c\n-2 2 1\n
    => line 3: {IS:'-2 2 1'}; give the numbers of rows, columns, entries
%%MatrixMarket matrix array real general\n1 1\n1,5\n
    => line 3: {IS:'1,5'}; give one number
%%MatrixMarket matrix array integer general\n1 1\n1.5\n
    => line 3: {IS:'1.5'}; give one integer
%%MatrixMarket matrix array real general\n2 2\n10\n20\n30\n
    => is declared with 4 entries but has 3 entries; {AGREE}
%%MatrixMarket matrix coordinate real general\n2 2 1000000000000\n1 1 1\n
    => is declared with 1000000000000 entries, more than the file holds; {CUT_OFF}
%%MatrixMarket matrix coordinate real general\n2 2 1\n3 1 1\n
    => M: {ENTRY_OUTSIDE:(3, 1)|2 x 2}; {WHOLE_FROM_TO:1|2}
%%MatrixMarket matrix coordinate real general\n2 2 2\n1 2 1\n1 2 3\n
    => M: {ENTRY_AGAIN:(1, 2)}; {ENTRY_ONCE}{FROM_1}
%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 2 1\n2 1 3\n
    => M: {ENTRY_AGAIN:(1, 2)}; {ENTRY_ONCE}{FROM_1}
%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n1 1 1\n
    => M: is skew-symmetric with entries on its diagonal; leave them out
%%MatrixMarket matrix array real symmetric\n2 1\n1\n2\n
    => is symmetric but 2 x 1; make it square or general
%%MatrixMarket matrix coordinate real general\n1000000000000 1000000000000 1\n1 1 1\n
    => M: {SHAPE_BESIDE:1000000000000 x 1000000000000|q|2 entries}; {AGREE}
%%MatrixMarket matrix array real general\n1000000000000 1000000000000\n1\n
    => {BEYOND_MEMORY:1000000000000 x 1000000000000|8e+15}; {SPARSE}
""",
    command="solve {} q.csv",
    files=PAIR,
)
LONG_ENTRY = contents(
    "bad.mtx",
    "=> M[0][1]: {NOT_FINITE}; {FINITE}{FROM_0}",
    made=lambda _: (
        "%%MatrixMarket matrix array integer general\n2 2\n1\n1\n"
        + "9" * 1000
        + "\n1\n"
    ),
    command="solve {} q.csv",
    files=PAIR,
)

TWO_FILES = commands(
    r"""
1,2,3\n > q.csv
solve M.csv q.csv => M.csv: M: {SHAPE_BESIDE:2 x 2|q|3 entries}; {AGREE}
1,2\n3,4\n5,6\n > q.csv
solve M.csv q.csv
    => q.csv: q: is 3 x 2 but M is 2 x 2; transpose it: give one column for each
    problem, of as many rows as M has
 > q.csv
solve M.csv q.csv => q.csv: {EMPTY}; {ONE_ROW_OF_NUMBERS}
[1, 2  > q.csv
solve M.csv q.csv => q.csv: line 1, column 7: {ENDS_TOO_EARLY}; {FILE_CUT_OFF}
solve M.csv good.json => good.json: q: {IS:an object}; {A_LIST}
2\n > M.csv
-1,1e-400\n > q.csv
solve M.csv q.csv
    => q.csv: has '1e-400', which is 0 in double precision; scale the data; lcp solve
    --exact keeps all digits
2,0,1\n0,2,1\n > M.csv
solve M.csv q.csv => q.csv: {NOT_NEEDED:M.csv}; {GIVE_ALONE}
{"M": [[2, 0], [0, 2]], "q": [-1, -1]} | solve - q.csv
    => q.csv: {NOT_NEEDED:standard input}; {GIVE_ALONE}
%%MatrixMarket matrix array real general\n2 2\n2\n0\n0\n2\n > alone.mtx
solve alone.mtx => alone.mtx: {NO_Q:2 x 2}; {ADD_Q}
%%MatrixMarket matrix array real general\n2 2\n2\n0\n0\n2\n > q.mtx
solve M.csv q.mtx => q.mtx: q: {ROWS:2|2}; {ONE_ROW}
%%MatrixMarket matrix coordinate real general\n500000000 1 1\n1 1 1\n > q.mtx
solve M.csv q.mtx => q.mtx: q: {MOSTLY_ABSENT:500000000 x 1}; {ENTRIES_OF_1000}
%%MatrixMarket matrix coordinate real general\n1000000000000 1 0\n > q.mtx
solve M.csv q.mtx => q.mtx: q: {BEYOND_MEMORY:1000000000000 x 1|8e+03}; {SPARSE}
2,5;1\n1;2\n > M.csv
-5,5\n-6,5\n > q.csv
solve M.csv q.csv => q.csv: q: {TWO_COLUMNS}; {Q_OR_TWO_NAMES}
x\x09y\n2,5\x091\n1\x092\n > M.csv
-5,5\n-6,5E0\n > q.csv
solve M.csv q.csv => q.csv: q: {TWO_COLUMNS}; {Q_OR_TWO_NAMES}
""",
    PAIR,
)

# The labels of a, b and c, in their order and in others.
LABELLED = {
    "m.json": '{"M": [[4, -1, 0], [-1, 4, -1], [0, -1, 4]], "names": ["a", "b", "c"]}',
    "p.json": (
        '{"M": [[4, -1, 0], [-1, 4, -1], [0, -1, 4]], "names": ["a", "b", "c"], '
        '"q": [-1, 2, -3]}'
    ),
    "mixed.csv": ",a,b,c,q\nb,-1,4,-1,2\nc,0,-1,4,-3\na,4,-1,0,-1\n",
    "swapped.csv": "c,b,a\n-3,2,-1\n",
    "v.csv": ",z\nc,0.75\na,0.25\nb,0\n",
}
LABELS = commands(
    r"""
solve mixed.csv => mixed.csv: {LABEL_IN_PLACE:'b'|'a'}; {IN_ORDER_OF_UNKNOWNS}
solve m.json swapped.csv
    => swapped.csv: {LABEL_IN_PLACE:'c'|'a'}; {IN_ORDER_OF_UNKNOWNS}
,q\nc,1\na,1\nb,1\n > other.csv
solve m.json other.csv => other.csv: {LABEL_IN_PLACE:'c'|'a'}; {IN_ORDER_OF_UNKNOWNS}
q\nc 1\na 1\nb 1\n > other.csv
solve m.json other.csv => other.csv: {LABEL_IN_PLACE:'c'|'a'}; {IN_ORDER_OF_UNKNOWNS}
,q\na,1\nb,1\nd,1\n > other.csv
solve m.json other.csv => other.csv: {LABEL_IN_PLACE:'d'|'c'}; {IN_ORDER_OF_UNKNOWNS}
,q\na,1\nb,1\nc,1\na,1\n > other.csv
solve m.json other.csv
    => other.csv: {ENTRIES:4 labels|3 unknowns}; {IN_ORDER_OF_UNKNOWNS}
solve p.json --upper v.csv => v.csv: {LABEL_IN_PLACE:'c'|'a'}; {IN_ORDER_OF_UNKNOWNS}
solve p.json --z0 v.csv => v.csv: {LABEL_IN_PLACE:'c'|'a'}; {IN_ORDER_OF_UNKNOWNS}
check p.json v.csv => v.csv: {LABEL_IN_PLACE:'c'|'a'}; {IN_ORDER_OF_UNKNOWNS}
path p.json --to 2 --direction v.csv
    => v.csv: {LABEL_IN_PLACE:'c'|'a'}; {IN_ORDER_OF_UNKNOWNS}
""",
    LABELLED,
)

FOREIGN = commands(
    r"""
no matter what > p.ods
solve p.ods => p.ods: {SPREADSHEET}; {AS_CSV}
\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1 > p.xls
solve p.xls => p.xls: {SPREADSHEET}; {AS_CSV}
PAR1 > p.parquet
solve p.parquet => p.parquet: is a binary table; {AS_CSV}
gambit > p.gbt
solve p.gbt
    => p.gbt: is a document of Gambit's graphical interface; save the game there as .efg
    or .nfg
MATLAB 7.3 MAT-file > p.mat
solve p.mat
    => p.mat: is a MATLAB file of version 7.3; save it with -v7: save('p.mat', 'M', 'q',
    '-v7')
MATLAB 5.0 MAT-file > p.mat
solve p.mat
    => p.mat: is not a MAT file, or is damaged; is it cut off? save it again, in MATLAB
    with -v6 or -v7
\x89HDF\x0d\n\x1a\n > p.h5
solve p.h5 => p.h5: is HDF5; save M and q with numpy.savez, or in MATLAB with -v7
\x80\x04\x95\x06\x00\x00\x00\x00\x00\x00\x00]\x94K\x01a. > p.pkl
solve p.pkl
    => p.pkl: is a pickle, which may run any code when it is read; save M and q with
    numpy.savez
\x1f\x8b\x08 > p.json.gz
solve p.json.gz => p.json.gz: {NOT_UNZIPPED}; {COMPRESS_AGAIN}
\x1f\x8b\x08\x00\xb3\xcb\x09k\x02\xff\xf3s\xf4uU(\xe0\n\xf2\x0f\x0f\xe6R\xf0SH\xce/.\
\xe1R\xf0Q\xc8\xc9\xcc\xcd\x042\xdc > bad.mps.gz
solve bad.mps.gz => bad.mps.gz: {NOT_UNZIPPED}; {COMPRESS_AGAIN}
%PDF-1.7 > p.pdf
solve p.pdf => p.pdf: is a document; copy M and q into a CSV file
M = [2 1; 1 2]; > p.m
solve p.m
    => p.m: is a script or a model, which lcp does not run; have it save M and q as
    .mat, .npz or .csv
""",
)

NOTHING = commands(
    r"""
 > bad.nfg
solve bad.nfg => bad.nfg: {EMPTY}; write the game again
\n > bad.efg
solve bad.efg => bad.efg: {EMPTY}; write the game again
 > bad.mps
solve bad.mps => bad.mps: {EMPTY}; write the program again
 > bad.lp
solve bad.lp => bad.lp: {EMPTY}; write the program again
 > bad.npz
solve bad.npz => bad.npz: {EMPTY}; save its arrays again
 > bad.mat
solve bad.mat => bad.mat: {EMPTY}; save its arrays again
"""
)

CONTACTS = contents(
    "bad.json",
    r"""
{"W": [[1e308, 1e308], [1e308, 1e308]], "q": [-1, 0], "mu": 10}
    => W: exceeds the double-precision range in products with the coefficients of
    friction; scale W and q, or give smaller coefficients of friction
{"A": [[1e308, 1e308], [1e308, 1e308]], "b": [-1, 0], "lo": [0, -10], \
"hi": [null, 10], "findex": [-1, 0]}
    => A: exceeds the double-precision range in products with the coefficients of
    friction; scale A and b, or give smaller coefficients of friction
{"W": [[1, 0, 0], [0, 1e308, 1e308], [0, 1e308, 1e308]], "q": [-1, 0, 0], "mu": 1, \
"dimension": 3}
    => W: exceeds the double-precision range in products with the coefficients of
    friction; scale W and q, or give smaller coefficients of friction
""",
)

PROGRAMS = contents(
    "bad.json",
    r"""
{"q": [-1, -1], "A": [[1, 1]], "l": [1], "u": [2]}
    => P: {MISSING}; add it, all zeros for a linear program; the matrix of a
    complementarity problem is called M
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "l": [1], "u": [2]}
    => A: {MISSING}; {LEAVE_BOTH_OUT:l}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "A": [[1, 1]]}
    => b: {MISSING}; {LEAVE_BOTH_OUT:A}
{"Q": [[2, 0], [0, 2]], "c": [-1, -1], "A": [[1, 1]]}
    => row_lower: {MISSING}; {LEAVE_BOTH_OUT:A}
{"Q": [[2, 0], [0, 2]], "c": [-1, -1], "row_lower": [1]}
    => A: {MISSING}; {LEAVE_BOTH_OUT:row_lower}
{"Q": [[2, 0], [0, 2]], "A": [[1, 1]], "row_lower": [1]}
    => c: {MISSING}; add the objective, c'x
{"P": [[2, 0], [0, 2]], "G": [[1, 1]], "h": [1]} => q: {MISSING}; add the objective, q'x
{"Q": [[2]], "cost": [-1]} => cost: {NO_KEY:a program}; {DID_YOU_MEAN:c}
{"Q": [[2]], "c": [-1], "minimize": 1}
    => minimize: {NO_KEY:a program}; {DID_YOU_MEAN:sense}
{"c": []} => c: {EMPTY}; {ONE_VARIABLE}
{"H": [[1]], "f": [1]} => H: {CALLED:P}; {WAYS_TO_WRITE_PROGRAMS}
{"q": [-1, -1], "l": [1], "u": [2], "M": [[1, 0], [0, 1]]}
    => l: {NO_KEY:a problem}; {DID_YOU_MEAN:lower}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "A": [[1, 1]], "l": [1], "u": [2], "L": [1]}
    => L: {NO_KEY:a program}; {DID_YOU_MEAN:l}
{"P": [[1, 2], [3, 1]], "q": [-1, -1], "A": [[1, 1]], "l": [1], "u": [2]}
    => P[0][1]: {UNSYMMETRIC:2|P|3}; {SYMMETRIZE:P|q}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "A": [[1, 1]], "l": [3], "u": [2]}
    => l[0]: {ABOVE:3|u[0]|2}; {IN_ORDER}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "A": [[1, 1]], "l": [1e+20]}
    => l[0]: {INFINITE_AS:infinite|1e+20|1e+20}; {NO_BOUND_BELOW}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "G": [[1]], "h": [1]}
    => G: {ENTRIES:1 column|2 variables}; {AGREE}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "G": [[1, 1]], "h": [1], "A": [[1, 1]], "b": \
[1, 2]}
    => b: {ENTRIES:2 entries|1 row}; {AGREE}
{"c": [1, 1], "A": [[1, [2]]], "row_lower": [1]}
    => A[0][1]: {IS:a list}; {REAL}{FROM_0}
{"c": [1, 1], "A": [1, [2]], "row_lower": [1]} => A[0][1]: {IS:a list}; {REAL}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "G": [[1, [2]]], "h": [1]}
    => G[0][1]: {IS:a list}; {REAL}{FROM_0}
{"P": [[2, 0], [0, 2]], "q": [-1, -1], "A": [[1, 1], [[1], 1]], "l": [1, 1], \
"u": [2, 2]}
    => A[1][0]: {IS:a list}; {REAL}{FROM_0}
{"lsq": true, "A": [[1, 1]], "b": [1], "E": [[1, [2]]], "d": [1]}
    => E[0][1]: {IS:a list}; {REAL}{FROM_0}
{"lsq": true, "A": [[1, 1]], "b": [1], "E": [[1, 2], 3], "d": [1]}
    => E[1]: {IS:a number}; {A_ROW}{FROM_0}
{"lsq": true, "A": [[1, 1]], "b": [1], "E": [[1, 1]], "d": [1, [2]]}
    => d[1]: {IS:a list}; {REAL}{FROM_0}
{"lsq": [[1, 2], 3], "A": [[1, 1]], "b": [1]}
    => lsq: is not true; write true, or leave it out
""",
)

NATIVE = '"Q": [[2, 0], [0, 2]], "c": [-1, -1], "A": [[1, 1]], "row_lower": [1]'
# Keys in place of some of these, or beside them.
CHANGED_PROGRAMS = contents(
    "bad.json",
    r"""
[[2, 0], [0, 2]] -> [[1, 2]] => Q: {SHAPE:1|2}; {SQUARE}
[[2, 0], [0, 2]] -> [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    => Q: {SHAPE_BESIDE:3 x 3|c|2 entries}; {AGREE}
[[2, 0], [0, 2]] -> [[1, 2], [0, 1]]
    => Q[0][1]: {UNSYMMETRIC:2|Q|0}; {SYMMETRIZE:Q|c}{FROM_0}
"row_lower": [1] -> "row_lower": [1, 2]
    => row_lower: {ENTRIES:2 entries|1 row}; {AGREE}
"row_lower": [1] -> "row_lower": [2], "row_upper": [1]
    => row_lower[0]: {ABOVE:2|row_upper[0]|1}; {IN_ORDER}{FROM_0}
[[1, 1]] -> {"format": "coo", "shape": [1, 2], "rows": [1], "cols": [0], "values": [1]}
    => A.rows[0]: {ENTRY_OUTSIDE:(1, 0)|1 x 2}; {WHOLE_FROM_TO:0|0}
[[1, 1]] -> {"format": "coo", "shape": [1.5, 2], "rows": [0], "cols": [0], \
"values": [1]}
    => A.shape: {SHAPE:1.5|2}; give two integers from 0
""",
    made=lambda parts: f"{{{changed(NATIVE, parts)}}}",
)
MORE_KEYS = contents(
    "bad.json",
    r"""
"Aeq": [1] => Aeq: {CALLED:A}; {WAYS_TO_WRITE_PROGRAMS}
"beq": [1] => beq: {CALLED:b}; {WAYS_TO_WRITE_PROGRAMS}
"A_eq": [1] => A_eq: {CALLED:A}; {WAYS_TO_WRITE_PROGRAMS}
"b_eq": [1] => b_eq: {CALLED:b}; {WAYS_TO_WRITE_PROGRAMS}
"A_ub": [1] => A_ub: {CALLED:G}; {WAYS_TO_WRITE_PROGRAMS}
"b_ub": [1] => b_ub: {CALLED:h}; {WAYS_TO_WRITE_PROGRAMS}
"H": [1] => H: {CALLED:P}; {WAYS_TO_WRITE_PROGRAMS}
"f": [1] => f: {CALLED:q}; {WAYS_TO_WRITE_PROGRAMS}
"bounds": [[0, 1]] => bounds: {NO_KEY:a program}; {BOUNDS_AS}
"lower": [1] => lower: {ENTRIES:1 entry|2 variables}; {AGREE}
"lower": 2, "upper": 1 => lower[0]: {ABOVE:2|upper[0]|1}; {IN_ORDER}{FROM_0}
"b": [1] => b: is short for row_lower, which is passed too; {LEAVE_ONE_OUT}
"free": [0], "lower": 1
    => free: cannot be combined with lower; leave it out, and give null for no bound in
    lower
"free": [2] => free[0]: is 2; indices are integers from 0 to 1
"free": [0, -1] => free[1]: is -1; indices are integers from 0 to 1
"sense": "maximise" => sense: {IS:'maximise'}; give min or max
"constant": "one" => constant: {IS:the text 'one'}; {A_NUMBER}
"rows": "r" => rows: {IS:the text 'r'}; {A_LIST_OF_NAMES}
"columns": [1, "y"] => columns[0]: {IS:a number}; {A_TEXT}{FROM_0}
"columns": ["x"] => columns: {ENTRIES:1 name|2 variables}; {AGREE}
""",
    made=lambda keys: f"{{{NATIVE}, {keys}}}",
)
FROM_QP = contents(
    "bad.json",
    r"""
{"Q": [[1]], "c": [1], "b": [1]} => A: {MISSING}; {LEAVE_BOTH_OUT:b}
{"Q": [[1]], "c": [1], "A": [[]], "b": [1]}
    => A: {ENTRIES:0 columns|1 variable}; {AGREE}
{"Q": [[1]], "c": [1e999]} => c[0]: {NOT_FINITE}; {FINITE}{FROM_0}
{"Q": [[1]], "c": [1], "free": 0} => free: {IS:a number}; give a list of indices
{"Q": [[1]], "c": [1], "free": [0, 0]} => free: names an index twice; {KEEP_ONE}
""",
    command="convert {} -o made.json",
)

OF_QPSOLVERS = '"P": [[2, 0], [0, 2]], "q": [-1, -1], "G": [[1, 1]], "h": [1]'
OF_OSQP = '"P": [[2, 0], [0, 2]], "q": [-1, -1], "A": [[1, 1]], "l": [1], "u": [2]'
# Keys of the native form alone, each with a value; and those that it has not.
NATIVE_KEYS = {
    "Q": "[[2, 0], [0, 2]]",
    "c": "[1, 1]",
    "row_upper": "0",
    "lower": "0",
    "upper": "9",
    "free": "[0]",
    "sense": '"min"',
    "row_lower": "0",
    "constant": "1",
    "rows": '["r"]',
    "columns": '["x", "y"]',
}
OTHER_KEYS = {
    "P": "[[2, 0], [0, 2]]",
    "q": "[1, 1]",
    "G": "[[1, 1]]",
    "h": "[1]",
    "lb": "0",
    "ub": "9",
    "l": "[0]",
    "u": "9",
}
TWO_WAYS = [
    ("P", key, f'{form}, "{key}": {value}')
    for form in (OF_QPSOLVERS, OF_OSQP)
    for key, value in NATIVE_KEYS.items()
]
TWO_WAYS += [
    (key, "Q", f'{NATIVE}, "{key}": {value}') for key, value in OTHER_KEYS.items()
]
TWO_WAYS += [
    (key, "l", f'{OF_OSQP}, "{key}": {OTHER_KEYS[key]}')
    for key in ("G", "h", "lb", "ub")
]
TWO_WAYS += [
    (key, "G", f'{OF_QPSOLVERS}, "{key}": {OTHER_KEYS[key]}') for key in ("l", "u")
]
# Without a key of the third form, and with b of the second.
TWO_WAYS += [
    (
        "u" if part.startswith('"l"') else "l",
        "b",
        f'{OF_OSQP}, "b": [1]'.replace(part, ""),
    )
    for part in (
        '"P": [[2, 0], [0, 2]], ',
        '"A": [[1, 1]], ',
        '"l": [1], ',
        '"u": [2], ',
    )
]
TWO_FORMS = [
    refusal
    for key, other, keys in TWO_WAYS
    for refusal in contents(
        "bad.json",
        f"=> {key}: {{TWO_WAYS:{other}}}; {{WAYS_TO_WRITE_PROGRAMS}}",
        made=lambda _, keys=keys: f"{{{keys}}}",
    )
]

PLAN = """NAME p
ROWS
 N cost
 L limit
 G demand
COLUMNS
 x cost 1 limit 1
 x demand 1
 y cost 2 limit 1
RHS
 r limit 4 demand 1
BOUNDS
 UP b x 4
ENDATA
"""
MPS = contents(
    "bad.mps",
    r"""
x cost 1 limit 1 -> x cost one limit 1
    => line 7: {IN_PLACE_OF:'one'|a number}; {A_NUMBER}
UP b x 4 -> UP b x four => line 13: {IN_PLACE_OF:'four'|a number}; {A_NUMBER}
x demand 1 -> x need 1 => line 8: names 'need', which is not in ROWS; {OR_DECLARE}
UP b x 4 -> UP b z 4 => line 13: names 'z', which is not in COLUMNS; {OR_DECLARE}
UP b x 4 -> UP b x -4 => line 13: {UPPER_BELOW_LOWER:'x'|-4|0}; {LOWER_BOUND_TOO}
BOUNDS -> BOUNDS\n LO b x 5
    => line 14: {UPPER_BELOW_LOWER:'x'|4|5}; make the lower bound the smaller one
UP b x 4 -> UP b x 4\n UP b x 5 => line 14: {SECOND_TIME:'x'}; {KEEP_ONE}
x demand 1 -> x limit 2 => line 8: {SECOND_ENTRY:'x'|'limit'}; {KEEP_ONE}
UP b x 4 -> BV b x => line 13: {INTEGER_VARIABLE}; {CONTINUOUS:programs with | only}
COLUMNS -> COLUMNS\n M1 'MARKER' 'INTORG'
    => line 8: {INTEGER_VARIABLE}; {CONTINUOUS:programs with | only}
UP b x 4 -> SC b x 4
    => line 13: makes 'x' a semicontinuous variable; {CONTINUOUS:programs with | only}
ENDATA\n ->  => has no ENDATA; {CUT_OFF}
NAME p -> NAME p\nOBJSENSE\n BEST
    => line 3: has 'BEST' as the sense of the objective; give MIN or MAX
UP b x 4 -> UP b x 4\nQCMATRIX limit\n x x 1
    => line 14: {HEADING:'QCMATRIX'}; {SECTIONS}
""",
    made=partial(changed, PLAN),
)
NO_COLUMNS = contents(
    "bad.mps",
    r"""
NAME p\nROWS\n N cost\nCOLUMNS\nRHS\nENDATA\n => has no columns; {ONE_VARIABLE}
""",
)
DIET = """NAME diet
ROWS
 N cost
 G protein
 L fat
COLUMNS
 bread cost 2 protein 8
 milk cost 3 protein 9
 milk fat 1
RHS
 r protein 36 fat 5
BOUNDS
 UP b bread 4
ENDATA
"""
DIETS = contents(
    "diet.mps",
    r"""
G protein -> G protein\n L fat
    => line 6: declares 'fat' a second time; give each row another name
milk fat 1 -> milk fat 1\n bread protein 1
    => line 10: {SECOND_ENTRY:'bread'|'protein'}; {KEEP_ONE}
UP b bread 4 -> UP b bread 4\nQUADOBJ\n bread milk 1\n milk bread 5
    => line 16: {SECOND_ENTRY:'milk'|'bread'}; {KEEP_ONE}
r protein 36 fat 5 -> r protein 36\n r protein 37
    => line 12: {SECOND_TIME:'protein'}; {KEEP_ONE}
G protein -> X protein
    => line 4: has 'X protein' in ROWS; is the heading of the next section misspelt, or
    the first word of the line?
L fat -> L fat of all => line 5: has a name with spaces; write it without, as with _
UP b bread 4 -> UQ b bread 4
    => line 13: has a bound of the type 'UQ'; use UP, LO, FX, FR, MI or PL
ROWS -> ROWZ => line 2: {HEADING:'ROWZ'}; {SECTIONS}
UP b bread 4 -> UP b bread 4\nSOS\n S1 s\n s bread 1
    => line 14: {HEADING:'SOS'}; {SECTIONS}
r protein 36 fat 5 -> r protein 36 fat 5\nRANGES\n r cost 4
    => line 13: gives a range to 'cost'; only rows L, G and E have one
UP b bread 4 -> UP b bread 4\nQMATRIX\n bread milk 3
    => has a QMATRIX that is not symmetric at 'bread' and 'milk'; give both entries, or
    one of them in QUADOBJ
UP b bread 4 -> UP b bread 4\nQSECTION fat
    => line 14: has a quadratic part of row 'fat'; only an objective may have one
UP b bread 4 -> UP b bread -3
    => line 13: {UPPER_BELOW_LOWER:'bread'|-3|0}; {LOWER_BOUND_TOO}
r protein 36 fat 5 -> r protein 36 fat -1e20
    => row fat: {BOUND_OF_1E20}; {A_SMALLER_ONE}
r protein 36 fat 5 -> r protein 36 fat -1e400
    => row fat: {BOUND_OF_1E20}; {A_SMALLER_ONE}
r protein 36 fat 5 -> r protein 36 fat -1e400\nRANGES\n r fat 1e400
    => row fat: {BOUND_OF_1E20}; {A_SMALLER_ONE}
UP b bread 4 -> UP b bread -1e21 => line 13: {BOUND_OF_1E20}; {A_SMALLER_ONE}
UP b bread 4 -> LO b bread 1e20 => line 13: {BOUND_OF_1E20}; {A_SMALLER_ONE}
""",
    made=partial(changed, DIET),
)
LP = contents(
    "bad.lp",
    r"""
min\n obj: x + 2 y\nst\n c1: x + y >= 1\nbounds\n x <= -3\nend\n
    => {UPPER_BELOW_LOWER:'x'|-3|0}; {LOWER_BOUND_TOO}
min\n obj: x + 2 y\nst\n c1: [x^2] + y >= 1\nbounds\n x <= 3\nend\n
    => {NOT_LP:line 4: quadratic constraints are not supported by HiGHS}; {CORRECT_LP}
min\n obj: x + 2 y\nsubject two\n c1: x + y >= 1\nbounds\n x <= 3\nend\n
    => {NOT_LP:line 3: expected `+` or `-`, found `subject`}; {CORRECT_LP}
max\nend\n => is not a program in the LP format; is it complete?
min\n obj: a + b\nst\n c1: a + b >= 3\n c1: a >= 1\nend\n
    => declares 'c1' a second time; give each row another name
""",
)

FROM_GAME = contents(
    "bad.json",
    r"""
{"A": [[1]]} => B: {MISSING}; add the key B, -A in a zero-sum game
{"A": [[1, 2]], "B": [[1]]} => B: {SHAPE_OF_GAME:1 x 1|1 x 2}; {AGREE}
{"A": [[1]], "B": [["x"]]} => B[0][0]: {IS:the text 'x'}; {REAL}{FROM_0}
{"A": [[1e308], [-1e308]], "B": [[1], [2]]}
    => A: exceeds the double-precision range; {SCALE_PAYOFFS}
{"A": [[1]], "B": [[1]], "rows": "x"} => rows: {IS:the text 'x'}; {A_LIST_OF_NAMES}
{"A": [[1]], "B": [[1]], "rows": [1]} => rows[0]: {IS:a number}; {A_TEXT}{FROM_0}
{"A": [[1]], "B": [[1]], "columns": ["x", "y"]}
    => columns: {ENTRIES:2 names|1 strategy}; {AGREE}
{"A": [[1]], "B": [[1]], "row": ["x"]} => row: {NO_KEY:a game}; {DID_YOU_MEAN:rows}
{"A": [[1]], "B": [[1]], "upper": 1}
    => upper: {NO_KEY:a game}; its unknowns are probabilities; leave it out
""",
    command="convert {} -o made.json",
)
COSTS = contents(
    "costs.json",
    r"""
{"A": [["1/3", 0], [0, 2]], "B": [[2, 0], [0, 3]], "sense": "least"}
    => sense: {IS:'least'}; give "max" for payoffs or "min" for costs
""",
)
LARGE_GAME = contents(
    "p.json",
    "=> A: {MOSTLY_ABSENT:1000000000 x 1000000000}; {ENTRIES_OF_1000}",
    made=lambda _: '{{"A": {0}, "B": {0}}}'.format(
        '{"format": "coo", "shape": [1000000000, 1000000000], "rows": [0], "cols": '
        '[0], "values": [1]}'
    ),
)

STRATEGIC_OPENINGS = contents(
    "g.nfg",
    r"""
NFG 2 R
    => line 1: is not the beginning of a game; begin the file with NFG 1 R or EFG 2 R
NFG 1 R title
    => has no title, players and strategies; write NFG 1 R "title" { "one" "two" } { 2
    2 }
NFG 1 R "a game" { "Alice"  }\n{ 1 } 1 => {PLAYERS:1 player}; give one of at least two
NFG 1 R "a game" { "Alice" "Bob" "Cy" }\n{ 2 2 2 } { { 1 0 0 } } 0 0 0 0 0 0 0 1
    => has payoffs that are no sums over pairs of players: for the strategies 2, 2, 2
    Alice gets 1, not 0; the equilibria of such a game of more than two players are not
    the solutions of an LCP
NFG 1 R "a game" { "Alice" "Bob" "Cy" }\n{ 1 1 1 } 1 2
    => has a number of payoffs that is no multiple of 3; give 3 for each profile of
    strategies
NFG 1 R "a game" { "Alice" "Bob" "Cy" }\n{ 1 1 } 1 2
    => has strategies of 2 players for 3 names; give the strategies of each player
""",
)
STRATEGIC_FORM = contents(
    "g.nfg",
    r"""
{ 2 2 } 1 2 3 4 5 6 => {ENDS_TOO_EARLY}; {CUT_OFF}
{ 2 2 => has braces that do not match; {CUT_OFF}
{ 2 2 } 1 2 3 4 5 6 7
    => has an odd number of payoffs; give two for each pair of strategies
{ 1 1 }\n1 2\n3 4 => has more than the payoffs of 1 x 1 strategies; remove the others
{ 1 1 }\n1 x => {HAS_NO_NUMBER:'x'}; {A_NUMBER}
{ 1 1 }\n1 1/0 => {HAS_NO_FRACTION:'1/0'}; {FRACTIONS}
{ 1 1 }\n1e400 0 => A[0][0]: {NOT_FINITE}; {FINITE}{FROM_0}
{ 1 1 }\n{ 1 2 }\n1 => {IN_PLACE_OF:'1'|an outcome}; give two payoffs in braces
{ 1 1 }\n{ { "" 1 2 } }\n2 => names outcome 2 of 1; name one of those listed
{ 0 1 } => has a player without strategies; give each at least one
""",
    made='NFG 1 R "a game" {{ "Alice" "Bob" }}\n{}'.format,
)
TREE_OPENINGS = contents(
    "g.efg",
    r"""
EFG 1 R => line 1: {NO_TREE}; {BEGIN_TREE}
EFG 2 R title => line 1: {IN_PLACE_OF:'title'|a name}; put names in quotes
EFG 2 R "title" => line 1: {NO_PLAYERS}; {WRITE_TREE}
EFG 2 R "title" p => line 1: {NO_PLAYERS}; {WRITE_TREE}
EFG 2 R "a game" { "Ann"  }\n => {PLAYERS:1 player}; {TWO_PLAYERS}
EFG 2 R "a game" { "Ann" "Bob" "Cy" }\n => {PLAYERS:3 players}; {TWO_PLAYERS}
""",
)
TREES = contents(
    "g.efg",
    r"""
=> {ENDS_TOO_EARLY}; {CUT_OFF}
t "" 0\nt "" 0
    => line 3: has 't' after the last node of the tree; remove it, or correct the nodes
p "" 3 1 { "a" } 0 => line 2: names player 3 of 2; give 1 or 2
p "" 1 1 0
    => line 2: names information set 1 of player 1 before its actions; list its actions
    where it is first named
p "" 1 1 { } 0
    => line 2: lists no action for information set 1 of player 1; list at least one
c "" 1 { "a" } 0 => line 2: {IN_PLACE_OF:'}'|a number}; {A_FRACTION}
c "" 1 { "a" 1/3 "b" 1/3 } 0 => line 2: {CHANCES}; {CHANCES_SUM_TO_1}
c "" 1 { "a" 2 "b" -1 } 0 => line 2: {CHANCES}; {CHANCES_SUM_TO_1}
c "" 1 "" { "h" 1/2 "t" 1/2 } 0 t "" 1 "" { 1 0 } c "" 1 "" { "h" 1/4 "t" 3/4 } 0
    => line 2: lists other probabilities for chance event 1 than before; {CORRECT_ONE}
""",
    made='EFG 2 R "a game" {{ "Ann" "Bob" }}\n{}'.format,
)
# Below the first node, where Ann chooses a or b.
NODES = contents(
    "g.efg",
    r"""
t "" 1 { 1 2 } => {ENDS_TOO_EARLY}; {CUT_OFF}
t "" 1 { 1 2 => {ENDS_TOO_EARLY}; {CUT_OFF}
x "" 0
    => line 3: {IN_PLACE_OF:'x'|a node}; begin each node with c for chance, p for a
    player, t for the end
t "" -1 => line 3: {IN_PLACE_OF:'-1'|the number of an outcome}; {A_WHOLE_NUMBER}
t "" 1 => line 3: names outcome 1 before its payoffs; give them where it is first named
t "" 1 { 1 2 3 } => line 3: {ENTRIES:3 payoffs|2 players}; give one for each
t "" 1 { 1 x } => line 3: {IN_PLACE_OF:'x'|a number}; {A_FRACTION}
t "" 1 { 1 1/0 } => line 3: {IN_PLACE_OF:'1/0'|a number}; {A_FRACTION}
t "" 1 { 1 1e9999 } => line 3: {IN_PLACE_OF:'1e9999'|a number}; {A_FRACTION}
t "" 1 { 1 -1e301 } => line 3: has '-1e301', too large for doubles; {SCALE_PAYOFFS}
t "" 1 { 1 2 } t "" 1 { 1 3 } => line 3: {OUTCOME_AGAIN:1}; {CORRECT_ONE}
t "" 0 { 1 2 } => line 3: {OUTCOME_AGAIN:0}; {CORRECT_ONE}
p "" 1 1 { "b" "a" } 0
    => line 3: lists other actions for information set 1 of player 1 than before;
    {CORRECT_ONE}
p "" 1 1 0 t "" 0 t "" 0 t "" 0
    => line 3: has no perfect recall: other moves of this player lead to information
    set 1 of player 1 than before; give an information set to each history of a
    player's moves
""",
    made=('EFG 2 R "a game" {{ "Ann" "Bob" }}\np "" 1 1 "" {{ "a" "b" }} 0\n{}').format,
)
TABLES_OF_GAMES = commands(
    r"""
left,rihgt\n2,0\n0,3\n > B.csv
solve A.csv B.csv --game => B.csv: {OTHER_NAMES:'rihgt'|'right'}; {SAME_NAMES}
right,left\n2,0\n0,3\n > B.csv
solve A.csv B.csv --game => B.csv: {OTHER_NAMES:'right'|'left'}; {SAME_NAMES}
left,middle,right\n2,0,1\n0,3,1\n > B.csv
solve A.csv B.csv --game => A.csv: B: {SHAPE_OF_GAME:2 x 3|2 x 2}; {AGREE}
1,2,3\n > B.csv
solve A.csv B.csv --game => A.csv: B: {SHAPE_OF_GAME:1 x 3|2 x 2}; {AGREE}
left,right\n2,0\n0,1/0\n > B.csv
solve A.csv B.csv --game
    => B.csv: line 3, column 2: is '1/0', a division by 0; {A_NUMBER}
solve A.csv --game
    => --game: takes two files, not 1; give the payoffs of the row player and those of
    the column player
3,0\n0,2\n > A.csv
2;0\n0;3\n > B.csv
convert A.csv B.csv => B.csv: q: {ROWS:2|2}; {ONE_ROW}; {ADD_GAME}
3,0\n0,2\n > A.csv
2;0\n0;3\n > B.csv
solve A.csv B.csv --all => --all: {ONE_PROBLEM}; {ADD_GAME}
""",
    {"A.csv": "left,right\n3,0\n0,2\n"},
)

MODEL = (
    "g3 1 1 0\t# problem\n 1 1 1 0 0\n 0 0 0 0 0 0\n 0 0\n 0 0 0\n 0 0 0 1\n"
    " 0 0 0 0 0\n 1 0\n 0 0\n 0 0 0 0 0\nC0\no44\nv0\nO0\n0\nn0\nx0\nr\n5\n1\n1\n"
    "b\n2\n0\nk0\nJ0\n1\n0\n1\n"
)
# 0 <= z complements exp(z) + z >= 0, with other lines in place of some.
MODELS = contents(
    "model.nl",
    r"""
0 0 0 1\n 0 0 0 0 0 -> 0 0 0 1\n 1 2 0 0 0
    => has 3 integer variables; {CONTINUOUS:complementarity problems of |}
1 1 1 0 0 -> 1 1 1 0 0 2
    => has 2 logical constraints; {CONTINUOUS:complementarity problems of |}
r\n5\n1\n1 -> r\n0\n1\n5 and o44\nv0 -> n0 and \
1 1 1 0 0 -> 1 1 0 0 0 and O0\n0\nn0\nx0 -> x0
    => C0: {COMPLEMENTS_NOTHING}; {WITH_ITS_VARIABLE}
r\n5\n1\n1 -> r\n1\n5 and o44\nv0 -> n0 and \
1 1 1 0 0 -> 1 1 0 0 0 and O0\n0\nn0\nx0 -> x0
    => C0: {COMPLEMENTS_NOTHING}; {WITH_ITS_VARIABLE}
1 1 1 0 0 -> 2 1 1 0 0 and k0 -> 3\nk1\n0
    => {NOT_SQUARE:0|1 variable}; {SQUARE_SYSTEMS}
\n 1 1 1 -> \n 1 0 0 and O0\n0\nn0\nx0 -> x0 and \n 1 0\n -> \n 0 0\n and \
C0\no44\nv0\n ->  and r\n5\n1\n1\nb\n2\n0\nk0\nJ0\n1\n0\n1 -> r\nb\n0\n-1\n2\nk0
    => {NOT_SQUARE:0|1 variable}; {SQUARE_SYSTEMS}; a variable with two bounds but no
    row may have lost it, as by inequality() in Pyomo: write Var(bounds=(l, u)) and
    complements(x >= l, F >= 0)
o44\nv0 -> n0 and r\n5\n1\n1 -> r\n4\n0 and \
1 1 1 0 0 -> 1 1 0 0 0 and O0\n0\nn0\nx0 -> x0
    => v0: has bounds but no row that it complements; complement it with a row, or take
    its bounds out: equations do not keep them
b\n2\n0 -> b\n1\n2
    => v0: is complemented with a lower bound, but has an upper bound; write the bounds
    of the variable in its complementarity condition
b\n2\n0 -> b\n0\n2\n1 => v0: has the bounds 2 and 1; {CORRECT_THEM}
o44\nv0 -> o3\nv0\nn0 => C0: divides by the constant 0; correct the model
o44 -> o2\nn-inf
    => C0: computes with the constant -inf, so that it is finite nowhere; correct it;
    the program that wrote the file may have divided by 0
o44\nv0 -> n0 and J0\n1\n0\n1 -> J0 1\n0 nan => M[0][0]: {NOT_FINITE}; {FINITE}{FROM_0}
o44 -> o99 => line 12: has the unknown operator o99; {COUNTS_RIGHT}
o44 -> o13
    => line 12: has the operator floor (o13); functions that jump are not solved; write
    the model without it
o44 -> f0 1 => line 12: has an imported function or a text; {WITH_OPERATORS}
C0 -> F0 1 1 besselj\nC0 => line 11: imports the function 'besselj'; {WITH_OPERATORS}
v0 -> v7 => line 13: names v7, which is not defined before it; {COUNTS_RIGHT}
C0 -> C3 => line 11: names row 3, counted from 0, of 1; {COUNTS_RIGHT}
C0 -> Q3 => line 11: {IN_PLACE_OF:'Q'|a segment}; {COUNTS_RIGHT}
x0 -> x1\n0 one => line 18: {IN_PLACE_OF:'one'|a number}; {COUNTS_RIGHT}
5 -> 9 => line 19: {IN_PLACE_OF:'9'|the kind of a bound}; the kinds are 0 to 5
J0\n1 -> J0\n2 => line 29: {ENDS_TOO_EARLY}; {CUT_OFF}
\n 1 0 -> \n 2 0 => has 1 entries of rows (J), but its header says 2; {CUT_OFF}
O0\n0\nn0 -> O0\n0\nv0
    => has an objective, and is not linear; {WITHOUT_OBJECTIVE:the objective}, or write
    its optimality conditions as complementarity conditions; lcp minimizes over the
    solutions of linear models only
o44\nv0 -> n0 and O0\n0\nn0 -> O0\n0\no76\nv0
    => has an objective that is not linear; write a linear one, or
    {WITHOUT_OBJECTIVE:it}
""",
    made=partial(changed, MODEL),
)
# minimize 0 subject to v0 >= 1 and v0 >= 0.
PROGRAM = changed(MODEL, "r\n5\n1\n1 -> r\n2\n1 and o44\nv0 -> n0")
TERMS = {
    r"o44\nv0": "the operator exp of variables",
    r"o2\nv0\no76\nv0": "a term of degree 3",
    r"o75\nv0\nn3": "the operator ^ of variables",
    r"o3\nn1\nv0": "the operator / of variables",
    r"o3\nv0\nn0": "the operator / of variables",
    r"o64\n2\nn1\nn0\nn2\nv0": "a piecewise linear function",
    r"o15\nv0": "the operator abs of variables",
    r"o11\n2\nv0\nn1": "the operator min of variables",
}
OF_PROGRAMS = contents(
    "model.nl",
    "\n".join(
        rf"O0\n0\nn0 -> O0\n0\n{term} => has {{NO_QUADRATIC_PROGRAM:{words}|the "
        "objective}; {OTHER_PROGRAMS}\n"
        rf"C0\nn0 -> C0\n{term} and O0\n0\nn0 -> O0\n0\nv0 => has "
        f"{{NO_QUADRATIC_PROGRAM:{words}|C0}}; {{OTHER_PROGRAMS}}"
        for term, words in TERMS.items()
    ),
    made=partial(changed, PROGRAM),
)
# Two variables, and two rows that complement the first of them.
TWO_ROWS = (
    "g3 1 1 0\t# problem\n 2 2 1 0 0\n 0 0 0 0 0 0\n 0 0\n 0 0 0\n 0 0 0 1\n"
    " 0 0 0 0 0\n 2 0\n 0 0\n 0 0 0 0 0\nC0\no44\nv0\nC1\no44\nv0\nO0\n0\nn0\nx0\n"
    "r\n5\n1\n1\n5\n1\n1\nb\n2\n0\n2\n0\nk1\n0\nJ0\n1\n0\n1\nJ1\n1\n0\n1\n"
)
MODELS += contents(
    "model.nl",
    r"""
C1 -> C1 => C1: complements v0, and so does C0; {A_VARIABLE_EACH}
C0\no44 -> C0 and C1\no44\nv0 -> C1\nn0 and 1\n1\n5\n1\n1 -> 1\n1\n4\n0 and \
2\n0\n2\n0 -> 2\n0\n1\n-1 and J1\n1\n0\n1 -> J1\n2\n0\n1\n1\n-1 and \n 2 0\n -> \n 3 0\n
    => v0: has the bounds 0 and -1 by its complementarity condition; {CORRECT_THEM}
""",
    made=partial(changed, TWO_ROWS),
)
MODELS += contents(
    "model.nl",
    r"""
hello\n => line 1: is not the beginning of an .nl file; begin it with g3 or b3
g3 1 1\nhello\n => line 2: has not the 5 counts of the header; {CUT_OFF}
""",
)
MODELS += contents(
    "model.nl",
    r"o44\nv0 -> n0 and J0\n1\n0\n1 -> J0 1\n0 nan "
    r"=> M[0][0]: {NOT_FINITE}; {FINITE}{FROM_0}",
    made=partial(changed, MODEL),
    command="convert {} -o model.json",
)

WRITTEN = commands(
    r"""
convert winkels -o w.nfg => w.nfg: {ONLY_READ}; {COMPLETE}
convert winkels -o w.efg => w.efg: {ONLY_READ}; {COMPLETE}
{"c": [1]} > p.json
convert p.json -o p.lp => p.lp: {ONLY_READ}; {COMPLETE}
{"c": [1], "upper": 1e21} > p.json
convert p.json -o p.mps
    => p.mps: upper: has a bound of 1e+20 or more, which means no bound in MPS; give
    --infinity 1e20 if it means that here too, or write .json
convert mixed.json -o a.json.gz => a.json.gz: has the unknown suffix .gz; {SUFFIX}
convert mixed.json -o a => a: has no suffix; {SUFFIX}
convert mixed.json -o .csv => .csv: has no suffix; {SUFFIX}
convert mixed.json -o out.mtx => out.mtx: {CANNOT_HOLD_BOUNDS}; {WITH_BOUNDS}
convert mixed.json -o out.npy => out.npy: {CANNOT_HOLD_BOUNDS}; {WITH_BOUNDS}
""",
    {
        "mixed.json": (
            '{"M": [[2, 0], [0, 2]], "q": [-1, -1], "lower": [0, null], "upper": 1}'
        )
    },
)

ANSWERS = contents(
    "answer",
    r"""
=> {EMPTY}; {ONE_ROW_OF_NUMBERS}
# nothing => contains no numbers; give one row per line
0 1 2 => z: {ENTRIES:3 entries|4 unknowns}; {AGREE}
0 a 2 3 => line 1, column 2: {HAS_NO_NUMBER:'a'}; {A_NUMBER}
0 1/0 2 3 => line 1, column 2: {HAS_NO_FRACTION:'1/0'}; {FRACTIONS}
0 1e999999999 2 3 => line 1, column 2: {HAS_NUMBER:'1e999999999'}; {EXPONENTS}
nan\n1\n2\n0\n => line 1, column 1: {HAS_NOT_FINITE:'nan'}; {FINITE}
1 2\n3 4\n => {HEADLESS:2|2}; {A_TABLE_WITH_Z}
{ => line 1, column 2: {ENDS_TOO_EARLY}; {FILE_CUT_OFF}
[0, null, 1, 2] => [1]: {IS:null}; give a number, or a fraction as a string{FROM_0}
[1e-999999999, 1, 2, 3] => {HAS_NUMBER:'1e-999999999'}; {EXPONENTS}
{"w": [0]} => {NO_Z}; {A_LIST_OR_RESULT}
{"z": 3} => z: {IS:a number}; {A_LIST}
{"z": [Infinity, 0, 0, 0]} => {HAS_NOT_FINITE:'Infinity'}; {FINITE}
{"z": [1], "exact": {"z": ["1/2"]}} => exact.z: {ENTRIES:1 entry|4 unknowns}; {AGREE}
{"z": [1], "certificate": {"kind": "farkas", "vector": null}}
    => certificate.vector: {IS:null}; {A_LIST}
""",
    command="check paper-example-2 {}",
)
TABLES = contents(
    "z.csv",
    r"""
component,z\n1,0\n2,1\n3,1\n5,0\n
    => line 5, column 1: has component '5', while 4 is missing; {EACH_ONCE:1|4}
component,z\n1,0\n2,1\n2,1\n4,0\n
    => line 4, column 1: has component '2' again, while 3 is missing; {EACH_ONCE:1|4}
component,z,w\n1,0,0\n2,1,0\n => z: {ENTRIES:2 entries|4 unknowns}; {AGREE}
node,z\nA,0\nB\nC,1\nD,0\n
    => line 3: {ENTRIES_WHERE:1 column|line 2|2}; {EQUAL_COLUMNS}
node,z\nA,0\nB,x\nC,1\nD,0\n => line 3, column 2: {HAS_NO_NUMBER:'x'}; {A_NUMBER}
node,y\nA,0\nB,1\nC,1\nD,0\n => {NO_COLUMN_Z}; {A_TABLE_WITH_Z}
5,0\n7,1\n8,1\n9,0\n => {HEADLESS:4|2}; {A_TABLE_WITH_Z}
component,z,w\n => {HEADER_ALONE}; {ONE_ROW_PER_LINE}
""",
    command="check paper-example-2 {}",
)
AS_TABLES = commands(
    r"""
check good.json z.md => z.md: {RESULT_AS_TABLE}; {AS_JSON_OR_CSV}
check good.json z.txt => z.txt: {RESULT_AS_TABLE}; {AS_JSON_OR_CSV}
solve z.tex => z.tex: {RESULT_AS_TABLE}; {AS_JSON_OR_CSV}
solve z.txt => z.txt: {RESULT_AS_TABLE}; {AS_JSON_OR_CSV}
""",
    {
        **PAIR,
        "z.md": "### good: n = 2\n\nlcp 1.10, tol 1e-10, at most 10000 iterations\n",
        "z.tex": "\\caption{good: n = 2. lcp 1.10, tol $10^{-10}$, at most}\n",
        "z.txt": "good: n = 2\n1 solution\nlcp 1.10, in exact arithmetic, 1 ms\n",
    },
)

SEXES = {
    "sexes.json": (
        '{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["opera", "box"]}'
    )
}
STRATEGIES = contents(
    "s.json",
    r"""
{"row": [0.6, 0.5], "column": [0.4, 0.6]} => row: has the sum 1.1; {PROBABILITIES}
{"row": [0.6, 0.4], "column": [1.4, -0.4]}
    => column: has a negative entry; {PROBABILITIES}
{"row": [0.6], "column": [0.4, 0.4, 0.6]}
    => row: {ENTRIES:1 entry|2 strategies}; {AGREE}
{"row": "0.6", "column": [0.4, 0.6]} => row: {IS:the text '0.6'}; {A_LIST}
{"solutions": []} => solutions: {EMPTY}; {A_SOLUTION}
{"solutions": [3]} => solutions[0]: {IS:a number}; {A_LIST_OR_RESULT}
""",
    command="check sexes.json {}",
    files=SEXES,
)
OTHER_STRATEGIES = commands(
    r"""
{"row": [1], "column": [1]} > s.json
{"M": [[1]], "q": [-1]} > p.json
check p.json s.json => s.json: row: is a strategy, but the problem is not a game; give z
{"A": [[1e-4000]], "B": [[1]]} > game.json
check game.json 1,1
    => game.json: has the payoff '1e-4000'; write it with at most 1000 digits
{"A": [[1e-310, 0], [0, 2e-310]], "B": [[2e-310, 0], [0, 3e-310]]} > tiny.json
check tiny.json 1,0,1,0
    => 1,0,1,0: z: of these strategies exceeds the double-precision range;
    {SCALE_PAYOFFS}
3,0,1\n0,2,1\n > A.csv
1,0,0\n0,2,0\n > B.csv
check A.csv B.csv --game 1,0,0,1
    => 1,0,0,1: z: {ENTRIES:4 entries|2 and 3 strategies}; {AGREE}
""",
)

# By the content of the file, in three formats.
STATES = [
    refusal
    for ending, table in {
        "json": r"""
{"x": 1} => basis: {MISSING}; {STATES}
{"basis": 3} => basis: {IS:a number}; {STATES}
3 => basis: {IS:a number}; {STATES}
{ => line 1, column 2: {ENDS_TOO_EARLY}; {FILE_CUT_OFF}
z\n1 => line 1, column 1: {NOT_JSON:'z\n1'}; {CORRECT_IT_THERE}
""",
        "csv": r"""
{"x": 1} => basis: {MISSING}; {STATES}
{"basis": 3} => basis: {IS:a number}; {STATES}
3 => z: {ENTRIES:1 entry|4 unknowns}; {AGREE}
{ => line 1, column 2: {ENDS_TOO_EARLY}; {FILE_CUT_OFF}
z\n1 => z: {ENTRIES:1 entry|4 unknowns}; {AGREE}
""",
        "npy": r"""
{"x": 1} => {NO_STATES}; {STATES}
{"basis": 3} => {NO_STATES}; {STATES}
3 => {NO_STATES}; {STATES}
{ => {NO_STATES}; {STATES}
z\n1 => {NO_STATES}; {STATES}
{"basis": ["basic"]} => {NO_STATES}; {STATES}
""",
    }.items()
    for refusal in contents(
        f"states.{ending}", table, command="solve paper-example-1 --basis {}"
    )
]
STATES += commands(
    r"""
{"basis": ["basic"]} > states.json
solve paper-example-1 --basis states.json
    => --basis: states.json: basis: {ENTRIES:1 entry|4 unknowns}; {AGREE}
{"basis": ["basic"]} > states.csv
solve paper-example-1 --basis states.csv
    => --basis: states.csv: basis: {ENTRIES:1 entry|4 unknowns}; {AGREE}
"""
)

STARTS = commands(
    r"""
1,2,3 > start.csv
solve good.json --x0 start.csv
    => start.csv: --x0: z: {ENTRIES:3 entries|2 unknowns}; {AGREE}
1,x > start.csv
solve good.json --x0 start.csv
    => start.csv: line 1, column 2: {HAS_NO_NUMBER:'x'}; {A_NUMBER}
solve good.json --x0 M.csv => M.csv: --x0: {HEADLESS:2|2}; {A_TABLE_WITH_Z}
%%MatrixMarket matrix array real general\n1 1\n1\n > x.mtx
solve good.json --x0 x.mtx => x.mtx: --x0: {ENTRIES:1 entry|2 unknowns}; {AGREE}
{"z": [1], "w": [0]} > r.json
solve good.json --x0 r.json => r.json: --x0: z: {ENTRIES:1 entry|2 unknowns}; {AGREE}
{"z": [1, null], "w": [0, 0]} > r.json
solve good.json --z0 r.json => r.json: --z0: z[1]: {IS:null}; {REAL}{FROM_0}
{"z": [1, 2]} > r.json
solve good.json --x1 r.json
    => r.json: --x1: is an object without z and w; {A_LIST_OR_RESULT}
{"z": [0.5, 0.5], "w": [0, > r.json
solve good.json --x0 r.json
    => r.json: line 1, column 27: {ENDS_TOO_EARLY}; {FILE_CUT_OFF}
equilibrium,player,strategy,probability,payoff,name\n1,row,1,1.0,2.0,go\n\
1,column,1,1.0,2.0,"left, or"\n > game.csv
solve good.json --z0 game.csv => game.csv: --z0: {NO_COLUMN_Z}; {A_TABLE_WITH_Z}
1,2\n3,4\n > t.csv
solve good.json --lower t.csv => t.csv: --lower: {ROWS:2|2}; {ONE_ROW}
 > t.csv
solve good.json --lower t.csv
    => t.csv: {EMPTY}; give a number, none, or one number for each unknown
{"c": [1]} > p.json
solve p.json --lower 1 => --lower: {FOR_M_AND_Q:a program}; {BOUNDS_IN_FILE}
""",
    PAIR,
)


REFUSALS = [
    *TEXTS,
    *(*NAMED, *CSV, *JSON, *LONG_INTEGER, *KEYS, *SPARSE, *ORIGINS),
    *(*MATRIX_MARKET, *LONG_ENTRY, *TWO_FILES, *LABELS, *FOREIGN, *NOTHING, *CONTACTS),
    *(*PROGRAMS, *CHANGED_PROGRAMS, *MORE_KEYS, *FROM_QP, *TWO_FORMS),
    *(*MPS, *NO_COLUMNS, *DIETS, *LP, *FROM_GAME, *COSTS, *LARGE_GAME),
    *(*STRATEGIC_OPENINGS, *STRATEGIC_FORM, *TREE_OPENINGS, *TREES, *NODES),
    *(*TABLES_OF_GAMES, *MODELS, *OF_PROGRAMS, *WRITTEN, *ANSWERS, *TABLES, *AS_TABLES),
    *(*STRATEGIES, *OTHER_STRATEGIES, *STATES, *STARTS),
]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_a_file_that_cannot_be_used_is_refused(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line
