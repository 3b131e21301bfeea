"""The editor and monitor in the browser: a server on loopback that one person's page talks to.

| module | what |
|---|---|
| `command` | `visualhfsm edit` |
| `server` | what is served under which path; socket, address, Ctrl-C |
| `security`, `paths` | who may come in, and which files they reach |
| `assets` | the page's files |
| `protocol`, `errors` | the messages on the websocket, as types, and what refusals are called |
| `connection`, `window` | one websocket: what comes in, what goes out |
| `operations`, `documents` | what each request does |
| `workspace`, `tab` | the open documents, which every window sees; their limits and their checks |
| `services` | which packages run components, follow them, and help with code |

Only the command's own module is light: the others need the packages of the extra `web`.
"""
