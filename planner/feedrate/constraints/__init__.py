"""The limits along the path: each constraint can only tighten, so their order never matters."""
