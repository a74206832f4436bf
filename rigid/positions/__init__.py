"""Positions of links: dyads are solved in closed form, and larger groups by Newton's method."""

from rigid.positions.link_positions import place
from rigid.positions.rows import select_designs
