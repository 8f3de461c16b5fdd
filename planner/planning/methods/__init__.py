"""The methods: from a program to a verified plan, one file per method, all judged by the same verifier."""
