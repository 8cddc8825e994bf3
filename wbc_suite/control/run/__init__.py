"""All laws of a simulation in one compiled call."""
