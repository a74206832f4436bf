"""Instability under a load that turns with the link: Beck's column flutters at 20.05 EI / L^2.

Internal damping destabilises the column, down to 10.94 EI / L^2.
References: M. Beck (1952), Die Knicklast des einseitig eingespannten, tangential gedrückten Stabes; V. V. Bolotin and
N. I. Zhinzher (1969), Effects of damping on stability of elastic systems subjected to nonconservative forces.
"""

import pytest
from tiers import in_tiers

from kinelast.runs import computed
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request

CRITICAL = 20.05 * 20.0  # [N]
REST = '{curve = "dwell", duration = "1 s"}'
MOVE = '{curve = "cycloidal", duration = "0.1 s", by = 0.001}, {curve = "dwell", duration = "1 s"}'
COLUMN = """
[sections.bar]
shape = "rigidities"
EA = 2e7
EI = 20
mass_per_length = 0.785
[points]
O = [0, 0]
A = [1, 0]
[links.ground]
points = ["O"]
[links.arm]
points = ["O", "A"]
section = "bar"
[[drives]]
link = "arm"
law = [{law}]
[[loads]]
link = "arm"
point = "A"
force = [{push}, 0.1]
axes = "turning"
[run]
positions = 40
damping_ratio = 1e-4
"""


@pytest.mark.parametrize("law", [REST, MOVE], ids=["at rest", "after a move"])
@pytest.mark.parametrize("theory", in_tiers([None, "elastodynamic", "geometrically-exact"], 2, 1))
def test_a_run_without_cycle_is_unstable_beyond_the_critical_load(theory, law):
    for push, unstable in ((0.5 * CRITICAL, False), (1.05 * CRITICAL, True)):
        text = COLUMN.replace("{law}", law).replace("{push}", f"{-push}")
        results = computed(scene_from_text(text), Request(theory=theory))
        said = "unstable: vibration grows" in results.error_unknown
        assert said == unstable, (push, results.error_unknown)
