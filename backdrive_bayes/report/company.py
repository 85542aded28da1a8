"""A company's template as the report uses it."""

from __future__ import annotations

from dataclasses import dataclass

from backdrive_bayes.report.logo import Logo
from backdrive_bayes.report.text import Free, free
from backdrive_bayes.schemas.template_file import BLACK, TemplateFile, six_digits

FILE_NAME = "template.toml"


@dataclass(frozen=True)
class CompanyTemplate:
    """What a company puts around its reports; texts are data, never markup.

    ``headings`` and ``lines`` are colours (#rrggbb), ``fields`` rows of a label and a text; empty means "as without".
    """

    company: Free = Free()
    title: Free = Free()
    footer: Free = Free()
    logo_text: Free = Free()
    address: tuple[Free, ...] = ()
    signatures: tuple[Free, ...] = ()
    paper: str = "a4"
    headings: str = BLACK
    lines: str = BLACK
    fields: tuple[tuple[Free, Free], ...] = ()
    logo: Logo | None = None


def company_template(file: TemplateFile, logo: Logo | None) -> CompanyTemplate:
    """The template of a read ``template.toml``."""
    return CompanyTemplate(
        company=_free(file.company),
        title=_free(file.title),
        footer=_free(file.footer),
        logo_text=_free(file.logo_text),
        address=tuple(map(_free, file.address or ())),
        signatures=tuple(map(_free, file.signatures or ())),
        paper=file.paper,
        headings=six_digits(file.colours.headings),
        lines=six_digits(file.colours.lines),
        fields=tuple((_free(label), _free(value)) for label, value in file.fields.items()),
        logo=logo,
    )


def _free(text: object) -> Free:
    return Free() if text is None else free(text)
