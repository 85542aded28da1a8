"""One look for all figures: sizes, colours that also read in grey print, units and labels."""

from __future__ import annotations

import math
import re
import textwrap
import warnings
from contextlib import contextmanager
from functools import partial

from backdrive_bayes.errors import MissingExtra
from backdrive_bayes.number_text import ARCMIN_PER_RAD, plain

try:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.ticker import MaxNLocator
        from matplotlib.transforms import Bbox, ScaledTranslation
except ImportError:
    raise MissingExtra("drawing figures", "matplotlib", "figures") from None

WIDTH_IN = 170 / 25.4
"""Width of every figure: the text width of an A4 page with 20 mm margins, so that font sizes print as they are set."""

PNG_DPI = 150
MJ_PER_J = 1e3
PER_FIGURE = 3
"""Records side by side in one figure; more records make more figures."""
TORQUE_TICKS = {1: 10, 2: 6, 3: 5}
"""Steps on the torque axes of so many panels side by side."""

BLACK, BLUE, VERMILLION, GREEN = "#000000", "#0072B2", "#D55E00", "#007A5A"
PURPLE, ORANGE, SKY, GREY = "#A3527F", "#E69F00", "#56B4E9", "#8C8C8C"

RISING = {"color": BLUE, "linestyle": "-"}
FALLING = {"color": VERMILLION, "linestyle": (0, (5, 2))}
FIRST = {"color": BLACK, "linestyle": (0, (1, 1.5))}
SERIES = (
    {"color": BLUE, "linestyle": "-", "marker": "o"},
    {"color": VERMILLION, "linestyle": (0, (5, 2)), "marker": "s"},
    {"color": GREEN, "linestyle": (0, (1, 1.2)), "marker": "^"},
    {"color": PURPLE, "linestyle": (0, (6, 2, 1, 2)), "marker": "D"},
    {"color": BLACK, "linestyle": (0, (3, 1, 1, 1, 1, 1)), "marker": "v"},
    {"color": ORANGE, "linestyle": (0, (8, 3)), "marker": "P"},
)
"""Colour, line and marker of series that share an axis; no two agree in line or marker."""

_RC = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "lines.linewidth": 1.2,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "axes.unicode_minus": True,
    "text.parse_math": False,
    # Text stays text, so that it can be found in the PDF; the hash salt makes element ids repeatable.
    "svg.fonttype": "none",
    "svg.hashsalt": "backdrive_bayes",
}


@contextmanager
def styled():
    """Draw or save within the style."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_RC)
        yield


def new_figure(height_in: float, constrained: bool = True) -> Figure:
    """An empty figure of page width and the given height [inch] that needs no display."""
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained" if constrained else None)
    FigureCanvasAgg(figure)
    return figure


def settled(figures: dict[str, Figure]) -> dict[str, Figure]:
    """The figures with their layout fixed: solved once, and rounded, for the solver's last bits vary from run to run."""
    for figure in figures.values():
        if (solver := figure.get_layout_engine()) is None:
            continue
        with styled():
            # Letters are a little wider at some resolutions: room for them as they are printed.
            figure.set_dpi(PNG_DPI)
            solver.execute(figure)
            figure.set_layout_engine(None)
        for part in figure.subfigs:
            part.bbox_relative.set_points(part.bbox_relative.get_points().round(5))
        for axes in figure.axes:
            axes.set_position(Bbox.from_bounds(*(round(x, 5) for x in axes.get_position().bounds)))
    return figures


def few_ticks(axes, x: int | None = 4, y: int | None = 5) -> None:
    """At most ``x`` and ``y`` steps between round tick labels; None leaves that axis as it is."""
    for axis, most in ((axes.xaxis, x), (axes.yaxis, y)):
        if most is not None:
            axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]))


def legend_below(figure, *axes, columns: int, **look) -> None:
    """One legend beneath a figure, or a part of one, for everything that has a name in some axes, each name once."""
    named: dict = {}
    for panel in axes:
        for handle, name in zip(*panel.get_legend_handles_labels(), strict=True):
            named.setdefault(name, handle)
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=min(columns, len(named)), **look)


def numbered(name: str, draw, saved, items: list, at_most: int) -> dict[str, partial]:
    """Functions that draw the parts of a figure by name (loop, loop-2, …), of nearly equal numbers of items."""
    return in_parts(name, draw, saved, parts(items, at_most))


def in_parts(name: str, draw, saved, each: list[list]) -> dict[str, partial]:
    """The same of parts that are known."""
    return {name if i == 0 else f"{name}-{i + 1}": partial(draw, saved, part) for i, part in enumerate(each)}


def loop_words(at: dict) -> str:
    """Loading rate and amplitude of a record object, or of anything else that has them."""
    return f"{plain(at['loading_rate_Nm_per_s'], 2)} N·m/s, ±{plain(at['amplitude_Nm'])} N·m"


def reach(interval: dict) -> list[list[float]]:
    """How far an interval goes from its median to either side, as error bars want it."""
    return [[max(interval["median"] - interval["lo"], 0.0)], [max(interval["hi"] - interval["median"], 0.0)]]


def record_labels(records) -> list[str]:
    """A short, unique name for each record object: its rate, with the amplitude or a number where rates repeat."""
    labels = [f"{plain(r['loading_rate_Nm_per_s'], 2)} N·m/s" for r in records]
    if len(set(labels)) < len(labels):
        labels = [loop_words(r) for r in records]
    if len(set(labels)) < len(labels):
        labels = [f"{a} (no. {i})" for i, a in enumerate(labels, 1)]
    return labels


DISPLAY_UNITS = {
    "rad": (ARCMIN_PER_RAD, "arcmin"),
    "rad/(N·m)": (ARCMIN_PER_RAD, "arcmin/(N·m)"),
    "J": (MJ_PER_J, "mJ"),
    "1": (1.0, ""),
}


def display_unit(unit: str) -> tuple[float, str]:
    """Factor and name of the unit in which a quantity saved in ``unit`` is shown."""
    return DISPLAY_UNITS.get(unit, (1.0, unit))


def shown_unit(unit: str, values) -> tuple[float, str]:
    """Factor and name of the unit in which values saved in ``unit`` are shown; mN·m for small torques."""
    if unit == "N·m" and max((abs(v) for v in values), default=1.0) < 0.1:
        return 1e3, "mN·m"
    return display_unit(unit)


def parts(items: list, at_most: int) -> list[list]:
    """Items in as few parts of at most so many as there can be, the parts alike in size."""
    if not items:
        return []
    size = math.ceil(len(items) / math.ceil(len(items) / at_most))
    return [items[i : i + size] for i in range(0, len(items), size)]


INDICATOR_WORDS = {
    "lost_motion_rad": "lost motion δ",
    "zero_torque_width_rad": "width at zero torque w(0)",
    "peak_angle_rad": "peak angle",
    "loop_area_J": "dissipated energy S",
    "absorbed_J": "absorbed energy W_abs",
    "dissipation_ratio": "dissipation ratio u",
    "tau1_Nm": "τ₁",
    "tau2_Nm": "τ₂",
    "hump_torque_Nm": "torque of the hump",
    "S_g_J": "energy of geometric error S_g",
    "S_f_J": "energy of friction S_f",
    "S_g_over_S": "S_g/S",
    "S_f_over_S": "S_f/S",
    "elastic_share": "elastic share of W_abs",
    "theta_L_rad": "angle turned θ_L",
    "W_L_J": "energy at load W_L",
}


def indicator_words(name: str) -> str:
    """An indicator's name in words, with its symbol."""
    return INDICATOR_WORDS.get(name, words(name))


def drawn_words(name: str) -> str:
    """The same for a figure, whose letters cannot be set low."""
    return indicator_words(name).replace("of W_abs", "of absorbed energy").replace(" W_abs", "")


_SAVED_NAMES = re.compile(rf"(?<![\w.'\"])({'|'.join(INDICATOR_WORDS)})(?![\w'\"])")


def in_words(text: str) -> str:
    """A sentence of a result file with indicators, T_r and shares in words and with spaces, as everywhere else."""
    text = _SAVED_NAMES.sub(lambda m: indicator_words(m[1]), text)
    text = re.sub(r"(\d+(?:\.\d+)?) ?T_r\b", lambda m: f"{m[1]} {'of' if float(m[1]) < 1 else 'times'} the rated torque", text)
    return re.sub(r"(?<=\d)%", " %", re.sub(r"(?<![\w·])T_r\b", "the rated torque", text))


def shortened(name: str, most: int = 24) -> str:
    """A unit's name in at most so many characters, its middle left out: what tells units apart begins or ends it."""
    name = " ".join(str(name).split())
    return name if len(name) <= most else f"{name[: (most - 1) // 2]}…{name[-(most // 2) :]}"


def words(name: str) -> str:
    """A parameter's or module's name in words, without its unit."""
    return re.sub(r"_(rad_per_Nm|rad|Nm)$", "", name).replace("_", " ")


def two_lines(text: str, unit: str) -> str:
    """Text and unit on two lines, broken where the longer line is shortest."""
    parts = [*text.split(" "), unit]
    breaks = [(" ".join(parts[:i]), " ".join(parts[i:])) for i in range(1, len(parts))]
    return "\n".join(min(breaks, key=lambda lines: max(map(len, lines))))


def wrapped(text: str, width: int) -> str:
    """Text on as many lines as lines of ``width`` characters take; words stay whole."""
    return textwrap.fill(text, width, break_long_words=False, break_on_hyphens=False)


def numbers(values) -> list[str]:
    """Ticks' values in full, alike in their decimals, without a common factor or offset elsewhere."""
    shown = [f"{v:.10g}" for v in values]
    if not any("e" in text for text in shown):
        decimals = max((len(text.partition(".")[2]) for text in shown), default=0)
        shown = [f"{v:.{decimals}f}" for v in values]
    return [text.replace("-", "−") for text in shown]


def size_in(text) -> tuple[float, float]:
    """Width and height of a text of a figure as it will be drawn [inch]."""
    box = text.get_window_extent(text.figure.canvas.get_renderer())
    return box.width / text.figure.dpi, box.height / text.figure.dpi


def moved(axes, right_in: float, up_in: float):
    """The axes' own coordinates, moved by so many inches."""
    return axes.transAxes + ScaledTranslation(right_in, up_in, axes.figure.dpi_scale_trans)
