"""Checks that sections and joints determine the links' statics."""

from collections.abc import Mapping, Sequence

from elastic.beams.compliance import BeamCompliance
from elastic.beams.section import JointCompliance, Section
from elastic.links.beam_trees import BeamTrees
from elastic.links.sliding_blocks import block_places
from rigid import Mechanism, MechanismError, Motion


def require_joints(motion: Motion, joints: Mapping[str, JointCompliance]) -> None:
    """Raise ValueError if a compliant joint is not in the mechanism, or its name is ambiguous."""
    names = [joint.name for joint in motion.structure.joints] if joints else []
    for name in joints:
        if names.count(name) == 0:
            raise ValueError(f'there is no joint "{name}"')
        if names.count(name) > 1:
            raise ValueError(f'"{name}" names {names.count(name)} joints, expected one for a compliance')


def require_prismatic_rails(motion: Motion, trees: BeamTrees, sections: Sequence[Section]) -> None:
    """Raise MechanismError if a slider moves on a tapered beam, as fields beyond its block have no closed form."""
    if all(section.taper is None for section in sections):
        return
    for number, places in zip(trees.rails, block_places(motion, trees), strict=True):
        for place in places:
            if sections[place.beam].taper is not None:
                owner = motion.mechanism.links[motion.mechanism.beams[place.beam][0]].name
                name = motion.structure.joints[number].name
                raise MechanismError(
                    f'slider "{name}": the beam of "{owner}" along its line is tapered, expected a prismatic one',
                    kind="section",
                    links=(owner,),
                    joints=(name,),
                )


def require_soft_rings(mechanism: Mechanism, trees: BeamTrees, compliance: BeamCompliance) -> None:
    """Raise MechanismError if all beams of a link with a ring are rigid: their forces are indeterminate."""
    for cut in trees.cuts:
        numbers = [branch.number for branch in trees.trees[cut.link]]
        if not any(part[numbers].any() for part in (compliance.stretch, compliance.bend, compliance.shear)):
            name = mechanism.links[cut.link].name
            raise MechanismError(
                f'link "{name}": its beams close a ring and are all rigid, which leaves their forces open: omit one'
            )
