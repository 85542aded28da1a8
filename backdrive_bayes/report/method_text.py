"""Method and definitions, the same in every report."""

from __future__ import annotations

from backdrive_bayes.report.blocks import Facts, Heading, Note, Paragraph

SOURCE = "doi:10.1177/00202940261442382"

_TEST = (
    "The input shaft is locked and the output shaft is loaded 0 → +T → 0 → −T → 0 → +T at a constant rate. θ₊(τ) is the angle on "
    "the branch with rising torque, θ₋(τ) on the branch with falling torque. The first loading from 0 to +T is not part of the "
    "settled loop."
)
_MODEL = (
    "The model of a clean reducer is a class: odd, rate-independent hysteresis operators, written as cells of the Preisach plane "
    "for elasticity, friction and clearance. All records of a unit share the cells' Gaussian weights, so that any amplitude and "
    "torque history follow from them. Angle noise is white plus correlated; torque noise and the jitter of crossing torques "
    "enter through the slope of the loop. Weights, offsets and the noise scale are integrated exactly; emcee samples the log "
    "scales of the weights in several independent ensembles, and the weights of each draw are drawn exactly. Geometric error, "
    "stiffness and friction are functionals of the drawn operator."
)
_EFFECTS = (
    "An effect of the reducer or of the measuring channel breaks a symmetry of the class (rate, oddness, time, memory, period in "
    "the angle). A fit holds each at the level of traces. A diagnosis weighs them by the marginal likelihood of contrasts in "
    "which a clean reducer of the class cancels. A second clearance and slip of the output interface break none: they are "
    "properties of the operator, and their probability is that of the drawn operators of a practical size."
)
_DEFINITIONS = [
    ("T, T_r", "amplitude of a loop; rated torque"),
    ("w(τ)", "width of the loop, θ₋(τ) − θ₊(τ); w(0) is what most people call backlash"),
    ("δ(k)", "lost motion: mean of both branches at +kT_r minus the same at −kT_r; eq. (13), reconstructed"),
    ("Peak angle", "half the angle between the tips of the settled loop at +T and −T"),
    ("S", "∫ w dτ from −T to T, energy dissipated in one cycle; eq. (21), reconstructed"),
    ("W_abs", "absorbed strain energy: signed ∫ τ dθ along the loading quadrants 0 → +T and 0 → −T; eq. (22), reconstructed"),
    ("u", "S / W_abs, energy dissipation ratio"),
    ("S(t), u(t)", "S and u of the loop of amplitude t, not of a window cut out of the large loop"),
    ("Torque–energy curve", "w(|τ|): energy per unit of torque, mean of both directions; eq. (26)–(27), reconstructed"),
    ("θ_L, W_L", "angle turned and energy absorbed when a load τ_L arrives; eq. (1) and (7), reconstructed"),
    ("Branch model", "θ±(τ) = G + a₁τ + a₃τ³ + a₅τ⁵ + A·tanh(Bτ ∓ D) ∓ d₀; eq. (20), reconstructed"),
]


def method_blocks(terms=()) -> list:
    """The closing pages of a report, with what its chapters add to the ``terms``."""
    return [
        Heading("Method and definitions", 1),
        Paragraph(_TEST),
        Paragraph(_MODEL),
        Paragraph(_EFFECTS),
        Facts(_DEFINITIONS),
        *terms,
        Note(
            f"Source: {SOURCE}. Its equations were not available to us; those cited here are reconstructions from the prose, "
            "from dimensional analysis and from catalogue definitions, and are called reconstructed."
        ),
    ]
