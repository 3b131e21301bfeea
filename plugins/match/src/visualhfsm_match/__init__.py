"""Football between documents: matches with a referee, `visualhfsm match`, and what robots see it by."""
