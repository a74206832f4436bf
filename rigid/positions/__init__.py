"""Positions of links: dyads in closed form, and other groups by Newton's method."""

from rigid.positions.link_positions import place
from rigid.positions.rows import select_designs
