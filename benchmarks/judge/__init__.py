"""The verifier and its claims, held against other code."""
