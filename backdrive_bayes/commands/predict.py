"""`predict`: angle and interval for a torque history."""

from __future__ import annotations

import json
from pathlib import Path

from backdrive_bayes.commands.door import repeat_findings
from backdrive_bayes.commands.output import say, write_folder, write_json
from backdrive_bayes.commands.results import stamped
from backdrive_bayes.decisions.outcome import line
from backdrive_bayes.errors import BadInput
from backdrive_bayes.number_text import ARCMIN_PER_RAD
from backdrive_bayes.results import PREDICTION, SEAL, read_group

HELP = "angle with 90 % interval for a torque history, from a posterior"
DRAWS = 400
NOISY = "the torque history is noisy: {:.2g} N·m (rms) of noise was taken out between its turning points"
FROM_REST = "from rest: no fit reads the first loading, so intervals are too narrow until the torque first turns"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("posterior", type=Path, metavar="POSTERIOR.nc", help="posterior.nc of a fit")
    parser.add_argument("path", type=Path, metavar="PATH.csv", help="torque history with columns time_s and torque_Nm")
    parser.add_argument(
        "--start", choices=("unknown", "rest"), default="unknown", help="the reducer's initial state (default unknown)"
    )
    parser.add_argument("--draws", type=int, default=0, metavar="N", help="also write N whole curves, draws.csv")
    parser.add_argument("--extrapolate", action="store_true", help="go on to 1.2 times the largest measured torque")


def run(args) -> int:
    """Write prediction.csv, what it rests on as prediction.json, and draws.csv where asked for; 0 done."""
    import numpy as np

    from backdrive_bayes.engine.posterior_read import read_posterior
    from backdrive_bayes.engine.prediction import nodes, predict_angles, range_caveat, rate_caveat, require_range, rest_caveat
    from backdrive_bayes.records.history import noise_free_torque, read_history
    from backdrive_bayes.records.unit_folder import sha256_of

    posterior = read_posterior(args.posterior)
    if not posterior.converged:
        raise BadInput(args.posterior, "a converged posterior", "one that is not to be used (its indicators.json says why)")
    fit = read_group(args.posterior, "sample_stats").attrs
    data = {"findings": json.loads(fit["findings"]), "forced": bool(fit["forced"])}
    repeat_findings(posterior.unit_name, data)
    time, measured, guessed = read_history(args.path)
    torque, noisy = noise_free_torque(time, measured)
    for note in (notes := [*guessed, *[NOISY.format(float(np.std(measured - torque)))] * noisy]):
        say(f"note: {note}")
    require_range(posterior, torque, args.extrapolate, args.path)
    if not 0 <= args.draws <= DRAWS:
        raise BadInput("--draws", f"a number from 0 to {DRAWS}", args.draws)
    curves = predict_angles(posterior, time, torque, args.start, DRAWS) * ARCMIN_PER_RAD
    bounds = np.stack([curves.mean(axis=0), *np.quantile(curves, [0.05, 0.95], axis=0)])
    out = args.out or Path(f"{args.path.stem}-predict")
    header = "time_s,torque_Nm,angle_mean_arcmin,angle_lo90_arcmin,angle_hi90_arcmin"
    with write_folder(out) as folder:
        _write(folder / "prediction.csv", header, time, measured, nodes(torque), bounds)
        if args.draws:
            some = curves[np.linspace(0, len(curves) - 1, args.draws).astype(int)]
            names = ",".join(["time_s", "torque_Nm", *(f"angle_{i}_arcmin" for i in range(args.draws))])
            _write(folder / "draws.csv", names, time, measured, nodes(torque), some)
        elif (out / "prediction.json").is_file():  # those of the prediction that is replaced
            (out / "draws.csv").unlink(missing_ok=True)
        half = float(np.max(bounds[2] - bounds[1]) / 2)
        caveats = [caveat(posterior, time, torque) for caveat in (rate_caveat, rest_caveat)]
        caveats += [range_caveat(posterior, torque), FROM_REST * (args.start == "rest")]
        about = {"reason": f"{time.size} points, half-width at most {half:.3g}′", "notes": notes}
        about["prediction_sha256"] = sha256_of(folder / "prediction.csv")
        result = _sidecar(args, posterior, fit[SEAL], data | about | {"caveat": "; ".join(filter(None, caveats))})
        write_json(folder / "prediction.json", result)
    say(f"{result['unit']}: {line(result['outcome'])}")
    say(f"written to {out}/prediction.csv")
    return result["outcome"]["exit_code"]


def _sidecar(args, posterior, digest: str, about: dict) -> dict:
    """What the prediction rests on: the posterior, the torque history and the options, beside what is said ``about`` it."""
    from backdrive_bayes.records.unit_folder import sha256_of

    history = {"file": args.path.name, "sha256": sha256_of(args.path)}
    own = {"unit": posterior.unit_name, "data_sha256": list(posterior.data_hashes)}
    result = {"schema": PREDICTION, **about, "history": history, "posterior_sha256": digest}
    options = {"start": args.start, "draws": args.draws, "extrapolate": args.extrapolate}
    return stamped(result, own, posterior.seed, options)


def _write(path, header, time, torque, at, curves) -> None:
    """One row a sample; ``curves`` (columns, nodes) are known at the samples ``at``."""
    import numpy as np

    every = np.arange(time.size)
    columns = np.column_stack([time, torque, *(np.interp(every, at, curve) for curve in curves)])
    # Stamps of a clock have more digits than what is predicted.
    digits = ["%.15g", *["%.9g"] * (columns.shape[1] - 1)]
    np.savetxt(path, columns, delimiter=",", header=header, comments="", fmt=digits)
