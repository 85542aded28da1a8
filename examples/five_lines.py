"""Fit a unit, judge it against limits, make the PDF: five lines.

    python examples/five_lines.py [UNIT] [--out OUT]
"""

from _options import options

from backdrive_bayes import Unit, accept, fit, report

given = options("data/reducer-1", out="five-lines")

fitted = fit(Unit.read(given.units[0]), seed=1)
verdict = accept(fitted, given.limits)
print(verdict)
report(fitted, verdict, out=given.out)
