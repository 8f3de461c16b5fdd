"""One job planned many times: what if a limit were another, and tables over ranges of limits."""
