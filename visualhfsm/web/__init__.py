"""The editor and monitor in the browser: a server on loopback that one person's page talks to.

| module | what |
|---|---|
| `server` | what is served under which path; socket, address, Ctrl-C |
| `security` | who may come in, and which files they reach |
| `assets` | the page's files |
| `protocol` | the messages on the websocket, as types |
| `connection`, `documents` | one websocket: what comes in and what each request does |
| `window` | what goes out |
| `workspace`, `tab` | the open documents, which every window sees; limits, checks and the services |

Its modules need the packages of the extra `web`.
"""
