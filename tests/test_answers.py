"""Every feature of a scene has every answer, or a documented reason in docs/answers.md."""

import re

import pytest
from answers_table import ANSWERS, EVERYWHERE, FEATURES, MARK, NUMBER, PAGE, cell
from tiers import in_tiers

KEPT = PAGE.read_text().split(MARK)[1]
REASONS = {number: NUMBER.sub("...", why) for number, why in re.findall(r"^(\d+)\. (.*)$", KEPT, re.MULTILINE)}
ACCEPTED = KEPT.partition(EVERYWHERE)[2].partition(".\n")[0].split("; ")
ROWS = {feature: ["yes"] * len(ANSWERS) for feature in ACCEPTED} | {
    feature: marks
    for feature, *marks in (line.strip("| ").split(" | ") for line in KEPT.splitlines() if line.startswith("| "))
}


def test_the_page_has_all_features_and_answers():
    head, *features = [line for line in KEPT.splitlines() if line.startswith("| ")]
    in_table = [row.split(" | ")[0].removeprefix("| ") for row in features]
    assert in_table == [feature for feature in FEATURES if feature not in ACCEPTED]
    assert [feature for feature in FEATURES if feature not in in_table] == ACCEPTED
    assert head == "| | " + " | ".join(ANSWERS) + " |"
    given = [mark for feature in FEATURES for mark in ROWS[feature] if mark != "yes"]
    assert list(dict.fromkeys(given)) == list(REASONS)


@pytest.mark.parametrize("feature", in_tiers(FEATURES, 0, 3))
def test_the_page_is_true(feature):
    given = dict(zip(ANSWERS, ROWS[feature], strict=True))
    found = {answer: NUMBER.sub("...", cell(FEATURES[feature], answer)) for answer in ANSWERS}
    assert found == {answer: REASONS.get(mark, "") for answer, mark in given.items()}
