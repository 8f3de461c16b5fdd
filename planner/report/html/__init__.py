"""`report.html`: a plan in one file that opens in a browser, off-line."""
