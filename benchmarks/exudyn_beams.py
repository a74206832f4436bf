"""Geometrically exact beams in exudyn, started with the motion of rigid links."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from elastic import Section
from rigid import Motion


def add_beam(mbs: Any, begun: Motion, number: int, own: Section, beta: float, elements: int) -> list[Any]:
    """Add the nodes and elements of a beam; return the nodes. They start with the motion of the rigid link."""
    import exudyn.itemInterface

    items = exudyn.itemInterface
    at, beam = begun.mechanism.beams[number]
    start, end = (complex(begun.mechanism.links[at].points[name]) for name in (beam.start, beam.end))
    z, e, speed = (complex(value[at, 0]) for value in (begun.origin, begun.direction, begun.velocity))
    omega, nodes = float(begun.angular_velocity[at, 0]), []
    for xi in np.linspace(0, 1, elements + 1):
        arm = e * (start + xi * (end - start))
        place, moving, angle = z + arm, speed + 1j * omega * arm, float(np.angle(e * (end - start)))
        node = items.NodeRigidBody2D(
            referenceCoordinates=[place.real, place.imag, angle], initialVelocities=[moving.real, moving.imag, omega]
        )
        nodes.append(mbs.AddNode(node))
    mass = float(beam.mass_per_length)
    for pair in pairwise(nodes):
        element = items.ObjectBeamGeometricallyExact2D(
            nodeNumbers=list(pair),
            length=abs(end - start) / elements,
            massPerLength=mass,
            crossSectionInertia=mass * float(own.inertia) / float(own.area),
            bendingStiffness=own.EI,
            axialStiffness=own.EA,
            shearStiffness=own.kGA,
            bendingDamping=beta * own.EI,
            axialDamping=beta * own.EA,
            shearDamping=beta * own.kGA,
            includeReferenceRotations=False,
        )
        mbs.AddObject(element)
    return nodes
