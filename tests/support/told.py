"""Result objects made by hand, with what every result file carries."""

from backdrive_bayes.decisions.outcome import outcome_of

DIGEST = "0123456789abcdef" * 4


def told(result):
    """The object with stamps, where it has none of its own, and the outcome that its content has."""
    stamps = {"data_sha256": [DIGEST], "unit_sha256": "", "version": "0.1.0", "seed": 7, "options": {}}
    result = stamps | result
    return result | {"outcome": outcome_of(result).to_json()}
