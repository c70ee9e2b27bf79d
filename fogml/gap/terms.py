"""What an explanation consists of in the evidence: columns of its effects and group, and their lengths.

Effects of any size have their node's columns. Large ones have two rooms besides: for being felt deeper
within the gyro than they are measured, always, and for another form, unless forms are taken as exact.
"""

from __future__ import annotations

from collections.abc import Iterable

from fogml.gap.evidence import Field, Term
from fogml.gap.explanation import Chosen
from fogml.gap.priors import SLACK, SLACK_FROM


class Terms:
    """Terms of the effects and groups of one field.

    Parameters
    ----------
    field
        Inner products of everything.
    """

    def __init__(self, field: Field) -> None:
        self._field = field

    def of(
        self, effects: Iterable[Chosen], group: tuple[str, float] | None, *, exact: bool = False
    ) -> list[Term]:
        """Terms of effects and a group; with what forms may differ by unless they are `exact`."""
        terms = []
        for c in effects:
            terms.append(Term(self._field.basis.nodes[c.node].columns, c.length))
            terms += self.within(c)
            if c.size >= SLACK_FROM and not exact:
                terms.append(Term(self._field.slack(c.node), SLACK * c.size))
        if group is not None:
            terms.append(self.of_group(*group))
        return terms

    def of_group(self, name: str, length: float) -> Term:
        """The columns of a group of the unknown."""
        return Term(tuple(int(c) for c in self._field.basis.groups[name]), length)

    def within(self, chosen: Chosen) -> list[Term]:
        """The term of an effect that is felt deeper than it is measured; none of a small one."""
        columns = self._field.within(chosen.node) if chosen.size >= SLACK_FROM else ()
        return [Term(columns, chosen.size)] if columns else []
