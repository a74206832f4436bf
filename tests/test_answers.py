"""Claim: every feature of a scene goes with every answer, or is refused in a sentence that docs/answers.md gives."""

import pytest
from answers_table import ANSWERS, FEATURES, MARK, PAGE, cells, table

KEPT = PAGE.read_text().split(MARK)[1]


def test_the_page_has_all_features_and_answers():
    rows = [line for line in KEPT.splitlines() if line.startswith("| ")]
    assert [row.split(" | ")[0].removeprefix("| ") for row in rows[2:]] == list(FEATURES)
    assert rows[0].count("|") == len(ANSWERS) + 2


@pytest.mark.slow
def test_the_page_is_true():
    assert table(cells()).strip() == KEPT.strip()
