"""The faults and the hints that several rows of the tables of refusals name, each once:
whoever words one of them in another way changes the module of the program that says it,
and this one. Braces stand in the place of values."""

FROM_0 = " (indices count from 0)"
FROM_1 = " (indices count from 1)"

# Faults: files and standard input.
NO_SUCH_FILE = "no such file"
DIRECTORY = "is a directory"
EMPTY = "is empty"
ENDS_TOO_EARLY = "ends too early"
NOT_UNZIPPED = "cannot be uncompressed, as it is cut off"
NOT_UTF_8 = "is not UTF-8 text"
READ_ONCE = "can be read only once"
NOT_NEEDED = "is not needed: {} contains M and q"
RESULT = "is a result, not a problem"
RESULT_AS_TABLE = "is a result of lcp as a table, which it does not read"
SPREADSHEET = "is a spreadsheet"
HOLDS_PROBLEM = "holds the problem"
INPUT_OF_RUN = "is an input of this run"
SAME_FILE = "goes to the same file as {}"
ONLY_READ = "is of a format that is only read"
NO_FORMAT = "the suffix {} is not a format"
NO_PICTURE = "{} has no known suffix of a picture"
CANNOT_BE_WRITTEN = "cannot be written ({})"
CANNOT_HOLD_BOUNDS = "cannot hold the bounds of z"
NO_LOG = "is not a log of results (line 1)"
NO_RUNS = "has neither a bench nor results"
NO_STATES = "has no basis"

# Faults: words, keys and options.
MISSING = "is missing"
GIVEN_TWICE = "occurs 2 times"
SECOND_TIME = "has {} a second time"
SECOND_ENTRY = "gives {} a second entry in {}"
NO_KEY = "is not a key of {}"
UNKNOWN = "{} is unknown"
NO_UNKNOWN = "{} is not the name of an unknown"
NO_OPTION = "is not an option of {}"
NO_PARAMETER = "{} is not a parameter of {}"
NO_VALUE = "{} has no value"
NO_VALUE_OF = "{} is not a value of {}"
LACKS_VALUE = "{} lacks a value"
NEEDS_ARGUMENT = "requires an argument"
NAMES = "names {}"
HEADING = "has the heading {}"

# Faults: values.
IS = "is {}"
OUT_OF_RANGE = "{} is out of range"
IN_PLACE_OF = "has {} instead of {}"
NO_NUMBER = "is {}, not a number"
HAS_NO_NUMBER = "has {}, not a number"
HAS_NO_FRACTION = "has {}, not a fraction"
HAS_NOT_FINITE = "has {}, which is not finite"
HAS_NUMBER = "has the number {}"
NOT_FINITE = "is not a finite number in double precision"
NOT_TYPED = "{} is neither a file nor numbers"
DECIMAL_COMMA = "is {} in a file with decimal commas"
TWO_COLUMNS = "has two columns, and M has decimal commas"
ABOVE = "is {}, above {} = {}"
INFINITE_AS = "is {}, as it is {} and infinity begins at {}"
NO_SUCH_BOUND = "is {}, but there is no such bound"
UPPER_BELOW_LOWER = "gives {} the upper bound {}, below its lower bound {}"
BOUND_OF_1E20 = "has a bound of 1e20 or more, which means no bound, where one is needed"
UNSYMMETRIC = "is {0} and {1}[1][0] is {2}, so that {1} is not symmetric"
NO_ARRAY = "is of type {}, and gives no array"
OF_OTHER_TYPE = "contains {} values"
LINEAR_OPERATOR = "is of type MatrixLinearOperator, a linear operator"
RETURNS_NOTHING = "returns nothing"
LABEL_IN_PLACE = "has the label {} instead of {}"

# Faults: shapes.
ENTRIES = "has {} for {}"
ENTRIES_WHERE = "has {} where {} has {}"
ENTRY_OUTSIDE = "has the entry {} and is {}"
ENTRY_AGAIN = "has the entry {} again"
SHAPE = "is {} x {}"
SHAPE_BESIDE = "is {} but {} has {}"
SHAPE_OF_GAME = "is {} but A is {}"
HAS_SHAPE = "has shape {}"
DIMENSIONS = "has {}"
ROWS_OF = "has {} rows of {} columns"
ROWS = "has {} rows and {} columns"
HEADLESS = "has {} rows and {} columns without a header"
BEYOND_MEMORY = "is {}, {} GB, more than this machine's memory"
MOSTLY_ABSENT = "is declared as {} with 1 entry"
NO_Q = "contains M, {}, but no q"
HEADER_ALONE = "contains a header and no numbers"
NO_COLUMN_Z = "has no column headed z"
NO_Z = "is an object without z"
INCONSISTENT = (
    "has inconsistent parts: {} (integers but for data) and shape, of two numbers"
)
NO_ARRAY_OF_NUMBERS = "is not an array of numbers or texts, or is damaged"
MAY_BE_BOUNDS = "may hold bounds of z, which are called lower and upper"
DEPENDENT = "has {} unknowns that depend on each other"

# Faults: forms of files.
NOT_CSV = "is not CSV (its quotation marks do not match, or an entry is very long)"
NOT_JSON = "is not JSON from {} on"
COMMA_BEFORE = "has a comma before {}"
NOT_LP = "cannot be read ({})"
NO_TREE = "is not the beginning of a game tree"
NO_PLAYERS = "has no players after the title"
OTHER_NAMES = "has {} among the columns where the other table has {}"
OUTCOME_AGAIN = "gives outcome {} other payoffs than it has"
CHANCES = "the probabilities of chance event 1 are not at least 0 with the sum 1"
INTEGER_VARIABLE = "makes 'x' an integer variable"
COMPLEMENTS_NOTHING = "is an inequality that complements no variable"
NOT_SQUARE = "has {} equations for {} that no row complements"
NO_NUMBER_OF_VARIABLES = "is not a number of variables"
OTHER_ORIGIN = "does not yield this M and q"

# Faults: kinds of problems.
ONE_PROBLEM = "takes one problem"
MORE_PLAYERS = "is a game of more than two players"
PLAYERS = "is a game of {}"
FOR_M_AND_Q = "is for problems defined by M and q, but this is {}"
TWO_WAYS = "and {} belong to two ways to write a program"
CALLED = "is not a key of a program; it is called {} in the second of these ways"
NONLINEAR = "is a nonlinear model"
OTHER_M = "differs between the two problems"
TWO_VALUES = "is {} and {}"
FINITE_IN_ONE = "is finite in one problem and infinite in the other"

# Faults: requests.
NO_EFFECT = "has no effect with {}"
NO_EFFECT_ON = "has no effect on {}"
NO_START = "has no effect with {}, which uses no starting point"
OWN_METHOD = "has no effect with --all, which has a fixed method"
OWN_BOUNDS = "has no effect on {}, which have bounds themselves"
OWN_DATA = "has no effect on a NonlinearProblem, which has one already"
STATES_OF_LAST = (
    "has no effect with --sequence, where auto solves each problem from the basis of "
    "the last one"
)
HAS_ALL = "has no effect on {}, which has all"
BUT_IN_JSON = "has no effect on several problems but in JSON"
TWO_STARTS = "gives the starting point, and so does {}"
FILES_NOT = "means {} or {} files, not {}"
BEGINS_WITH_M = "begins with M of M.csv"
NO_PLANE = "draws LCPs with two unknowns, not one with n = {}"
ONE_PICTURE = "draws one problem only"

# Faults: derivatives.
SINGULAR = (
    "no derivative: the principal submatrix of the 2 variables between their bounds is "
    "singular, so that z is one of several solutions, or may jump"
)
NOT_REGULAR = (
    "no derivative, as the solution is not strongly regular, so that problems "
    "close to this one have several solutions close to z, or none"
)
DIFFERS_IN_J = (
    "no derivative: z is one of several solutions, which differ in J z, in row 0 of J"
)
NOT_SOLVED = (
    "no derivative, as the problem is not solved: has no solution: each complementary "
    "set is excluded in exact arithmetic; try lcpcli.why(problem)"
)

# Hints: leave, keep, correct.
LEAVE_IT_OUT = "leave it out"
LEAVE_ONE_OUT = "leave one out"
LEAVE_BOTH_OUT = "give it with {}, or leave both out"
OR_COMPARE = "leave it out, or use lcp compare"
GIVE_ALONE = (
    "leave it out; give a second problem a separate run, and for an index see lcp "
    "help formats"
)
KEEP_ONE = "keep one"
AGREE = "make them agree"
SQUARE = "make it square"
ALIKE_ROWS = "make all rows the same length"
IN_ORDER = "make every lower bound at most the upper one"
CORRECT_IT_THERE = "correct it there"
REMOVE_IT = "remove it"
CORRECT_ONE = "correct one of them"
CORRECT_THEM = "correct them"
OR_DECLARE = "correct it, or declare it there"
SCALE_PAYOFFS = "scale the payoffs"
SYMMETRIZE = (
    "for a minimum give ({0} + {0}') / 2; for a variational inequality call it H and "
    "{1} h, in Python from_avi: see lcp help equilibria"
)

# Hints: files.
CHECK_PATH = "check the path"
NAME_A_FILE = "name a file"
NAME_PROBLEM = "name the file of the problem"
OTHER_OUTPUT = "choose another file for the output"
OTHER_FOR_ONE = "choose another file for one"
OTHER_PLACE = "choose another location"
CREATE_FIRST = "create it first"
CUT_OFF = "is it cut off?"
FILE_CUT_OFF = "is the file cut off?"
COUNTS_RIGHT = "are the counts before it right?"
COMPRESS_AGAIN = "compress it again"
AS_UTF_8 = "save it as UTF-8"
AS_CSV = "save it as CSV"
AS_JSON_OR_CSV = "write it with -o to a .json or .csv file"
COMPLETE = "use .json, .npz or .mat, or .mps or .qps for a program"
WITH_BOUNDS = "use .json, .npz, .mat or .csv"
SUFFIXES = "use .txt, .json, .csv, .md, .tex, .html, .jsonl, .ndjson or give --format"
PICTURES = "use one of .png, .svg, .pdf"
A_LOG = "name a file that lcp solve -o FILE.jsonl has begun"
AS_A_FILE = "give the line of one as a separate file"
SOLVE_AGAIN = "solve the model again"

# Hints: numbers, texts and lists.
A_NUMBER = "give a number"
A_WHOLE_NUMBER = "give an integer"
WHOLE_FROM_TO = "give integers from {} to {}"
FROM_ONE = "give an integer from 1"
FINITE = "give a finite number"
NUMBERS = "give real numbers"
REAL = "give real numbers; lcp solves real problems only"
FRACTIONS = "give integers, as in 15/29"
A_FRACTION = "give an integer, a decimal or a fraction"
EXPONENTS = "keep exponents between -5000 and 5000"
A_SMALLER_ONE = "give a smaller one"
A_TEXT = "give a text"
A_LIST = "give a list of numbers"
A_LIST_OF_ROWS = "give a list of rows of numbers"
A_LIST_OF_NAMES = "give a list of names"
A_LIST_OR_RESULT = "give a list of numbers, or what lcp solve --format json prints"
A_FLAT_LIST = "give a flat list of numbers"
A_ROW = "give a row, a list of numbers"
ONE_OR_A_LIST = "give a number, or a list of numbers"
ONE_ROW = "give one row or one column"
ONE_ROW_OF_NUMBERS = "give one row or one column of numbers"
ONE_ROW_PER_LINE = "give one row per line below it"
EQUAL_COLUMNS = "give every line the same number of columns"
N_ROWS = "give n rows of n + 1 columns (M and q) or of n columns (M alone)"
OR_A_FIT = "; a fit of two tables, A and b, takes --lsq"
OR_HEADED = ", or name q, lower and upper in a header, if the last columns are these"
AN_INDEX = "; is the first column an index? leave the first cell of a header empty"
A_TABLE_WITH_Z = (
    "give one row or one column, a table with a column headed z, or a result in JSON"
)
ENTRY_ONCE = "give every entry once"
EACH_ONCE = "give each of {} to {} once"
SPARSE = "give it in sparse form"
ALL_PARTS = "give all, as scipy.sparse.save_npz writes them"
NPZ_AGAIN = "is it cut off? save it again with numpy.savez, and not as objects"
ENTRIES_OF_1000 = "give at least one of 1000 entries"
ADD_Q = "add q, or name the file of q after it"
GIVE_SHAPE = "give shape {}"
A_DENSE_ARRAY = "give a dense array, as by toarray()"
ITS_MATRIX = (
    "give its matrix, dense or sparse, since entries are needed; M @ numpy.eye(n) has "
    "those of M"
)
COLUMNS_OF_Q = "give one vector in each column, shape (n, k)"
ONE_BY_RESHAPE = "; for a single one, np.reshape(Q, (-1, 1))"
ONE_DECIMAL_MARK = "use one decimal mark, none for thousands"
Q_OR_TWO_NAMES = "add a header: q if the comma is a decimal mark, else two names"

# Hints: bounds, states and answers.
NO_BOUND_BELOW = "give a number, or -inf for no bound"
NO_BOUND_ABOVE = "give a number, or inf for no bound"
LOWER_BOUND_TOO = "give a lower bound too: LO, or MI for none"
GIVE_0 = "give 0"
RENAME = "rename it, or leave it out"
BOUNDS_AS = "give the bounds as lower and upper, each a list"
BOUNDS_IN_FILE = "give the bounds of its variables in the file"
FINITE_IN_BOTH = "give bounds that are finite in both or in neither"
TYPE_BOUNDS = "write -1,none,0.5 or name a file"
TYPE_NUMBERS = "write 1,-2,0.5 or name a file"
STATES = (
    "give a JSON list of lower, basic and upper, or a result of lcp solve in JSON or "
    "CSV"
)
A_STATE = "write lower, basic or upper"
OTHER_STATE = "write another status"
LIST_OF_STATES = "give a list of the words lower, basic, upper"
A_SOLUTION = "give a solution to check"
PROBABILITIES = "give probabilities, at least 0 and with the sum 1"
ALL_FILES_OF_CHECK = (
    "give the file of the problem, the file of q if it is separate, and the solution"
)
USE_NAMES = "use names of unknowns, or z1 to z{}"
WRITE_Z = "write z1 to z{}, or a name"
WRITE_A_SUM = (
    "write numbers and names with + and - between them, such as 2 z1 - 1/3 z2 + "
    '"a name with blanks"'
)

# Hints: words and options.
DID_YOU_MEAN = "did you mean {}?"
IT_HAS = (
    "it has {}, x0, z0, basis, tol, max_iterations, time_limit, threads, "
    "trace, callback, interrupts, compiled, gap, scale, finish"
)
IT_MUST_BE = "it must be: {}"
WITH_RHO = "with rho = {} it must be: rho < sigma < 1"
IT_BELONGS = "it belongs to {}"
SEE_HELP = "see lcp {} --help"
GIVE_ONCE = "give it once"
GIVE_JSON = "give --format json"
WRITE_SWEEP = "write OPTION=VALUE,VALUE,..., as in p=1,10,100"
Q_BY_NAME = "name the file of q after that of M"
ALONE_IF_M_AND_Q = "if it holds M and q, name it alone"
JOSEPHY_NEWTON = "give josephy-newton"
HELP_MODELS = "see lcp help models for what takes it"

# Hints: programs, games and models.
WAYS_TO_WRITE_PROGRAMS = (
    "give min x'Qx/2 + c'x, row_lower <= Ax <= row_upper, lower <= x <= upper, or min "
    "x'Px/2 + q'x, Gx <= h, Ax = b, lb <= x <= ub, or min x'Px/2 + q'x, l <= Ax <= u"
)
ONE_VARIABLE = "give a program with at least one variable"
CONTINUOUS = "lcp solves {}continuous variables{}"
SECTIONS = (
    "the sections are ROWS, COLUMNS, RHS, RANGES, BOUNDS, QUADOBJ, QSECTION, QMATRIX, "
    "ENDATA; quadratic constraints and ordered sets are not read"
)
CORRECT_LP = (
    "correct it there; quadratic constraints and integer variables are not read"
)
KINDS_OF_ORIGIN = "use one of qp, game, contact, efg, avi, lsq, players, polymatrix"
MAKE_AGAIN = "make the problem again, or leave origin out"
NO_LCP = (
    "give payoffs by pairs of players (lcp help equilibria): the equilibria of other "
    "such games are not the solutions of an LCP"
)
TWO_PLAYERS = "give one of two: only its equilibria are the solutions of an LCP"
BEGIN_TREE = "begin the file with EFG 2 R"
WRITE_TREE = 'write EFG 2 R "title" { "one" "two" }'
CHANCES_SUM_TO_1 = "give fractions, such as 1/3, whose sum is 1"
SAME_NAMES = "give both the same names in the same order, or one of them none"
ADD_GAME = "if A.csv and B.csv are the payoffs of a game, add --game"
WITH_ITS_VARIABLE = (
    "lcp needs for each inequality the variable that complements it, as in 0 <= z "
    "complements F(z) >= 0"
)
SQUARE_SYSTEMS = (
    "lcp solves square systems: rows with a complementing variable, and as many "
    "equations as other variables"
)
A_VARIABLE_EACH = "give each row another variable"
WITH_OPERATORS = "write it with the operators of AMPL"
IN_ORDER_OF_UNKNOWNS = "put the labels in the order of the unknowns, or leave them out"
OF_ROWS = (
    "; each row of a program has one side in both, or two, or is an equation in both"
)
ONE_M = f"give two problems with one M{OF_ROWS}"
SAME_UNKNOWNS = f"give two problems with the same unknowns{OF_ROWS}"
UP_TO_500 = "all solutions are listed up to 500; lcp solve finds one"

SUFFIX = "use .json, .csv, .mtx, .npz, .npy, .mat, or .mps or .qps for a program"
WITHOUT_OBJECTIVE = "take {} out to find one solution"
NO_QUADRATIC_PROGRAM = "{} in {}, so that this is no quadratic program"
OTHER_PROGRAMS = (
    "lcp solves linear and quadratic programs; of others write the optimality "
    "conditions, as complementarity conditions"
)
NO_RECORD = "is not a record of a bench{}"
NAME_A_RECORD = "name a .json file written by lcp bench -o"

# Hints: calls.
BY_READING = "make it by Problem(M, q), or by read(path) from a file"
OTHER_SOLVER = "make another Solver for it"
X0_A_LIST = "give x0, a list of numbers"
REAL_ARRAY = "return an array of real numbers"
RETURN = "add a return statement"
WHERE_F_IS_DEFINED = "start where F is defined and finite"

# Ranges of options and parameters.
OF_P = "0 < p < infinity"
OF_RHO = "0 < rho < 1/2"
OF_SIGMA = "rho < sigma < 1"
OF_OMEGA = "0 < omega < infinity, or auto"
OF_TOL = "0 < tol < 1"
OF_SECONDS = "seconds > 0"
OF_SIZE = "size > 0"
OF_FRICTION = "0 <= friction <= 10"
WHOLE = "integer >= {}"
WHOLE_TO = "integer from {} to {}"
