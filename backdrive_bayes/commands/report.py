"""`report`: one PDF from saved results."""

from __future__ import annotations

from pathlib import Path

HELP = "make one PDF from result folders; computes nothing"
NAME = "report.pdf"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument(
        "results",
        type=Path,
        nargs="+",
        metavar="OUT",
        help="result folders; the PDF goes into the first unless -o says where",
    )


def run(args) -> int:
    """Write report.pdf into the folder of ``-o`` or the first result folder; 0 done."""
    from backdrive_bayes.commands.output import say, write_folder
    from backdrive_bayes.report.report import write_report

    out = args.out or args.results[0]
    with write_folder(out) as folder:
        write_report(args.results, folder / NAME)
    say(f"report written to {out / NAME}")
    return 0
