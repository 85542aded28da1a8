"""The command line: verbs, common options, and exit code 2 with one line for whatever a user gets wrong."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import sys
from pathlib import Path

from backdrive_bayes.errors import BadInput, MissingExtra

# verb -> module of this package with HELP, add_arguments(parser) and run(args) -> exit code
VERBS = {
    "check": "check",
    "fit": "fit",
    "compare": "compare",
    "accept": "accept",
    "diagnose": "diagnose",
    "predict": "predict",
    "simulate": "simulate",
    "blind": "blind",
    "fleet": "fleet",
    "report": "report",
    "demo": "demo",
}
_DESCRIPTION = "Bayesian inference of a robot reducer's geometric error, stiffness and friction from torque-angle loops."


class _Usage(Exception):
    """A wrong command line; its text is the one line to show."""


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        raise _Usage(f"{message} (see '{self.prog} --help')")


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit code: 0 done, 2 bad input or usage, others as the verb says.

    Without ``argv`` it is the process's own command line, and Ctrl-C and SIGTERM end the process.
    """
    from backdrive_bayes.commands.stopping import stoppable

    with stoppable() if argv is None else contextlib.nullcontext():
        return _run(sys.argv[1:] if argv is None else list(argv))


def _run(argv: list[str]) -> int:
    from backdrive_bayes.commands.output import complain

    args = None
    try:
        args = _parser(argv).parse_args(argv)
        _refuse_nul(args)
        return args.run(args)
    except SystemExit as done:  # --help and --version
        return done.code if isinstance(done.code, int) else 0
    except (BadInput, MissingExtra, OSError, _Usage) as error:
        complain(error)
        return 2
    except MemoryError:
        complain("not enough memory for this input")
        return 2
    except RecursionError:
        complain("input nested too deeply")
        return 2
    except (ValueError, ArithmeticError, LookupError) as error:
        if not getattr(args, "force", False):
            raise
        complain(f"{_paths(args)}: expected data that can be fitted, found none even with --force ({error})")
        return 2
    except KeyboardInterrupt:
        complain("interrupted")
        return 130


def _refuse_nul(args) -> None:
    for name, value in vars(args).items():
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, Path | str) and "\0" in str(part):
                raise BadInput(f"option or argument {name}", "a name without NUL", repr(str(part))[:60])


def _paths(args) -> str:
    given = getattr(args, "units", None) or [getattr(args, "unit", "data")]
    return ", ".join(str(path) for path in given)


def _parser(argv: list[str]) -> argparse.ArgumentParser:
    parser = _Parser(prog="backdrive-bayes", description=_DESCRIPTION, allow_abbrev=False)
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and leave")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True, parser_class=_Parser)
    # only the verb that is asked for is imported; --help needs them all
    asked = next((word for word in argv if not word.startswith("-")), None)
    for verb in [asked] if asked in VERBS else VERBS:
        module = importlib.import_module(f"backdrive_bayes.commands.{VERBS[verb]}")
        own = verbs.add_parser(
            # argparse formats the one and not the other
            verb, help=module.HELP.replace("%", "%%"), description=module.HELP, allow_abbrev=False
        )
        module.add_arguments(own)
        own.add_argument("-o", "--out", type=Path, metavar="OUT", help=getattr(module, "OUT_HELP", "folder to write into"))
        own.add_argument("--seed", type=_seed, default=0, metavar="N", help="seed of all random numbers (default 0)")
        own.set_defaults(run=module.run)
    return parser


class _Version(argparse.Action):
    def __call__(self, parser, namespace, values, option_string=None):
        from importlib.metadata import PackageNotFoundError, version

        from backdrive_bayes.commands.output import say

        try:
            say(f"backdrive-bayes {version('backdrive-bayes')}")
        except PackageNotFoundError:
            say("backdrive-bayes (not installed)")
        parser.exit()


def _seed(text: str) -> int:
    if not text.isdecimal() or len(text) > 18:
        raise argparse.ArgumentTypeError(f"expected a whole number from 0 of at most 18 digits, found '{text}'")
    return int(text)
