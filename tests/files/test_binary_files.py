"""Binary files that are malformed, and texts of any length, are refused in one line, in
words of this program and in bounded time."""

import gzip
import io
import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from lcpcli.errors import ProblemError
from lcpcli.files import beside, reading

from ..refusals import Refusal, commands, contents
from ..wordings import CHECK_PATH, NO_SUCH_FILE
from .binary import archive, mat, npy, zip_of

GOOD = '{"M": [[2, 0], [0, 2]], "q": [-1, -1]}'
EYE, ONES = np.eye(2), np.ones(2)


def objects(value):
    found = np.empty((), dtype=object)
    found[()] = value
    return found


NAMES = {
    "np": np,
    "eye": EYE,
    "ones": ONES,
    "nan": np.nan,
    "objects": objects,
    "sparse": sparse,
}


def npz(arrays):
    return archive(**eval(f"dict({arrays})", dict(NAMES)))


ARRAYS = contents(
    "bad.npz",
    r"""
q=ones
    => M: {MISSING}; add the key M, or data, indices, indptr and shape of a sparse M
M=eye * 1j, q=ones => M: is complex (complex128); {REAL}
M=eye > 0, q=ones => M: {OF_OTHER_TYPE:bool}; {NUMBERS}
M=eye, q=[1, nan] => q[1]: {NOT_FINITE}; {FINITE}{FROM_0}
M=ones, q=ones => M: {DIMENSIONS:1 dimension}; {A_LIST_OF_ROWS}
M=eye, q=ones, name=3 => name: is an array of int64; {A_TEXT}
M=eye, q=ones, name=np.array([2**30], "<u4").view("<U1").reshape(())
    => name: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
M=eye, q=ones, lower=eye
    => lower: {DIMENSIONS:2 dimensions}; give a number, or a flat list of numbers
M=eye, q=ones, origin="3"
    => origin: {IS:a number}; give an object with the key kind
M=eye, q=ones, origin="{"
    => origin: line 1, column 2: {ENDS_TOO_EARLY}; is the file cut off?
M=eye, q=ones, origin='{"kind"\x3a "qp", "variables"\x3a 9}'
    => origin: {OTHER_ORIGIN}; {MAKE_AGAIN}
c=ones, data=ones, indices=[0, 1], indptr=[0, 1, 2], shape=[2, 2]
    => data: is part of a sparse matrix that has no name; call the parts of A A.data,
    A.indices, A.indptr and A.shape
P=eye, c=ones => P: {TWO_WAYS:c}; {WAYS_TO_WRITE_PROGRAMS}
P=eye, q=ones, G=objects([None]) => G: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
P=eye, q=ones, G=objects({}) => G: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
P=eye, q=ones, G=objects(sparse.eye_array(2))
    => G: is a sparse matrix as a pickle, which may run any code when it is read; save
    it dense, as by toarray()
P=eye, q=ones, h=[None, None] => h: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
P=eye, q=ones, unknown=objects(None)
    => unknown: {NO_KEY:a program}; the keys are P, q, G, h, A, b, lb, ub, name,
    source, note
P=objects(None), q=objects(None), G=eye => q: {MISSING}; add the objective, q'x
M=objects(None), q=ones
    => M: {MISSING}; add the key M, or data, indices, indptr and shape of a sparse M
M=eye, q=ones, bound=objects(None)
    => bound: {NO_KEY:a problem}; give the bounds as lower and upper, each a list
""",
    made=npz,
)

# The parts of a sparse M in a format, some of them changed, or None for missing.
PARTS = {
    "csr": {"data": [1.0, 1.0], "indices": [0, 1], "indptr": [0, 1, 2]},
    "csc": {"data": [1.0, 1.0], "indices": [0, 1], "indptr": [0, 1, 2]},
    "bsr": {"data": [[[1.0]], [[1.0]]], "indices": [0, 1], "indptr": [0, 1, 2]},
    "coo": {"data": [1.0, 1.0], "row": [0, 1], "col": [0, 1]},
    "dia": {"data": [[1.0, 1.0]], "offsets": [0]},
}


def sparse(text):
    form, _, changes = text.partition(", ")
    parts = {"shape": [2, 2], "q": ONES, "format": form.encode(), **PARTS[form]}
    parts |= eval(f"dict({changes})", dict(NAMES))
    return archive(**{name: part for name, part in parts.items() if part is not None})


SPARSE = contents(
    "bad.npz",
    r"""
csr, data=None => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
csr, indices=[0, -1] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
csr, indices=[0.0, 1.0] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
csr, indptr=[0, 5, 2] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
csr, indptr=[1, 1, 2] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
csr, shape=[2] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
csr, shape=[np.inf, 2.0] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
csc, indptr=[0, 1, -1] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
bsr, indptr=[0, 1, 2**40] => M: {INCONSISTENT:data, indices, indptr}; {ALL_PARTS}
coo, row=[0, 2**33] => M: {INCONSISTENT:data, row, col}; {ALL_PARTS}
coo, col=[0] => M: {INCONSISTENT:data, row, col}; {ALL_PARTS}
dia, offsets=[-5] => M: {INCONSISTENT:data, offsets}; {ALL_PARTS}
csr, format="lil" => format: {UNKNOWN:'lil'}; use one of csr, csc, bsr, coo, dia
csr, shape=[10**12, 10**12]
    => M: is declared as 1000000000000 x 1000000000000 with 2 entries; {ENTRIES_OF_1000}
csr, data=[1j, 1] => M: is complex (complex128); {REAL}
csr, data=[1, nan] => M[1][1]: {NOT_FINITE}; {FINITE}{FROM_0}
csr, M=eye => data: is part of a sparse M next to a dense M; keep one of them
""",
    made=sparse,
)

DAMAGED_FILES = {
    "text": b"hello",
    "single": npy(EYE),
    "unnamed": archive(EYE, ONES),
    "values": archive(M=EYE, q=ONES).replace(EYE.tobytes(), b"x" * 32),
    "file": zip_of({"readme.txt": b"hello"}),
    "twice": zip_of({"M.npy": npy(EYE), "M": npy(EYE)}),
    "huge": zip_of({"M.npy": npy(EYE, (10**9, 10**9))}),
    "short": zip_of({"M.npy": npy(EYE, (10**9,))}),
    "long": zip_of({"M.npy": npy(EYE, (3,))}),
    "sizeless": zip_of({"M.npy": npy(EYE[:0], (10**9,)).replace(b"'<f8'", b"'<U0'")}),
}
DAMAGED = contents(
    "bad.npz",
    r"""
text => is not NPZ; {NPZ_AGAIN}
single => {NO_Q:2 x 2}; {ADD_Q}
unnamed
    => arr_0: {NO_KEY:a problem}; the keys are name, source, note, M, q, lower, upper,
    x0, x1, solution, verdict, origin, names, data, indices, indptr, row, col, offsets,
    shape, format, _is_array
values => M: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
file => readme.txt: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
twice => M: occurs twice; {KEEP_ONE}
huge => M: takes more memory than there is; give matrices in sparse form
short => M: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
long => M: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
sizeless => M: {NO_ARRAY_OF_NUMBERS}; {NPZ_AGAIN}
""",
    made=lambda name: DAMAGED_FILES[name],
)

SHEET = zip_of({"[Content_Types].xml": "", "xl/workbook.xml": ""})


def saved(array):
    file = io.BytesIO()
    np.save(file, array, allow_pickle=True)
    return file.getvalue()


OTHERS = commands(
    r"""
solve M.csv lower.npz
    => lower.npz: q: {MISSING}; add the key q, or keep a single array
solve M.csv cube.npz => cube.npz: q: {DIMENSIONS:3 dimensions}; {A_FLAT_LIST}
solve whole.npz q.csv => q.csv: {NOT_NEEDED:whole.npz}; {GIVE_ALONE}
solve good.json --lower nan.npz
    => --lower: nan.npz: lower[1]: is not a number; give inf for no bound{FROM_0}
solve good.json --lower xy.npz
    => xy.npz: lower: {MISSING}; add the key lower, or keep a single array
solve lb.mat => lb.mat: lb: {MAY_BE_BOUNDS}; {RENAME}
solve L.mat => L.mat: L: {MAY_BE_BOUNDS}; {RENAME}
solve bnds.mat => bnds.mat: bnds: {MAY_BE_BOUNDS}; {RENAME}
solve ab.mat => ab.mat: a: {MAY_BE_BOUNDS}; {RENAME}
solve sheet.xlsx => sheet.xlsx: {SPREADSHEET}; {AS_CSV}
solve sheet.csv => sheet.csv: {SPREADSHEET}; {AS_CSV}
solve p.zip => p.zip: is compressed; uncompress it first
solve Ab.mat
    => Ab.mat: M: {MISSING}; call the matrix M and the vector q; the file holds A, b
solve complex.mat => complex.mat: M: is complex (complex128); {REAL}
solve complex.npy => complex.npy: q: is complex (complex128); {REAL}
solve objects.npy
    => objects.npy: is not an NPY file of numbers or texts, or is damaged; save it again
    with numpy.save, and not as objects
solve none.npy
    => none.npy: is not an NPY file of numbers or texts, or is damaged; save it again
    with numpy.save, and not as objects
solve cut.npy
    => cut.npy: is not an NPY file of numbers or texts, or is damaged; save it again
    with numpy.save, and not as objects
""",
    {
        "good.json": GOOD,
        "M.csv": "2,0\n0,2\n",
        "q.csv": "-1\n-1\n",
        "lower.npz": archive(a=ONES, b=ONES),
        "cube.npz": archive(q=np.ones((2, 2, 2))),
        "whole.npz": archive(M=EYE, q=ONES),
        "nan.npz": archive(lower=[0, np.nan]),
        "xy.npz": archive(x=ONES, y=ONES),
        "lb.mat": mat(M=EYE, q=ONES, lb=ONES),
        "L.mat": mat(M=EYE, q=ONES, L=-1),
        "bnds.mat": mat(M=EYE, q=ONES, bnds=EYE),
        "ab.mat": mat(M=EYE, q=ONES, a=0 * ONES, b=ONES),
        "sheet.xlsx": SHEET,
        "sheet.csv": SHEET,
        "p.zip": zip_of({"p.json": GOOD}),
        "Ab.mat": mat(A=EYE, b=ONES),
        "complex.mat": mat(M=EYE * 1j, q=ONES),
        "complex.npy": saved(np.column_stack((EYE, ONES)) * 1j),
        "objects.npy": saved(np.array([1, "a"], dtype=object)),
        "none.npy": saved(objects(None)),
        "cut.npy": npy(EYE)[:-8],
    },
)
LONG = [
    *(
        Refusal(f"solve '{name}'", {}, f"{shown}: {NO_SUCH_FILE}; {CHECK_PATH}")
        for name, shown in (
            ("a\nb.json", r"a\nb.json"),
            ("\udcff.json", r"\udcff.json"),
        )
    ),
    *commands(
        f"solve good.json --every {'9' * 400} => --every: is too large; "
        "{IT_MUST_BE:{WHOLE:1}}",
        {"good.json": GOOD},
    ),
    *contents(
        "bad.json",
        "=> is nested too deeply; M needs two levels of brackets",
        made=lambda _: f'{{"M": {"[" * 10**5}{"]" * 10**5}, "q": [1]}}',
    ),
    *contents(
        "bad.json",
        f"=> {'a' * 40}...: {{NO_KEY:a problem}}; the keys are name, source, note, M, "
        "q, lower, upper, x0, x1, solution, verdict, origin, names",
        made=lambda _: f'{GOOD[:-1]}, "{"a" * 10**5}": 1}}',
    ),
]
REFUSALS = [*ARRAYS, *SPARSE, *DAMAGED, *OTHERS, *LONG]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_a_binary_file_that_cannot_be_used_is_refused(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line


TWICE, MINUS = 2 * np.eye(2), -np.ones(2)
MATRIX_MARKET = b"%%MatrixMarket matrix array real general\n2 2\n2\n0\n0\n2\n"
WHOLE = {
    "p.npz": archive(M=TWICE, q=MINUS),
    "p.npy": npy(np.column_stack((TWICE, MINUS))),
    "p.mat": mat(M=TWICE, q=MINUS[:, None]),
    "M.mtx.gz": gzip.compress(MATRIX_MARKET),
}
DATES = np.array(["2021-01-01", "2021-01-02"], dtype="datetime64[D]")
FOREIGN = {
    "p.npz": [
        zip_of({"M.npy": pickle.dumps(TWICE), "q.npy": npy(MINUS)}),
        WHOLE["p.npz"].replace(b"(2, 2)", b"(2, x)"),
        archive(M=TWICE, q=DATES),
        archive(M=np.ones((2, 2, 2)), q=MINUS),
        archive(M=TWICE, q=np.float64(1)),
    ],
    "p.npy": [
        WHOLE["p.npy"] + b"more",
        WHOLE["p.npy"].replace(b"False", b"Felse"),
        WHOLE["p.npy"].replace(b"<f8", b"<q9"),
        saved(np.array(["a", "b"])),
        npy(np.zeros((0, 0))),
        saved(np.zeros(2, dtype=[("M", float), ("q", float)])),
    ],
    "p.mat": [
        WHOLE["p.mat"][:128] + b"\0" * 64,
        b"random bytes of no format at all",
        mat(M=TWICE, q="text"),
        mat(M={"a": 1}, q=MINUS),
        mat(M=TWICE, q=TWICE),
        mat(M=np.array(["a", 1.0], dtype=object), q=MINUS),
        mat(M=np.zeros((0, 0)), q=MINUS),
    ],
    "M.mtx.gz": [
        WHOLE["M.mtx.gz"][:-8] + b"\0" * 8,
        WHOLE["M.mtx.gz"].replace(b"\x08", b"\x07", 1),
        gzip.compress(MATRIX_MARKET[:-3]),
    ],
}
for name, content in WHOLE.items():
    ends = [1, *range(9, len(content), len(content) // 4), -8, -1]
    FOREIGN[name] += [content[:end] for end in ends]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        pytest.param(name, content, id=f"{name}-{i}")
        for name, own in FOREIGN.items()
        for i, content in enumerate(own)
    ],
)
def test_a_malformed_file_is_refused_by_its_name_in_words_of_this_program(
    name, content, refused
):
    beside_M = " q.csv" if name == "M.mtx.gz" else ""
    line = refused(f"solve {name}{beside_M}", {name: content, "q.csv": "-1\n-1\n"})
    assert line.startswith(name)


def test_a_missing_file_in_a_folder_that_cannot_be_listed_is_refused(
    lcp, tmp_path, monkeypatch
):
    def refuse(folder):
        raise PermissionError(13, os.strerror(13), str(folder))

    monkeypatch.setattr(Path, "iterdir", refuse)
    outcome = lcp(f"solve {tmp_path / 'good.json'}")
    assert NO_SUCH_FILE in outcome.err
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err.count("\n") == 1


def members(method=zipfile.ZIP_STORED, **arrays):
    return zip_of({f"{name}.npy": held for name, held in arrays.items()}, method)


def spoiled(content, found, other):
    assert found in content
    return content.replace(found, other, 1)


ARCHIVES = {
    "header-without-end": members(M=spoiled(npy(EYE), b"}", b"("), q=npy(ONES)),
    "header-with-open-text": members(
        M=spoiled(npy(EYE), b"'descr'", b"'''escr"), q=npy(ONES)
    ),
    "header-of-zeros": members(
        M=npy(np.zeros(60)), q=spoiled(npy(np.zeros(300)), b"{'descr'", b"\0" * 8)
    ),
    "compression-broken": spoiled(
        members(zipfile.ZIP_LZMA, M=npy(np.arange(400.0).reshape(20, 20))),
        b"\x5d\0\0",
        b"\xff\xff\xff",
    ),
}


@pytest.mark.parametrize("content", ARCHIVES.values(), ids=ARCHIVES)
@pytest.mark.parametrize(
    "read",
    [reading.read, lambda path: beside.read_candidates(path, 2, ("", ""))],
    ids=["problem", "answer"],
)
def test_broken_archive_is_told_in_one_short_line(read, content, tmp_path):
    file = tmp_path / "p.npz"
    file.write_bytes(content)
    with pytest.raises(ProblemError) as fault:
        read(str(file))
    message = str(fault.value).removeprefix(str(file))
    assert "numpy.savez" in message
    assert len(message) < 250
    assert "\n" not in message


def test_array_that_python_2_has_written_is_read_without_a_warning(tmp_path):
    file = tmp_path / "p.npz"
    file.write_bytes(
        members(M=spoiled(npy(EYE), b"(2, 2), }  ", b"(2L, 2L), }"), q=npy(ONES))
    )
    assert reading.read(str(file)).M.tolist() == [[1, 0], [0, 1]]


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        (
            "p.mtx",
            f"%%MatrixMarket matrix array real general\n1 1\n{'9' * 400_000}x\n",
            "line 3: is '999",
        ),
        (
            "p.json",
            "{" + ",".join(f'"{k}": 0' for k in range(30_000)) + ', "29999": 0}',
            "29999: occurs twice",
        ),
    ],
    ids=["digits", "keys"],
)
def test_long_file_is_refused_in_a_time_in_proportion(name, content, fault, tmp_path):
    """In hours if the time grew with the square of the length."""
    file = tmp_path / name
    file.write_text(content)
    with pytest.raises(ProblemError, match=fault):
        reading.read(str(file))
