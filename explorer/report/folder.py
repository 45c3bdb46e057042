"""A report as a folder: the page, the Markdown, its figures for print, the data behind it, its references, checksums.

report.html, report.md      the report
figures/                    every figure as SVG and PDF at 85 and 180 mm, with the CSV behind it (extra `[paper]`)
data/*.csv                  tables of plain data
data/manifest.json          SHA-256 of every file of the report, verdict, author, date, versions
references.bib              what the methods cite
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

from explorer.files.output_file import write_whole, write_whole_bytes
from explorer.files.run_folder import json_text
from explorer.files.run_result import versions
from explorer.report.content import DataTable, Drawing, Figure, Picture, Reference, Report
from explorer.report.html import page
from explorer.report.markdown import document

NO_FIGURES = "figures/ for print: pip install 'repose-explorer[paper]', then `explorer report` on this folder"
"""Message if matplotlib is not installed."""
MANIFEST = "data/manifest.json"


def write_report(report: Report, folder: Path, results: Mapping[str, str] | None = None) -> str:
    """Write all files of ``report`` into ``folder``; each appears complete or not at all.

    ``results``: name → text of files that the report is about, written with it and listed in its manifest. Returns a
    line for the user about what is missing, "" if nothing is.
    """
    files = {"report.html": page(report).encode(), "report.md": document(report).encode()}
    files |= {name: text.encode() for name, text in (results or {}).items()}
    files |= {f"data/{table.name}.csv": csv_text(table).encode() for table in report.data}
    if report.references:
        files["references.bib"] = bibtex(report.references).encode()
    has_figures = any(isinstance(one, Figure) for one in report.shown.values())
    can_print = find_spec("matplotlib") is not None
    files |= _figures(report, can_print)
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_whole_bytes(folder / name, content)
    (folder / MANIFEST).parent.mkdir(exist_ok=True)
    write_whole(folder / MANIFEST, json_text(manifest(report, files)) + "\n")
    return NO_FIGURES if has_figures and not can_print else ""


def manifest(report: Report, files: Mapping[str, bytes]) -> dict[str, object]:
    """What the folder holds, by whom and from which program, with checksums."""
    return {
        "title": report.title,
        "verdict": report.banner.headline if report.banner else "",
        "author": report.about.author,
        "date": report.about.date,
        "notes": report.about.notes,
        "versions": versions(),
        "sha256": {name: hashlib.sha256(content).hexdigest() for name, content in sorted(files.items())},
    }


def csv_text(table: DataTable) -> str:
    """A table as CSV; what could not be measured is an empty cell."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(table.header)
    writer.writerows([["" if cell is None or cell != cell else cell for cell in row] for row in table.rows])
    return file.getvalue()


def bibtex(references: tuple[Reference, ...]) -> str:
    """Entries for BibTeX, in the order of their citation."""
    entries = []
    for one in references:
        fields = ",\n".join(f"  {name} = {{{text}}}" for name, text in one.fields.items())
        entries.append(f"@{one.kind}{{{one.key},\n{fields}\n}}\n")
    return "\n".join(entries)


def _figures(report: Report, can_print: bool) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    for k, (name, one) in enumerate(report.shown.items(), start=1):
        stem = f"figures/figure_{k:02d}_{name}"
        if isinstance(one, Drawing):
            # On the page the element needs no namespace; in a file of its own it does.
            found[f"{stem}.svg"] = one.svg.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg"', 1).encode()
        elif isinstance(one, Picture):
            found[f"{stem}.png"] = one.png
        elif can_print:
            # Takes half a second to import, so it is imported only to write a report.
            from explorer.report.printed import figure_data, printed

            found[f"{stem}.csv"] = csv_text(figure_data(name, one.spec)).encode()
            found |= {f"{stem}_{file}": content for file, content in printed(one.spec).items()}
    return found
