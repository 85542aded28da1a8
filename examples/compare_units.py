"""Compare two units, and put the published claims and one of your own to their posteriors.

    python examples/compare_units.py [UNIT UNIT] [--out OUT]
"""

from pathlib import Path

from _options import options

from backdrive_bayes import compare, fit, report

given = options("data/reducer-1", "data/reducer-2", out="compare-units")
fits = [fit(unit, seed=1) for unit in given.units[:2]]

published = compare(*fits, claims="paper")
for claim in published.claims:
    print(claim["id"], claim["claim"], claim["verdict"], claim["probability"])

own = compare(*fits, claims=Path(__file__).with_name("my_claims.toml"))
for claim in own.claims:
    print(claim["claim"], claim["verdict"], claim["probability"])

report(published, out=given.out)
