"""Makes what the tests of NC programs share importable: `oracle`, `test_agreement`."""
