"""The editor and monitor in the browser: a server on loopback that one person's page talks to.

| module | content |
|---|---|
| `server` | the routes; socket, address, Ctrl-C |
| `security` | who has access, and to which files |
| `assets` | the page's files |
| `protocol` | the messages on the websocket, as types |
| `connection`, `documents` | one websocket: incoming messages, and the execution of each request |
| `window` | outgoing messages |
| `workspace`, `tab` | the open documents, which every window sees; limits, checks and the services |

Its modules need the packages of the extra `web`.
"""
