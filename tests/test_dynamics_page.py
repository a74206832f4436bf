"""The examples in docs/dynamics.md run, and print the right amplitude."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = (Path(__file__).parent.parent / "docs" / "dynamics.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_examples_run_and_print_the_right_amplitude(capsys):
    names: dict = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        exec(block, names)
    amplitude = float(capsys.readouterr().out.split()[0])
    # Cosine law at the two positions where crank and coupler align.
    square = [0.35**2 + 0.25**2 - side**2 for side in (0.3 + 0.1, 0.3 - 0.1)]
    angles = np.degrees(np.arccos(np.array(square) / (2 * 0.35 * 0.25)))
    assert amplitude == pytest.approx(abs(angles[0] - angles[1]), abs=1e-9)
    assert names["cranks"].shape == (1, 2)
    assert names["energy"][-1] > names["energy"][0]
