"""Observations of environments: observables, cameras and rendering."""
