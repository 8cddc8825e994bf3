"""Tools under the names of robosuite."""
