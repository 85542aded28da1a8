"""What the check of the data found, repeated wherever a result rests on it."""

from __future__ import annotations

from backdrive_bayes.report.blocks import Banner, Block, Paragraph
from backdrive_bayes.report.text import free

MOST = 4
"""Warnings that a summary names."""
PROVISIONAL = "? marks provisional numbers: not to be used."
FORCED = "FORCED: the check finds the data unfit."
_FORCED = "The check finds the data unfit and --force overruled it: nothing that rests on them is to be trusted."


def findings_blocks(result: dict) -> list[Block]:
    """A banner where data were forced, and the errors and warnings of the check; notes are left to the files."""
    found = [f for f in result.get("findings") or [] if f.get("level") != "note"]
    blocks: list[Block] = [Banner("bad", "FORCED: unfit data", _FORCED)] if result.get("forced") else []
    if found:
        told = "; ".join(free(_line(f), 200) for f in found[:MOST])
        more = f"; and {len(found) - MOST} more in the result file" if len(found) > MOST else ""
        blocks.append(Paragraph(f"Check of the data: {told}{more}."))
    return blocks


def warned(result: dict) -> str:
    """The same in a few words for an overview; empty where there is nothing to say."""
    count = sum(f.get("level") != "note" for f in result.get("findings") or [])
    warnings = f"{count} warning{'s'[: count != 1]} of the check" if count else ""
    return ", ".join(filter(None, ["FORCED on unfit data" if result.get("forced") else "", warnings]))


def _line(finding):
    where = " of ".join(filter(None, [str(finding.get("record") or ""), str(finding.get("unit") or "")]))
    return f"{finding['level']}, {where}: {finding['text']}" if where else f"{finding['level']}: {finding['text']}"
