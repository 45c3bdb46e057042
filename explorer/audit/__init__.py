"""The audit of a published study: reading its folder, and saying what was found as text, JSON and a report.

tables.py, entries.py     CSV cells and TOML entries, with the digits that they are printed with
read_study.py             a folder → `doe.audit.PublishedStudy`;  read_stages.py its screening … verification
sentences.py              the findings as text for a terminal
report.py                 as sections, HTML and Markdown
"""
