"""Positions of the links: dyads in closed form, any other group by Newton's method, on the branch of the drawing."""
