"""How people see a simulation: pictures, pages, windows."""
