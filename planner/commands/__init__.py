"""The commands of the command line, one file each; `planner.cli` puts them together.

A command imports what it needs itself, when it runs, so that `planner --help` answers at once.
"""
