"""Football between documents, judged by a referee, and what they see it by; `visualhfsm match` plays a match."""
