"""Makes what the tests of NC programs share importable: `test_agreement` holds the oracle."""
