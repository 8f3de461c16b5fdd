"""`python -m benchmarks.mutants`."""

from benchmarks.mutants import main

if __name__ == "__main__":
    main()
