"""Controllers of parts of a robot: joints, grippers, stance."""
