"""What to measure next: ranked set-ups for rivals, otherwise the experiment that the answer asks for."""

from __future__ import annotations

from explorer.report.content import Block, Bullets, Caution, Section, Table, Text
from explorer.report.diagnosis.findings import kind_of, members, named, out_of_sight
from explorer.report.findings import Plain
from explorer.report.units_for_people import code, fixed
from solver.effects import EFFECTS

MOST_LEVERS = 6


def next_step(result: Plain) -> Section:
    """One recommendation per kind of answer."""
    names = list(dict.fromkeys(name for label in named(result) for name in members(label)))
    match kind_of(result):
        case "ambiguous":
            blocks = _ranked(result)
        case "effect" | "effects":
            blocks = [
                Text("To see the named effect by itself, where nothing else can stand in for it:"),
                Bullets(tuple(_lever(name) for name in names)),
            ]
        case "unexplained":
            blocks = [
                Text("Where the residual sits, worst first; what is special about these numbers is the best lead:"),
                Bullets(tuple(result["where"])),
                Text(
                    "Before looking for new physics: pour the same set-up again, check scale and units of what was "
                    "measured, and the set-up itself. A condition with another outlet height or feed rate shows "
                    "whether the residual goes with the rig or with the material."
                ),
            ]
        case _:
            hidden = [row["name"] for row in out_of_sight(result)]
            blocks = [Text("Nothing has to be measured to keep the declared model for set-ups like these.")]
            if hidden:
                blocks.append(Text("What these data cannot see would show itself here:"))
                blocks.append(Bullets(tuple(_lever(name) for name in hidden[:MOST_LEVERS])))
    return Section("What to measure next", tuple(blocks))


def _ranked(result: Plain) -> list[Block]:
    rows = tuple(
        (
            code(row["experiment"]["name"]),
            fixed(row["experiment"]["score"]),
            f"{fixed(row['experiment']['separation'])} σ",
            "more than 100" if row["experiment"]["replicates"] is None else str(row["experiment"]["replicates"]),
        )
        for row in result["next_experiment"]
    )
    if not rows:
        return [
            Text("No change of the rig that was tried lets the rivals be compared. By their nature:"),
            Bullets(tuple(_lever(name) for label in named(result) for name in members(label))),
        ]
    blocks: list[Block] = [
        Text("Set-ups of the first fitted condition, poured with every rival; the most telling first:"),
        Table(
            ("set-up", "score", "least separation of one pour", "pours for odds of 20 : 1"),
            rows,
            "Score: expected information of six pours, 0 where nothing is learnt. Separation: distance of the two "
            "rivals that are closest, in σ of one pour and of the prediction.",
        ),
    ]
    if all(row["experiment"]["score"] <= 0.0 for row in result["next_experiment"]):
        blocks.append(Caution("No score is above zero: none of these set-ups is expected to tell the rivals apart."))
    blocks += [Text("By their nature:"), Bullets(tuple(result["next_experiment"][0]["levers"]))]
    return blocks


def _lever(name: str) -> str:
    return f"{code(name)}: {EFFECTS[name].lever}"
