"""`predict`: angle and interval for a torque history."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.commands.output import say, write_folder
from backdrive_bayes.errors import BadInput

HELP = "angle with 90 % interval for a torque history, from a posterior"
RAD_TO_ARCMIN = 10800.0 / 3.141592653589793
MOST_CELLS = 4_000_000


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("posterior", type=Path, metavar="POSTERIOR.nc", help="posterior.nc of a fit")
    parser.add_argument("path", type=Path, metavar="PATH.csv", help="torque history with columns time_s and torque_Nm")
    parser.add_argument(
        "--start", choices=("unknown", "rest"), default="unknown", help="the reducer's past (default unknown)"
    )
    parser.add_argument("--draws", type=int, default=0, metavar="N", help="also write N whole curves, draws.csv")


def run(args) -> int:
    """Write prediction.csv (and draws.csv)."""
    import numpy as np

    from backdrive_bayes.inference.predict import DRAWS, predict_angles
    from backdrive_bayes.records.history import noise_free_torque, read_history

    time, measured = read_history(args.path)
    torque, noisy = noise_free_torque(time, measured)
    if noisy:
        say("the torque history is noisy: it was made monotone between its turning points before it drives the model")
    if not 0 <= args.draws <= MOST_CELLS // time.size:
        raise BadInput("--draws", f"a number from 0 to {MOST_CELLS // time.size}", args.draws)
    count = max(args.draws, DRAWS)
    curves = _curves(predict_angles, args, time, torque, np.random.default_rng(args.seed), count)
    curves *= RAD_TO_ARCMIN
    lo, hi = np.quantile(curves, [0.05, 0.95], axis=0)
    columns = np.column_stack([time, measured, curves.mean(axis=0), lo, hi])
    header = "time_s,torque_Nm,angle_mean_arcmin,angle_lo90_arcmin,angle_hi90_arcmin"
    out = args.out or Path(f"{args.path.stem}-predict")
    with write_folder(out) as folder:
        np.savetxt(folder / "prediction.csv", columns, delimiter=",", header=header, comments="", fmt="%.9g")
        if args.draws:
            names = ",".join(["time_s", "torque_Nm", *(f"angle_{i}_arcmin" for i in range(args.draws))])
            table = np.column_stack([time, measured, curves[: args.draws].T])
            np.savetxt(folder / "draws.csv", table, delimiter=",", header=names, comments="", fmt="%.9g")
    say(f"written to {out}/prediction.csv: {time.size} points, half-width at most {np.max(hi - lo) / 2:.3g}′")
    return 0


def _curves(predict_angles, args, time, torque, rng, count):
    import numpy as np

    # Long histories are drawn in as many curves as memory likes; quantiles need some hundred.
    count = min(count, max(args.draws, 200, 40_000_000 // time.size))
    return np.asarray(predict_angles(args.posterior, time, torque, rng=rng, start=args.start, draws=count))

