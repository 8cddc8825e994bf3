"""Whole-body inverse dynamics: contact forces and joint accelerations by one QP."""
