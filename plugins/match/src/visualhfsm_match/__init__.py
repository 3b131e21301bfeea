"""Matches of football between documents, judged by a referee; `visualhfsm match` plays one."""
