"""One QP for the contact forces and accelerations of a robot on its feet."""
