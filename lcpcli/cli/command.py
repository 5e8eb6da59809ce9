"""The command group lcp, and the base classes of its commands: help in sections, hints
for unknown words."""

from __future__ import annotations

import re
from collections import Counter, UserDict
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from itertools import pairwise
from textwrap import indent, wrap
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from lcpcli.errors import (
    EXITS,
    GONE,
    HAS_GONE,
    IS_MISSING,
    LEAVE_ONE_OUT,
    Exit,
    OptionError,
    likely,
    nearest,
    quoted,
    unknown,
)
from lcpcli.options import NUMBA, wants_kernels
from lcpcli.version import VERSION

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

# Environment variable that holds a shell's request, such as `bash_complete`
VARIABLE = "_LCP_COMPLETE"
# Options of other tools whose names resemble other ones here.
ELSEWHERE = {"maxiter": "max-iterations"}
NO_OPTION = "is not an option of {}"
WHOLE = "lcpcli.whole"  # in the context: help shows all options
HELP = "Help"  # the heading of options that click declares
WIDEST = 100  # columns of help on a wide terminal, as longer lines are hard to read
# The beginning of a negative number, which is no option.
NEGATIVE = re.compile(r"-[.\d]")
SIGNALS = 128  # exit codes above it follow a signal
# Columns, a quarter of a line; the meaning of a longer term begins on the next line.
WIDEST_TERM = 26
Rows = Sequence[tuple[str, str]]


class Command(click.Command):
    """A command whose help has sections.

    examples : command lines that run anywhere.
    common : the options that its help shows without --all, so that it fits on a screen;
        by default all, and the lists.
    lists : under each heading the names that are accepted, with their meanings.
    exits : the meanings of the exit codes, by default those of solving.
    request : makes the argument of the command from the values of its options, by name;
        None for a command that is called with these values.
    """

    def __init__(
        self,
        *positional: Any,
        examples: Sequence[str],
        common: Sequence[str] = (),
        lists: Mapping[str, Mapping[str, str]] | None = None,
        exits: Mapping[Exit, str] = EXITS,
        request: Callable[..., Any] | None = None,
        **attributes: Any,
    ) -> None:
        super().__init__(*positional, **attributes)
        self.examples = examples
        self.common = common
        self.lists = lists or {}
        self.request = request
        meanings = {Exit.BAD_INPUT: Exit.BAD_INPUT.meaning, **exits}
        self.exits = {code: meanings[code] for code in Exit if code in meanings}

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        typed_args, hint = list(args), f"see {ctx.command_path} --help"
        if ctx.allow_interspersed_args:  # else the words belong to another command
            if "--all" in args and not {"-h", "--help"}.isdisjoint(args):
                ctx.meta[WHOLE], args = True, ["--help"]
            self._refuse_single_dash(ctx, args)
            # With a blank, a number is no option, until `_as_typed` takes it away.
            end_of_options = args.index("--") if "--" in args else len(args)
            args = [
                " " * bool(at < end_of_options and NEGATIVE.match(argument)) + argument
                for at, argument in enumerate(args)
            ]
        try:
            self._refuse_repeated(ctx, args)
            return super().parse_args(ctx, args)
        except click.MissingParameter as error:
            name, _, _ = getattr(error.param, "human_readable_name", "").partition(" ")
            raise OptionError(name, IS_MISSING, hint) from None
        except click.BadOptionUsage as error:
            reason = error.message.removeprefix(f"Option {error.option_name!r} ")
            raise OptionError(error.option_name, reason.rstrip("."), hint) from None
        except click.NoSuchOption as error:
            # For -tol, click's parser reports only -t.
            begun = (
                argument
                for argument in typed_args
                if argument.startswith(error.option_name)
            )
            name = next(begun, error.option_name).partition("=")[0]
            if instead := GONE.get(name):
                raise OptionError(name, HAS_GONE, instead) from None
            suggested = self._in_variant(ctx, name, typed_args) or self._suggest(
                ctx, name
            )
            reason = NO_OPTION.format(ctx.command_path)
            raise OptionError(name, reason, suggested or hint) from None

    def _refuse_single_dash(self, ctx: click.Context, arguments: Sequence[str]) -> None:
        """Refuse -max-iterations, which would be read as -m ax-iterations."""
        options = {flag for param in self.get_params(ctx) for flag in param.opts}
        for argument in arguments:
            is_short = argument.startswith("-") and not argument.startswith("--")
            if is_short and argument not in options and f"-{argument}" in options:
                reason = NO_OPTION.format(ctx.command_path)
                raise OptionError(argument, reason, f"did you mean -{argument}?")

    def _refuse_repeated(self, ctx: click.Context, arguments: Sequence[str]) -> None:
        _, _, order = self.make_parser(ctx).parse_args(list(arguments))
        for param, times in Counter(order).items():
            if times == 1 or not isinstance(param, click.Option) or param.multiple:
                continue
            # A flag that says yes may be repeated.
            if not param.is_flag or param.secondary_opts:
                name = param.opts[-1]
                reason = f"occurs {times} times"
                raise OptionError(name, reason, "give it once")
        # Of several options for one value only the last would have an effect.
        named: dict[str | None, str] = {}
        for param in order:
            name = param.opts[-1]
            earlier = named.setdefault(param.name, name)
            reason = f"has no effect with {name}"
            if earlier != name:
                raise OptionError(earlier, reason, LEAVE_ONE_OUT)

    def invoke(self, ctx: click.Context) -> Any:
        option_values = {name: _as_typed(value) for name, value in ctx.params.items()}
        ctx.params = option_values
        if self.request is not None:
            ctx.params = {"request": self.request(**option_values)}
        return super().invoke(ctx)

    def _in_variant(
        self, ctx: click.Context, name: str, arguments: Sequence[str]
    ) -> str:
        """Return the hint for an option of a method, which is no option of a command
        that takes methods; "" for another one."""
        option_name, params = name.lstrip("-").replace("_", "-"), self.get_params(ctx)
        takes_methods = {"method", "methods"} & {param.name for param in params}
        if not takes_methods or any(
            f"--{option_name}" in param.opts for param in params
        ):
            return ""
        from lcpcli.methods.registry import in_variant

        followed = dict(pairwise([*arguments, ""]))
        methods = followed.get("-m") or followed.get("--method", "")
        values = dict(
            option_name.split("=", 1) for option_name in arguments if "=" in option_name
        )
        value = values.get(name, followed.get(name, ""))
        value = "" if value.startswith("--") else value
        variant = in_variant(option_name, value, methods)
        return f"write --method {variant}" if variant else ""

    def _suggest(self, ctx: click.Context, unknown_option: str) -> str:
        """Return the hint for an unknown option, which may be a value of another
        option, or a misspelling."""
        option_name = unknown_option.lstrip("-").casefold().replace("_", "-")
        if option_name == "q":
            return "name the file of q after that of M"
        option_name = ELSEWHERE.get(option_name, option_name)
        options = [
            param for param in self.get_params(ctx) if isinstance(param, click.Option)
        ]
        for param in options:
            if (
                isinstance(param.type, click.Choice)
                and option_name in param.type.choices
            ):
                return f"did you mean {param.opts[-1]} {option_name}?"
        flags = [
            flag for param in options for flag in (*param.opts, *param.secondary_opts)
        ]
        valid_names = [flag[2:] for flag in flags if flag[:2] == "--"]
        meant = (
            nearest(option_name, tuple(valid_names)) if len(option_name) > 1 else None
        )
        return f"did you mean --{meant}?" if meant else ""

    def format_options(
        self, ctx: click.Context, formatter: click.HelpFormatter
    ) -> None:
        with formatter.section("Examples"):
            available_width = formatter.width - formatter.current_indent
            indentation = " " * formatter.current_indent
            # A line that is too wide continues after a backslash.
            for line in self.examples:
                parts = [line]
                if len(line) > available_width:
                    parts = wrap(
                        line,
                        available_width - 2,
                        subsequent_indent="  ",
                        break_on_hyphens=False,
                    )
                formatter.write(indent(" \\\n".join(parts), indentation) + "\n")
        tabulate(formatter, self.tables(ctx))

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        if not self.common or WHOLE in ctx.meta:
            super().format_epilog(ctx, formatter)

    def tables(self, ctx: click.Context) -> dict[str, Rows]:
        """Return the tables that help shows after the examples: under each heading,
        terms with their meanings."""
        tables: dict[str, list[tuple[str, str]]] = {}
        params = self.get_params(ctx)
        is_brief = bool(self.common) and WHOLE not in ctx.meta
        for param in params:
            heading = getattr(param, "heading", HELP)
            word_meanings = getattr(param, "words", {})
            if (
                is_brief
                and not word_meanings
                and heading != HELP
                and param.opts[-1] not in self.common
            ):
                continue
            rows = tables.setdefault(heading, [])
            if word_meanings:
                rows.extend(word_meanings.items())
            elif record := param.get_help_record(ctx):
                rows.append(
                    (record[0], _brief(record[1]))
                    if is_brief and param.name != "help"
                    else record
                )
        lists = {
            heading: list(meanings.items())
            for heading, meanings in self.lists.items()
            if not is_brief
        }
        codes = {
            code: meaning
            for code, meaning in self.exits.items()
            if not is_brief or code < SIGNALS
        }
        if codes:
            lists["Exit codes"] = [
                (f"{code:d}", meaning) for code, meaning in codes.items()
            ]
        helps = tables.pop(HELP)
        if is_brief:
            number = sum(isinstance(param, click.Option) for param in params)
            more = (
                f"Show this message. lcp help {ctx.info_name} --all shows all "
                f"{number} options"
            )
            more += (
                ", and lcp help METHOD a method and its options."
                if "--method" in self.common
                else "."
            )
            helps = [(helps[0][0], more)]
        return {**tables, HELP: helps, **lists}


def _as_typed(value: Any) -> Any:
    """Return the value of a parameter without the blank that `Command.parse_args` has
    put before a negative number, or a name of a file that begins like one."""
    if isinstance(value, tuple) and type(value) is tuple:
        return tuple(map(_as_typed, value))
    is_marked = isinstance(value, str) and NEGATIVE.match(value[1:])
    return value[1:] if is_marked and value.startswith(" ") else value


def _brief(meaning: str) -> str:
    """Return the first clause of what an option means, with its default if that is a
    single word."""
    text, _, bracket = meaning.partition("  [")
    default = re.search(r"default:? \S+\]$", bracket)
    return re.split(r"[.;] ", text)[0].rstrip(".") + (
        f".  [{default[0]}" if default else "."
    )


command = partial(click.command, cls=Command)


class Candidates(NamedTuple):
    """The completions of a word that shells offer: these words with their meanings,
    names of files if `files`, and those of shipped problems if `problems`."""

    words: Mapping[str, str] = {}
    files: bool = False
    problems: bool = False

    def __call__(
        self, _: click.Context, __: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        completions = dict(self.words)
        if self.problems:
            from lcpcli.files.contents import shipped_problems

            completions |= dict.fromkeys(shipped_problems(), "A shipped problem.")
        items = [
            CompletionItem(completion, help=text)
            for completion, text in completions.items()
            if completion.startswith(incomplete)
        ]
        # Bash forgets words before files.
        files = [CompletionItem(incomplete, type="file")] if self.files else []
        return files + items


class Choice(click.Choice):  # type: ignore[type-arg,unused-ignore]
    """One of several words with meanings, or what `parse` makes of it; the error for an
    unknown word has a likely one, else all or `otherwise`."""

    def __init__(
        self,
        meanings: Mapping[str, str],
        otherwise: str = "",
        parse: Callable[[str], Any] | None = None,
    ) -> None:
        super().__init__(list(meanings))
        self.meanings = meanings
        self.otherwise = otherwise
        self.parse = parse

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        if self.parse is not None:
            return self.parse(value) if isinstance(value, str) else value
        if value not in self.meanings:
            self.fail(
                f"{quoted(value)} is unknown; "
                f"{likely(value, self.meanings, self.otherwise)}",
                param,
                ctx,
            )
        return value

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        return Candidates(self.meanings)(ctx, param, incomplete)


def tabulate(formatter: click.HelpFormatter, tables: Mapping[str, Rows]) -> None:
    """Write each table under its heading, all meanings in one column."""
    terms = [len(term) for rows in tables.values() for term, _ in rows]
    widest = max((width for width in terms if width <= WIDEST_TERM), default=0)
    for heading, rows in tables.items():
        with formatter.section(heading):
            formatter.write_dl(
                [(f"{term:{widest}}", meaning) for term, meaning in rows], widest
            )


class Commands(UserDict[str, Any]):
    """Commands by name, each imported on demand. The values are the names of the
    commands' modules in lcpcli.cli."""

    def __getitem__(self, name: str) -> Any:
        return getattr(
            import_module(f"lcpcli.cli.{self.data[name]}"), name.replace("-", "_")
        )


class Group(Command, click.Group):
    """A group of commands; the error for an unknown command suggests the most likely
    one."""

    def tables(self, ctx: click.Context) -> dict[str, Rows]:
        return {"Commands": list(self.meanings().items()), **super().tables(ctx)}

    def meanings(self) -> dict[str, str]:
        return {
            name: command.get_short_help_str(WIDEST)
            for name, command in self.commands.items()
        }

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in self.commands and not ctx.resilient_parsing:
            from lcpcli.files import contents
            from lcpcli.files.formats import PROBLEMS

            is_problem = args[0] in ("-", *contents.shipped_problems()) or args[
                0
            ].casefold().endswith(PROBLEMS)
            hint = likely(args[0], self.commands)
            if is_problem:
                hint = f"did you mean lcp solve {args[0]}?"
            raise OptionError("COMMAND", unknown(args[0]), hint)
        return super().resolve_command(ctx, args)


def _show_version(context: click.Context, _: click.Parameter, is_asked: bool) -> None:
    """Print the version, with that of numba if all runs use the compiled kernels."""
    if not is_asked or context.resilient_parsing:
        return
    kernels = ""
    if wants_kernels():
        from importlib.metadata import version

        kernels = f", with kernels compiled by numba {version(NUMBA)}"
    click.echo(f"lcp, version {VERSION}{kernels}")
    context.exit()


@click.group(
    cls=Group,
    context_settings={
        "help_option_names": ["-h", "--help"],
        "max_content_width": WIDEST,
    },
    invoke_without_command=True,
    examples=(
        "lcp solve paper-example-1",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp compare",
        "lcp solve --help",
        "lcp help methods",
    ),
    exits={**EXITS, Exit.CLOSED_PIPE: Exit.CLOSED_PIPE.meaning},
)
@click.option(
    "-V",
    "-v",
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and exit.",
)
@click.pass_context
def lcp(context: click.Context) -> None:
    """Solve linear complementarity problems: find z >= 0 with w = Mz + q >= 0 and z'w =
    0; and mixed ones."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


lcp.commands = Commands(  # in the order of the help
    {
        "solve": "solve",
        "compare": "solve",
        "path": "path",
        "bench": "bench",
        "check": "check",
        "inspect": "check",
        "why": "why",
        "kernels": "help",
        "make": "make",
        "convert": "make",
        "completion": "help",
        "help": "help",
    }
)
