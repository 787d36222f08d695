"""For those who write assignments: a solution goes in; what students receive and meet comes out."""
