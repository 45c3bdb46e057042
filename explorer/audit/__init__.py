"""The audit of a published study: reading its folder, and saying what was found as text, JSON and a report.

entries.py      TOML entries, with the digits that they are printed with
read_study.py   a folder with its CSV files → `doe.audit.PublishedStudy`, screening … verification included
report.py       the findings as text for a terminal, HTML and Markdown
"""
