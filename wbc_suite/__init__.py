"""Whole-body control toolkit on MuJoCo, Pinocchio, mink and QP solvers."""

__version__ = "0.1.0"
