"""Every feature of a scene has every answer, or a documented reason in docs/answers.md."""

import pytest
from answers_table import ANSWERS, EVERYWHERE, FEATURES, MARK, NUMBER, PAGE, cell
from tiers import in_tiers

KEPT = PAGE.read_text().split(MARK)[1]
ACCEPTED = KEPT.partition(EVERYWHERE)[2].partition(".\n")[0].split("; ")
CELLS = [line.strip("| ").split(" | ") for line in KEPT.splitlines() if line.startswith("| ")][1:]
ROWS = [(feature, answers, why) for features, answers, why in CELLS for feature in features.split("; ")]


def test_the_page_has_all_features_and_answers():
    refused = {feature for feature, _, _ in ROWS}
    assert [feature for feature in FEATURES if feature not in refused] == ACCEPTED
    assert refused <= set(FEATURES)
    assert {answer for _, answers, _ in ROWS for answer in answers.split(", ")} <= set(ANSWERS)


@pytest.mark.parametrize("feature", in_tiers(FEATURES, 0, 3))
def test_the_page_is_true(feature):
    refused = {
        answer: NUMBER.sub("...", why) for row, answers, why in ROWS if row == feature for answer in answers.split(", ")
    }
    found = {answer: NUMBER.sub("...", cell(FEATURES[feature], answer)) for answer in ANSWERS}
    assert found == {answer: refused.get(answer, "") for answer in ANSWERS}
