"""What is guessed about robots of foreign files: limbs, grippers, postures, motors."""
