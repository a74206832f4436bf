"""The answer to a scene: its deflection by the theory of motion that is accurate enough, with errors and checks."""
