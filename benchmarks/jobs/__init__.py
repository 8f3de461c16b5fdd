"""The jobs that tests, benchmarks and notebooks share."""
