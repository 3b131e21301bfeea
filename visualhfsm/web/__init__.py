"""The editor and monitor in the browser: a server on loopback that one person's page talks to.

| module | what |
|---|---|
| `command` | `visualhfsm edit` |
| `server` | the life of the server: socket, address, Ctrl-C |
| `app` | what is served under which path |
| `security`, `http_connection`, `limits`, `paths` | who may come in, how much, and which files they reach |
| `assets` | the page's files |
| `protocol` | the messages on the websocket, as types |
| `connection`, `outbox` | one websocket: what comes in, what goes out |
| `operations`, `documents`, `uploads` | what each request does |
| `workspace`, `tab` | the open documents, which every window sees |
| `services` | what running, monitoring and code completion must offer |

Only the command's own module is light: the others need the packages of the extra `web`.
"""
