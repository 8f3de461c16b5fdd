"""How long controls take by their own planners: models of these, the time of a program, and settings found from what was measured."""
