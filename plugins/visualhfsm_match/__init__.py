"""Football between documents: matches that a referee judges, `visualhfsm match`, and what robots see it by."""
