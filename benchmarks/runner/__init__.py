"""One runner for benchmarks: suites of jobs, ways to plan them, measured by one protocol, kept as rows (docs/benchmarks.md)."""
