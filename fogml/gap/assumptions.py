"""What a diagnosis assumes, in words."""

from __future__ import annotations

from fogml.gap.basis import Basis, stands_still
from fogml.gap.found import FORM_ERROR
from fogml.gap.how_far import FORM_LEFT
from fogml.gap.model import told_by
from fogml.gap.noise import SAFE_SIDE
from fogml.gap.preparing import Prepared
from fogml.gap.priors import SLACK
from fogml.gap.row_responses import LARGEST_SHARE
from fogml.gap.unlike import RELATIVE


def assumptions(p: Prepared, basis: Basis) -> tuple[str, ...]:
    """Sentences for the report."""
    fitted = ", ".join(o.run.name for o in p.fit)
    said = [
        "The constants of the model are normal about their priors, shared by all runs of the unit, and "
        "fitted together with every effect.",
        f"After a start or a gap {p.model.memory_s:g} s of each run take no part in any figure: "
        "the model can't know what came before.",
        "Noise is Gaussian: white noise, flicker and a random walk. It was fitted on "
        f"{p.noise.source}; for the search its slow terms are taken {SAFE_SIDE:g} standard errors larger.",
        f"An effect's true form may differ from the catalogue's by {SLACK:.0%} of its size; where a "
        "temperature that it needs was not recorded, that holds other thermal orders as well. One that goes "
        "with T may follow the temperature in the middle of the winding, which no sensor sits on.",
        "Amplitudes are taken to lie within the card's ranges, or a decade or so above.",
        f"An amplitude's standard error holds {FORM_ERROR:.0%} of it for the form of the effect. The "
        f"interval of what is closed holds {FORM_LEFT:.0%} of that for it, an uncertain floor, and what "
        "errors of the fitted values add to the gap after.",
        f"What is like a candidate (cosine above {RELATIVE:g} beside the constants) is no unknown.",
    ]
    widths = {o.run.name: o.row_s for o in p.fit if o.width > 1}
    if widths:
        listed = ", ".join(f"{name}: {width:g} s" for name, width in widths.items())
        said.append(f"Long runs were averaged before the search ({listed}); faster effects can't be seen.")
    if any(o.responses.on_means for o in p.fit):
        said.append(
            "There the responses of slow effects were taken on averaged inputs, for the search, where that "
            f"changed them by at most {100.0 * LARGEST_SHARE:g}% of their rms at the usual shapes."
        )
    if len(p.fit) == 1:
        said.append(f"One run only ({fitted}): nothing that differs between runs can be told.")
    if not any(o.run.earth_known for o in p.fit):
        said.append("Earth rate is not known from the side files and is part of the bias b0.")
    candidates = p.model.candidates()
    still = [id for id in basis.within_constants if stands_still(candidates[id], basis.frame)]
    one = [id for id in basis.within_constants if id not in still]
    if one:
        said.append("One with the constants on these runs: " + ", ".join(one) + ".")
    for id in still:
        drives = " and ".join(" or ".join(map(repr, group)) for group in told_by(candidates[id]))
        said.append(f"{id} is told by changes of {drives} alone, and none is recorded.")
    return tuple(said)
