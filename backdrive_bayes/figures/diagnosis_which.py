"""Which effect: bars of probability with the credible set marked."""

from __future__ import annotations

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_words import chance, hypothesis_words
from backdrive_bayes.figures.fonts import drawable
from backdrive_bayes.figures.style import BLUE, GREY, matplotlib

LONGEST = 27
"""Letters of a line."""
_OUTSIDE = "#D5D5D5"


def bar_lines(saved: Diagnosed) -> float:
    """Lines of text that the bars need."""
    return _places(saved.ranked())[-1] + 1.0 if saved.result["which"] else 0


def _places(shown):
    """Positions of the bars; every effect of a pair takes a line."""
    deep = [1 + 0.85 * h.effect.count("+") for h in shown]
    return [sum(deep[:i]) + 0.5 * deep[i] for i in range(len(deep))]


def draw_bars(axes, saved: Diagnosed) -> None:
    """Bars of the most probable hypotheses; those of the credible set dark, with bold names."""
    shown = saved.ranked()
    places = _places(shown)
    for y, hypothesis in zip(places, shown, strict=True):
        look = {"color": BLUE} if hypothesis.in_set else {"color": _OUTSIDE, "edgecolor": GREY, "linewidth": 0.6}
        axes.barh(y, hypothesis.probability, height=0.62, **look)
        weight = "bold" if hypothesis.in_set else "normal"
        axes.text(hypothesis.probability + 0.02, y, chance(hypothesis.probability), va="center", fontweight=weight)
    names = ["\n+ ".join(drawable(n, LONGEST) for n in hypothesis_words(h).split(" + ")) for h in shown]
    axes.set_yticks(places, names)
    for label, hypothesis in zip(axes.get_yticklabels(), shown, strict=True):
        label.set_fontweight("bold" if hypothesis.in_set else "normal")
    axes.set_ylim(places[-1] + 0.6, -0.05)
    # Room for the number behind the longest bar.
    axes.set_xlim(0, 1.22)
    axes.set_xticks([0, 0.5, 1], ["0", "50", "100 %"])
    axes.set_title("Which effect?", loc="left", fontweight="bold")
    axes.set_xlabel("probability")
    axes.tick_params(axis="y", length=0)
    if any(h.in_set for h in shown):
        patch = matplotlib.patches.Patch(color=BLUE, label="90 % credible set")
        # Where the shortest bar leaves most room.
        _, free = min((h.probability, -y) for y, h in zip(places, shown, strict=True))
        at = {"loc": "center right", "bbox_to_anchor": (1.22, -free), "bbox_transform": axes.transData}
        axes.legend(handles=[patch], borderaxespad=0.1, handlelength=1.2, **at)
