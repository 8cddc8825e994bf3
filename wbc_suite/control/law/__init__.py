"""Control laws: one module for each, with its kernel."""
