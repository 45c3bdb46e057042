"""Text below a control: smaller than its label, and in line with it."""

from __future__ import annotations


def small_html(contents: str) -> str:
    """``contents`` (HTML) in the size and margin of such a text; long words are broken."""
    return f"<div style='padding:0 0.75em; font-size:0.8em; overflow-wrap:anywhere'>{contents}</div>"
