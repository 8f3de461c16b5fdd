"""From a program to a plan that passed its verdict: jobs, the methods, and what the default method does."""
