"""Pictures, browser pages and windows of simulations."""
