"""The command lcp: start-up, and exit with one of the codes. Errors become one line on
standard error and exit code 2.

Little more than the standard library is imported before the handler for Ctrl-C is
installed.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import io
import os
import re
import signal
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from lcpcli.errors import Exit, visible

if TYPE_CHECKING:
    import click

    from lcpcli.errors import LCPError
    from lcpcli.solving.result import Result, Status

# Objects before the garbage collector runs, more than the modules make: a solve leaves
# no cycles to be collected.
MAX_UNCOLLECTED = 100_000

# The exit code of several problems is the first of these that one of them has.
BY_PRECEDENCE = (
    Exit.INTERRUPTED,
    Exit.BAD_INPUT,
    Exit.NOT_SOLVED,
    Exit.NO_SOLUTION,
    Exit.SOLVED,
)

OUTPUT = "standard output"
NO_THREAD = "can't start new thread"  # the message of a RuntimeError

# -f, -o or a longer name, alone or with its value, perhaps behind -q.
OUTPUT_OPTION = re.compile(r"-q?([fo])(.*)|--(format|output)(?:=(.*))?", re.DOTALL)
QUIET = re.compile(r"--quiet|-q.*", re.DOTALL)
# A word of a message that may be a location of any length.
WORD = re.compile(r"[^\s()]+")

# Threads that may wait for input forever; the process does not wait for them.
reading: list[threading.Thread] = []


def of_end(
    solved: bool, has_no_solution: bool = False, interrupted: bool = False
) -> Exit:
    if interrupted:
        return Exit.INTERRUPTED
    if has_no_solution:
        return Exit.NO_SOLUTION
    return Exit.SOLVED if solved else Exit.NOT_SOLVED


def of_status(status: Status) -> Exit:
    return of_end(
        status.name == "SOLVED", status.has_no_solution, status.name == "INTERRUPTED"
    )


def of_result(result: Result) -> Exit:
    """Return the exit code of a result that Ctrl-C has not cut short: of its status,
    unless a requested proof fails."""
    unproved = result.exact is not None and result.exact.status is None
    if unproved or result.status.name == "INTERRUPTED":
        return Exit.NOT_SOLVED
    return of_status(result.status)


def of_several(codes: Iterable[Exit]) -> Exit:
    """Return the exit code of a run of several problems from the exit codes of the
    problems."""
    return min(codes, key=BY_PRECEDENCE.index)


def main() -> None:
    gc.set_threshold(MAX_UNCOLLECTED)
    _occupy()
    code: int = Exit.INTERRUPTED
    received = list[int]()
    with contextlib.suppress(KeyboardInterrupt):
        try:
            from lcpcli import interrupts

            # Ctrl-C terminates the process silently while there is nothing to report or
            # to clean up.
            with interrupts.handling(
                signal.SIGINT,
                lambda *_: os._exit(Exit.INTERRUPTED),
                signal.default_int_handler,
            ):
                from lcpcli.cli.command import lcp as lcp
        except (ImportError, MemoryError) as error:
            sys.exit(_complain_of_loading(error))
        if sys.stdout is None:  # closed by the caller
            unread = open(1, "w")  # noqa: SIM115
            sys.stdout = sys.__stdout__ = unread  # type: ignore[misc]
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")
        # Figures need no window, and matplotlib would not load with a wrong one.
        os.environ.pop("MPLBACKEND", None)
        sys.unraisablehook = _interrupt_again
        received = interrupts.received
        with _output_alone(), interrupts.terminable():
            code = _run()
    is_terminated = code == Exit.INTERRUPTED and signal.SIGTERM in received
    leave(Exit.TERMINATED if is_terminated else code)


def _occupy() -> None:
    """Open the null device under the number of each standard stream that the caller has
    closed: the next file would get it, as would then what compiled code prints. To
    read from the input, or write to the output, stays an error."""
    for number, mode in enumerate((os.O_WRONLY, os.O_RDONLY, os.O_RDWR)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, mode)  # it gets the smallest number that is free


class _Output(io.FileIO):
    """Standard output, whose errors have its name."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            error.filename = OUTPUT
            raise


@contextlib.contextmanager
def _output_alone() -> Iterator[None]:
    """Open a context in which compiled code cannot print to standard output, as HiGHS
    sometimes does whatever its options are: sys.stdout writes to a copy of file
    descriptor 1, which itself is the null device."""
    from lcpcli import interrupts

    usual, original = sys.stdout, sys.__stdout__
    with interrupts.silent() as copy:
        if original is not None and original is usual and original.fileno() == 1:
            stream = io.TextIOWrapper(
                io.BufferedWriter(
                    _Output(1 if copy is None else copy, "w", closefd=False)
                ),
                original.encoding,
                original.errors,
                line_buffering=original.line_buffering,
            )
            sys.stdout = sys.__stdout__ = stream  # type: ignore[misc]
        try:
            yield
        finally:
            with contextlib.suppress(OSError, ValueError):
                sys.stdout.flush()
            sys.stdout, sys.__stdout__ = usual, original  # type: ignore[misc]


def leave(code: int) -> NoReturn:
    """Terminate the process with this exit code: at once, as the interpreter's shutdown
    takes longer than many a solve once numpy is loaded, but after the functions that
    are registered for the exit. The interpreter performs an exit that has to be
    orderly: where a thread is to be awaited, or a profiler or a debugger watches. While
    a thread of `abandoned` or `reading` is alive, which may never end, even those
    functions are left out."""
    from lcpcli.interrupts import abandoned

    if not any(map(threading.Thread.is_alive, [*abandoned, *reading])):
        if threading.active_count() > 1 or sys.getprofile() or sys.gettrace():
            sys.exit(code)
        atexit._run_exitfuncs()  # as children of multiprocessing do
    for stream in (sys.stdout, sys.stderr):
        # AttributeError: closed by the caller.
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)


def _interrupt_again(lost: sys.UnraisableHookArgs) -> None:
    """Repeat Ctrl-C that came in a callback of the interpreter, such as that of a lock
    of imports, and was ignored."""
    if isinstance(lost.exc_value, KeyboardInterrupt):
        from lcpcli.interrupts import repeat

        repeat(signal.SIGINT)
    else:
        sys.__unraisablehook__(lost)


def _run() -> int:
    import click

    from lcpcli.cli.command import VARIABLE, lcp
    from lcpcli.errors import LCPError, OptionError, ResourceError
    from lcpcli.interrupts import hides_interrupt
    from lcpcli.model.formulations import WORDS, module_of

    output = sys.stdout
    try:
        for keyword in WORDS.keys() & {*sys.argv[2:]}:  # that the formulation has
            row = WORDS[keyword]
            others = [argument for argument in sys.argv[2:] if argument != keyword]
            code = module_of(row, row.words[keyword], keyword).run(sys.argv[1], others)
            return int(code)
        code = lcp.main(prog_name="lcp", standalone_mode=False, complete_var=VARIABLE)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.exceptions.Exit as ending:
        return ending.exit_code
    except click.UsageError as error:
        return of_usage(error)
    except click.ClickException as error:
        return refused(OptionError("", one_line(error.format_message())))
    except LCPError as error:
        return refused(error)
    except (click.Abort, KeyboardInterrupt):
        return Exit.INTERRUPTED
    except MemoryError:
        return refused(ResourceError("", "not enough memory for this problem"))
    except (ImportError, SystemError, RuntimeError) as error:
        if hides_interrupt(error):
            return Exit.INTERRUPTED
        if str(error) == NO_THREAD:
            return refused(ResourceError("", "the system refused a further thread"))
        if isinstance(error, RuntimeError):
            raise
        return _complain_of_loading(error)
    except SystemExit:
        if sys.stdout is output:
            raise
        return Exit.CLOSED_PIPE  # detected by click, which then wraps the stream
    except OSError as error:  # errors of files have become an LCPError
        return _complain_of_system(error)


def _complain_of_system(error: OSError) -> int:
    """Report what the system has refused. Only an error with the name of standard
    output is one of it."""
    from lcpcli.errors import File, OptionError, ResourceError
    from lcpcli.files.contents import GONE, is_folder_gone

    if error.filename == OUTPUT:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return say(
            f"lcp: {OUTPUT} cannot be written ({error.strerror}); write to a file "
            "with -o"
        )
    if error.filename is not None:
        return refused(OptionError(File(error.filename), str(error.strerror)))
    if is_folder_gone():
        return refused(OptionError("", GONE))
    reason = f"the system refused: {error.strerror or error}"
    return refused(ResourceError("", reason))


def as_written(error: LCPError) -> LCPError:
    """Return an error in the words of the command line: an option has its flag."""
    from lcpcli.errors import OptionError, ParameterError

    if not isinstance(error, ParameterError):
        return error
    from lcpcli.report.wording import flag

    return OptionError(flag(error.where), error.fault, error.hint)


def say(message: str, code: int = Exit.BAD_INPUT) -> int:
    """Print one line on standard error, if possible, and return the exit code."""
    if sys.stderr is not None:  # closed by the caller
        try:
            print(visible(message), file=sys.stderr, flush=True)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())
    return code


def refused(error: LCPError) -> int:
    """Say why a run is refused, or cannot continue, and return the exit code."""
    shown = as_written(error)
    # The output is closed, or there is no memory left.
    with contextlib.suppress(OSError, ValueError, MemoryError, ImportError):
        if asks_for_json(sys.argv[1:]):
            _print_record(shown)
    return say(f"lcp: {shown}", shown.code)


def _print_record(error: LCPError) -> None:
    from lcpcli.files.contents import Source
    from lcpcli.report import result_formats as formats

    source = Source(error.file)
    status = formats.BAD_INPUT if error.code == Exit.BAD_INPUT else formats.LOST
    field = formats.field_in(error, source)
    record = formats.record_without_result(source, status, str(error), field)
    print(formats.line(record), end="", flush=True)


def of_usage(error: click.UsageError) -> int:
    """Refuse a command line that click cannot read."""
    from lcpcli.errors import OptionError

    message = one_line(error.message)
    param = getattr(error, "param", None)
    if param is None:
        where = error.ctx.command_path if error.ctx else "lcp"
        command = where.removeprefix("lcp ")
        return refused(OptionError(command, message, f"see {where} --help"))
    is_option = param.param_type_name == "option"
    name = param.opts[-1] if is_option else param.human_readable_name.strip("[]")
    return refused(OptionError(name, message))


def asks_for_json(arguments: Sequence[str]) -> bool:
    """Return whether a command line requests records in JSON, by -f or by the suffix of
    -o, and not for silence, whatever else is wrong with it."""
    from lcpcli.cli.command import lcp
    from lcpcli.files.formats import LINES

    n_options = arguments.index("--") if "--" in arguments else len(arguments)
    options, values = arguments[:n_options], dict[str, str]()
    for argument, following in zip(options, [*options[1:], ""], strict=True):
        if match := OUTPUT_OPTION.fullmatch(argument):
            name = match[1] or match[3][0]
            values[name] = match[2] or match[4] or following
    if any(map(QUIET.fullmatch, options)):
        return False
    if "f" in values:
        return values["f"] == "json"
    if not options or options[0] not in lcp.commands:
        return False
    has_formats = any(param.name == "form" for param in lcp.commands[options[0]].params)
    name = values.get("o", "").casefold()
    return has_formats and name.endswith((".json", *LINES))


def _complain_of_loading(error: BaseException) -> int:
    """Report a library that fails to load, perhaps for lack of memory, by the root of
    its error, which it may wrap. NumPy does in a folder that has been removed, on
    Python 3.13."""
    from lcpcli.files.contents import GONE, is_folder_gone

    if is_folder_gone():
        return say(f"lcp: {GONE}")
    while error.__cause__ or error.__context__:
        error = error.__cause__ or error.__context__ or error
    reason = one_line(str(error) or type(error).__name__)
    return say(
        f"lcp: {reason}; out of memory, or is the installation broken?", Exit.NOT_SOLVED
    )


def one_line(message: str) -> str:
    from lcpcli.errors import shortened

    line = " ".join(message.split())
    line = WORD.sub(lambda word: shortened(word[0]), line)
    return (line[0].lower() + line[1:]).rstrip(".") if line else line
