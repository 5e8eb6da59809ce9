"""What can be wrong with a file before its format matters, with CSV, and with standard input."""

from __future__ import annotations

from .kinds import GOOD, of_csv, of_json, of_line, of_stdin

FILES = [
    of_line("missing-file", "solve elsewhere.txt", "elsewhere.txt:", "no such file", "check the path"),
    of_line("misspelt-file", "solve goood.json", "goood.json:", "no such file", "did you mean good.json?"),
    of_line("missing-folder", "solve nowhere/good.json", "nowhere/good.json:", "no folder nowhere"),
    of_line("missing-q-file", "solve M.csv qq.csv", "qq.csv:", "no such file", "did you mean q.csv?"),
    of_line("no-name", "solve ", "empty", "file"),
    of_line("line-break-in-file-name", "solve a\nb.json", "a\\nb.json", "no such file"),
    of_line("file-name-not-utf-8", "solve \udcff.json", "\\udcff.json", "no such file"),
    of_line("directory", "inspect results", "results:", "is a directory", "name a file"),
    of_line("unreadable", "solve /proc/self/mem", "/proc/self/mem:", "cannot be read"),
    of_json("empty", "", "is empty", "M and q"),
    of_csv("q-not-last", "q;z1;z2\n1;2;3\n4;5;6\n", "line 1, column 1", "headed q", "last column"),
    of_json("latin-1", GOOD.replace("}", ', "name": "Schäfer"}').encode("latin-1"), "UTF-8"),
    of_json("utf-16-without-mark", GOOD.encode("utf-16-le"), "UTF-8"),
    of_csv("csv-utf-16-cut-off", "2,-1\n".encode("utf-16")[:-1], "UTF-8"),
]

CSV = [
    of_csv("ragged", "2,0,-1\n0,2\n", "line 2:", "2 columns", "line 1 has 3", "same number of columns"),
    of_csv("text-in-the-middle", "2,0,-1\n0,x,-1\n", "line 2, column 2:", "'x'", "number"),
    of_csv("empty-field", "# M | q\n\n2,0,-1\n0,,-1\n", "line 4, column 2:", "empty", "number"),
    of_csv("thousands", "1.000,5;0;-1\n0;2,5;-1\n", "line 1, column 1:", "'1.000,5'", "decimal commas", "thousands"),
    of_csv("two-commas", "1,000,5;-1\n", "line 1, column 1:", "'1,000,5'", "not a number"),
    of_csv("thousands-alone", "1.000;0;-1\n0;2,5;-1\n", "line 1, column 1:", "'1.000'", "decimal commas"),
    of_csv("index-without-header", "0,2,0,-1\n1,0,2,-1\n", "2 rows of 4 columns", "an index?", "index=False"),
    of_csv("numbered-columns", "0,1\n2,0\n0,2\n", "3 rows of 2 columns", "number the columns?", "header=False"),
    of_csv("complex", "2,0,-1\n0,1+2j,-1\n", "line 2, column 2:", "'1+2j'", "real problems"),
    of_csv("spreadsheet-error-first", "2;0;-1\n#NV;0;1\n0;2;-1\n", "line 2, column 1:", "'#NV', not a number"),
    of_csv("nan", "2,nan,-1\n0,2,-1\n", "line 1, column 2:", "nan", "finite"),
    of_csv("5000-digits", f"2,0,-1\n0,1{'0' * 5000},-1\n", "line 2, column 2:", "1000", "finite", "double precision"),
    of_csv("only-a-header", "a,b,c\n", "header", "no numbers", "row"),
    of_csv("only-comments", "# a\n# b\n", "no numbers", "row"),
    of_csv("M-without-q", "2,0\n0,2\n", "M, 2 x 2", "no q", "add q", "name the file of q after it"),
    of_csv("too-many-columns", "2,0,-1,0\n0,2,-1,0\n", "2 rows of 4 columns", "n + 1 columns"),
    of_csv("unbalanced-quote", '2,0,-1\n0,"2,-1\n', "line 2:", "not CSV", "correct"),
    of_csv("underscores-throughout", "1_000,1_000\n", "line 1, column 1:", "'1_000'", "not a number"),
    of_line("q-too-long-for-M", "solve M.csv q.csv", "M.csv:", "2 x 2", "q has 3 entries", "agree", q="1,2,3\n"),
    of_line("q-file-beside-q", "solve M.csv q.csv", "q.csv:", "not needed", "M.csv contains", M="2,0,1\n0,2,1\n"),
    of_line("q-a-matrix", "solve M.csv q.csv", "q.csv: q:", "3 x 2", "M is 2 x 2", "one column", q="1,2\n3,4\n5,6\n"),
    of_line("text-in-q-file", "solve M.csv q.csv", "q.csv: line 1, column 2:", "'x'", "number", q="1,x\n"),
    of_line("q-file-empty", "solve M.csv q.csv", "q.csv:", "empty", "one row", q=""),
    of_line("q-file-a-problem", "solve M.csv good.json", "good.json: q:", "object", "list of numbers"),
    of_line("q-file-broken-list", "solve M.csv q.csv", "q.csv: line 1, column", "too early", q="[1, 2 "),
]

STANDARD_INPUT = [
    of_stdin("stdin-blank", b"\n\n", "empty", "M and q"),
    of_stdin("stdin-latin-1", "ä".encode("latin-1"), "UTF-8"),
    of_stdin("stdin-bad-q", b"1,x\n", "line 1, column 2:", "'x'", "number", line="solve M.csv -"),
    of_stdin("stdin-json-with-q-file", GOOD.encode(), "q.csv:", "not needed", "leave it out", line="solve - q.csv"),
    of_stdin("stdin-for-M-and-q", b"2,0\n0,2\n", "file", line="solve - -"),
    of_stdin("stdin-for-two-problems", GOOD.encode(), "file", line="compare - -"),
]
