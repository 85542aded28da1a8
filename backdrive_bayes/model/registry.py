"""The one list of everything a model may be made of; a new member is one file and one line here."""

from __future__ import annotations

from backdrive_bayes.errors import BadInput
from backdrive_bayes.model.elastic import Elastic
from backdrive_bayes.model.friction import Friction
from backdrive_bayes.model.geometric import Geometric
from backdrive_bayes.model.member import Member

MEMBERS: dict[str, Member] = {m.name: m for m in (Geometric(), Elastic(), Friction())}
BASELINE = ("geometric", "elastic", "friction")


def members_named(names) -> tuple[Member, ...]:
    """The members of the given names in the registry's order; BadInput on an unknown or repeated name."""
    names = list(names)
    for name in names:
        if name not in MEMBERS:
            raise BadInput("model", f"names out of {', '.join(MEMBERS)}", repr(name))
    if not names or len(set(names)) < len(names):
        raise BadInput("model", "at least one member, each once", ",".join(names) or "none")
    return tuple(m for name, m in MEMBERS.items() if name in names)
