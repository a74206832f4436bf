"""Formulas of the pages as MathML: drawn by the browser itself, no script and no network."""

import re
from html import unescape

from latex2mathml.converter import convert

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def drawn(html: str, page: str) -> str:
    """A page's HTML with its formulas as MathML."""

    def mathml(formula: re.Match[str]) -> str:
        latex = unescape(formula[3]).strip()
        try:
            drawn = convert(latex, display="block" if formula[2] == "[" else "inline")
        except Exception as error:
            raise ValueError(f"{page}: formula {latex!r}: {type(error).__name__}: {error}") from error
        return f'<div class="formula" tabindex="0">{drawn}</div>' if formula[2] == "[" else drawn

    return FORMULA.sub(mathml, html)
