"""MuJoCo's arrays, and the numbers of laws as kernels read them."""
