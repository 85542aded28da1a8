"""`report`: one PDF from saved results."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.errors import BadInput

HELP = "make one PDF from result folders; computes nothing"
OUT_HELP = "folder to write report.pdf into, or the PDF file itself"
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
    parser.add_argument(
        "--template",
        type=Path,
        metavar="FOLDER",
        help="a company's template: template.toml (name, colours, fields, footer) and logo.svg or logo.png",
    )


def run(args) -> int:
    """Write report.pdf into the folder of ``-o`` or the first result folder, or the file of ``-o``; 0 done."""
    from backdrive_bayes.commands.output import say, write_file, write_folder
    from backdrive_bayes.report.report import write_report

    out = args.out or args.results[0]
    given = getattr(args, "template", None)
    template = read_template(given) if given else None
    if out.suffix.lower() == ".pdf" and not out.is_dir():
        with write_file(out) as temporary:
            write_report(args.results, temporary, template)
        say(f"report written to {out}")
        return 0
    with write_folder(out) as folder:
        write_report(args.results, folder / NAME, template)
    say(f"report written to {out / NAME}")
    return 0


def read_template(folder: Path):
    """A company's template for the report; BadInput says which file or key of the folder cannot be used."""
    from backdrive_bayes.report.company import FILE_NAME, company_template
    from backdrive_bayes.report.logo import NAMES, read_logo
    from backdrive_bayes.schemas.template_file import TemplateFile
    from backdrive_bayes.schemas.toml_file import read_typed

    folder = Path(folder)
    if not folder.is_dir():
        raise BadInput(folder, "a template folder", "a file" if folder.exists() else "no such folder")
    logo, path = read_logo(folder), folder / FILE_NAME
    if not path.exists() and logo is None:
        raise BadInput(folder, f"a template folder with {', '.join([FILE_NAME, *NAMES])}", "none of them")
    return company_template(read_typed(path, TemplateFile, "a template file") if path.exists() else TemplateFile(), logo)
