"""Figures and limits as functions of the drive speed."""
