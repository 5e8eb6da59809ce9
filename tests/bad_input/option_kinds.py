"""What can be wrong with options, with a start or the result that it is taken from, and with a place for the output."""

from __future__ import annotations

from .kinds import of_file, of_line, of_solving

RESULT = '{"z": [0.5, 0.5], "w": [0, 0]}'
FROM_RESULTS = [
    of_file("r.json", '{"z": [1], "w": [0]}', "solve good.json --x0 r.json", "r.json: --x0: z:", "1 entry", "2 unkn"),
    of_file("r.json", '{"z": [1, null], "w": [0, 0]}', "solve good.json --z0 r.json", "--z0: z[1]:", "null", "number"),
    of_file("r.json", '{"z": [1, 2]}', "solve good.json --x1 r.json", "r.json: --x1:", "without z and w", "list"),
    of_file("r.json", RESULT[:-4], "solve good.json --x0 r.json", "r.json: line 1, column", "too early"),
    of_file("r.json", RESULT, "solve good.json --x0 r.json --z0 1,1", "--z0:", "--x0", "leave one out"),
    of_solving("z0-text", "--z0 a,b", "--z0:", "'a,b'", "neither", "1,-2,0.5"),
    of_solving("z0-too-large", "--z0 1e308,1", "M z0 + q[0]:", "finite"),
]

OPTIONS = [
    of_solving("rho-half", "--method shi --rho 0.5", "--rho:", "0.5", "0 < rho < 1/2"),
    of_solving("rho-nan", "--method shi --rho nan", "--rho:", "nan", "0 < rho < 1/2"),
    of_solving("sigma-not-above-rho", "--method shi --rho .3 --sigma .3", "--sigma:", "0.3", "rho < sigma < 1"),
    of_solving("sigma-below-default-rho", "--method shi --sigma 1e-5", "--sigma:", "1e-05", "rho < sigma < 1"),
    of_solving("sigma-one", "--method shi --sigma 1", "--sigma:", "1.0", "rho < sigma < 1"),
    of_solving("p-zero", "--method shi --p 0", "--p:", "0.0", "0 < p < infinity"),
    of_solving("p-infinite", "--method shi --p inf", "--p:", "inf", "0 < p < infinity"),
    of_solving("p-text", "--method shi --p large", "--p", "'large'", "float"),
    of_solving("k-star-zero", "--method shi --k-star 0", "--k-star: 0 ", "whole number >= 1"),
    of_solving("k-star-fractional", "--method shi --k-star 1.5", "--k-star", "'1.5'", "integer"),
    of_solving("omega-word", "--method fixed-point --omega best", "--omega", "best"),
    of_solving("anderson-negative", "--method fixed-point --anderson -1", "--anderson:", "-1", "whole number >= 0"),
    of_solving("k-star-for-auto", "--k-star 2", "has no effect with auto; it belongs to shi: add --method shi"),
    of_line(
        "k-star-for-two", "compare --method newton --method lemke --k-star 2", "no effect with newton and lemke; it"
    ),
    of_solving("scale-for-newton", "--method newton --scale", "it belongs to shi and fixed-point", "leave it out"),
    of_solving("omega-zero", "--method fixed-point --omega 0", "--omega:", "0.0", "0 < omega < infinity"),
    of_solving("tol-zero", "--tol 0", "--tol:", "0.0", "0 < tol < 1"),
    of_solving("tol-one", "--tol 1", "--tol:", "1.0", "0 < tol < 1"),
    of_solving("max-iterations-negative", "--max-iterations -1", "--max-iterations: -1 ", ">= 0"),
    of_solving("time-limit-zero", "--time-limit 0", "--time-limit:", "0.0", "seconds > 0"),
    of_solving("time-limit-nan", "--time-limit nan", "--time-limit:", "nan", "seconds > 0"),
    of_solving("every-zero", "--every 0", "--every: 0 ", "whole number >= 1"),
    of_solving("x1-for-fixed-point", "--method fixed-point --x1 1,1", "--x1:", "no effect", "fixed-point", "leave"),
    of_solving("trace-to-json", "--trace t.json", "--trace:", "t.json", ".csv"),
    of_solving("trace-over-a-file", "--trace q.csv", "--trace:", "q.csv exists", "another file", q="1,2\n"),
    of_solving("trace-over-the-output", "-o t.csv --trace t.csv", "--trace:", "same file as --output"),
    of_solving("trace-unseen", "--trace --format json -q", "--trace:", "no effect", "leave it out"),
    of_solving("every-unseen", "--every 2 -q", "--every:", "no effect", "leave it out"),
    of_solving("unknown-method", "--method newton-raphson", "--method", "'newton-raphson'", "did you mean newton?"),
    of_solving("unknown-format", "--format xml", "--format", "'xml'", "choose one of table, json"),
    of_solving("unknown-option-with-value", "--toll=1", "lcp: --toll: is no option of lcp solve; did you mean --tol?"),
    of_solving("option-with-one-dash", "-max-iterations 1", "-max-iterations: is no", "did you mean --max-iterations?"),
    of_solving("beginning-of-an-option", "--max 1", "did you mean --max-iterations?"),
    of_solving("format-as-an-option", "--json", "--json: is no option of lcp solve; did you mean --format json?"),
    of_solving("method-as-an-option", "--newton", "--newton: is no option of lcp solve; did you mean --method newton?"),
    of_solving("limit-of-other-tools", "--maxiter 3", "did you mean --max-iterations?"),
    of_solving("underscore-in-option", "--k_star 3", "did you mean --k-star?"),
    of_solving("unlike-any-option-in-one-letter", "-n 3", "lcp: -n: is no option of lcp solve; see lcp solve --help\n"),
    of_solving("unlike-any-method", "--method zzz", "'zzz'", "choose one of auto, shi"),
    of_solving("option-without-value", "--tol", "lcp: --tol: requires an argument; see lcp solve --help\n"),
    of_solving("flag-with-value", "--quiet=3", "lcp: --quiet: does not take a value; see lcp solve --help\n"),
    of_solving("option-given-twice", "--tol 1 --tol 2", "lcp: --tol: is given 2 times; give it once\n"),
    of_line("unknown-command", "solv good.json", "lcp: COMMAND: 'solv' is unknown; did you mean solve?\n"),
    of_line("unlike-any-command", "good.json", "'good.json'", "did you mean lcp solve good.json?"),
    of_line("no-such-command", "zzz", "'zzz'", "choose one of solve, compare"),
    of_line("misspelt-suite", "bench spase", "spase:", "did you mean sparse?"),
    of_line("misspelt-peer", "bench quick --peer qantecon", "--peer:", "did you mean quantecon"),
    of_line("misspelt-shell", "completion bahs", "lcp: SHELL: 'bahs'", "did you mean bash?"),
    of_line("no-file", "solve", "lcp: FILE: is missing; see lcp solve --help\n"),
    of_line("a-file-too-many", "inspect a b c", "lcp: inspect: ", "argument (c); see lcp inspect --help\n"),
    of_line("a-file-too-few", "check a", "FILE [Q_FILE] SOLUTION: stands for 2 or 3 files, not 1; give the file of"),
    of_line("misspelt-family", "make murtty", "lcp: FAMILY: 'murtty' is unknown; did you mean murty?\n"),
    of_line("no-such-family", "make foo", "lcp: FAMILY: 'foo' is unknown; lcp make --list shows the families\n"),
    of_line("misspelt-topic", "help metods", "lcp: TOPIC: 'metods' is unknown; did you mean methods?\n"),
    of_line("no-such-topic", "help zzz", "lcp: TOPIC: 'zzz' is unknown; lcp help lists the topics\n"),
]

STARTS = [
    of_solving("x0-text", "--x0 a,b", "--x0:", "'a,b'", "neither", "1,-2,0.5"),
    of_solving("x0-missing-file", "--x0 start.csv", "--x0:", "'start.csv'", "neither", "name a file"),
    of_solving("x0-underscore", "--x0 1_0,1", "--x0:", "1_0", "numbers"),
    of_solving("x0-one-number", "--x0 1", "--x0:", "1 entry", "2 unknowns"),
    of_solving("x0-nan", "--x0 1,nan", "--x0[1]:", "finite"),
    of_solving("x1-infinite", "--method shi --x1 inf,1", "--x1[0]:", "finite"),
    of_solving("x0-file-too-long", "--x0 start.csv", "start.csv:", "--x0:", "3 entries", "2 unknowns", start="1,2,3"),
    of_solving("x0-file-of-text", "--x0 start.csv", "start.csv: line 1, column 2:", "'x'", "number", start="1,x"),
    of_solving("x0-file-a-matrix", "--x0 M.csv", "M.csv: --x0:", "2 rows and 2 columns", "one row"),
    of_solving("x0-file-a-problem", "--x0 good.json", "good.json: --x0:", "object", "list of numbers"),
]

UNWRITABLE = [
    of_solving("output-into-no-folder", "-o nowhere/x.json", "nowhere/x.json:", "no folder", "create it first"),
    of_solving("output-below-a-file", "-o good.json/x.json", "good.json/x.json:", "no folder"),
    of_solving("output-a-directory", "-o results", "results:", "is a directory", "name a file"),
    of_solving("output-without-a-name", "-o ", "empty", "name a file"),
    of_solving("output-in-proc", "-o /proc/x.json", "/proc/x.json:", "cannot be written", "choose another"),
    of_solving("output-over-a-file-in-proc", "-o /proc/version", "/proc/version:", "cannot be written", "choose"),
    of_solving("output-by-a-link-to-itself", "-o loop", "loop:", "cannot be written", "choose"),
    of_solving("output-name-too-long", f"-o {'a' * 300}", "aaa:", "cannot be written", "choose"),
]
