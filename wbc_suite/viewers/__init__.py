"""How people see and drive a simulation: pages in a browser, pictures, windows."""
