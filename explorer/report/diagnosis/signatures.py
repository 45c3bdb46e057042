"""The residual and every effect's signature side by side: which pattern does the residual have?"""

from __future__ import annotations

from explorer.report.content import Caution, Figure, Section, Table, Text
from explorer.report.diagnosis.charts import cosine_chart, signature_chart
from explorer.report.findings import Plain
from explorer.report.units_for_people import MISSING, code, signed


def signatures(result: Plain) -> Section | None:
    """Heat map, cosines among effects, and with the residual; None where no effect can be seen."""
    drawn = result["signatures"]
    if not drawn["names"]:
        return None
    text = (
        "Each column is a pattern over the fitted numbers, whitened by their noise and freed from what calibration can "
        "take up, and brought to length one: first the residual of the declared model, then each effect. A cosine near "
        "± 1 with the residual says that the effect has the right pattern; near ± 1 between two effects, that these "
        "data cannot tell them apart. A sign is turned by an amplitude of the other sign, where that is allowed."
    )
    caution = (
        "Whitening goes down the list: a row is the part of its number that the rows above it do not predict. Read the "
        "columns against each other, not one row as that observable's change."
    )
    return Section(
        "Pattern of the residual",
        (
            Text(text),
            Caution(caution),
            Figure("signatures", signature_chart(result), "Columns of length one."),
            Figure("cosines", cosine_chart(result), "Cosines between the residual and the signatures, and among them."),
            _table(result),
        ),
    )


def _table(result: Plain) -> Table:
    drawn = result["signatures"]
    rows = []
    for k, name in enumerate(drawn["names"]):
        others = [(abs(c), other) for j, (c, other) in enumerate(zip(drawn["cosines"][k], drawn["names"], strict=True))
                  if j != k and c is not None]  # fmt: skip
        closest = max(others, default=None)
        nearest = MISSING if closest is None else f"{code(closest[1])} ({signed(closest[0])})"
        rows.append((code(name), signed(drawn["residual_cosine"][k]), nearest))
    return Table(("effect", "cosine with the residual", "most alike (|cosine|)"), tuple(rows))
