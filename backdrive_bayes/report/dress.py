"""Puts a company's template around the report: its letterhead on summaries, what it says as data of the layout."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.report.blocks import Letterhead
from backdrive_bayes.report.company import CompanyTemplate
from backdrive_bayes.report.text import free

_SAID = ("company", "address", "fields", "footer", "paper", "headings", "lines")


def dressed(data: dict, template: CompanyTemplate, room: Path) -> dict:
    """The report's data with the company's letterhead, fields, colours and footer; its logo is written into ``room``."""
    alt = template.logo_text or free(f"Logo of {template.company}" if template.company else "Company logo")
    company = {key: getattr(template, key) for key in _SAID} | {"logo": "", "alt": alt}
    if template.logo:
        company["logo"] = template.logo.path.name
        (room / company["logo"]).write_bytes(template.logo.data)
    overview = _summary(data["overview"], template) if data["overview"] else []
    chapters = [c | {"summary": _summary(c["summary"], template)} for c in data["chapters"]]
    return data | {"company": company, "overview": overview, "chapters": chapters}


def _summary(blocks, template):
    headed = template.company or template.address or template.logo or template.fields
    head = [Letterhead().data()] if headed else []
    return [*head, *(_signed(b, template.signatures) for b in blocks)]


def _signed(block, labels):
    return block | {"labels": list(labels)} if labels and block["kind"] == "signature" else block
