"""Judge a unit with global risks that its sister units tell: limits, a batch of former fits, and the numbers of the verdict.

    python examples/acceptance_by_batch.py [UNIT SISTER SISTER SISTER …] [--limits LIMITS.toml]
"""

from _options import options

from backdrive_bayes import accept, fit

given = options(*(f"data/fleet/spring/unit-{number:02d}" for number in range(1, 7)), out="batch")
first, *sisters = [fit(unit, seed=1) for unit in given.units]

verdict = accept(first, given.limits, batch=sisters)
print(verdict)
for row in verdict.result["limits"]:
    print(row["indicator"], f"conforms with probability {row['conformance_probability']:.3f}", "global risks:", row["global"])
if verdict.result["next"]:
    print("measure next:", verdict.result["next"]["do"])
