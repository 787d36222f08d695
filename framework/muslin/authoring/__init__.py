"""For those who write assignments: solutions go in, what students receive and are checked against comes out."""
