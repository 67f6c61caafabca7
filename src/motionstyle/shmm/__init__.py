"""Style machines (Brand & Hertzmann 2000): stylistic hidden Markov models of motion."""
