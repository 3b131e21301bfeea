"""The editor and monitor in the browser: a server on loopback that one person's page talks to.

| module | content |
|---|---|
| `server` | the routes; socket, address, Ctrl-C |
| `security`, `resumption`, `launch` | who has access |
| `site` | the path and the names under which browsers find the page |
| `assets` | the page's files |
| `protocol` | the messages on the websocket, as types |
| `connection` | one websocket: incoming messages, and the order in which they are executed |
| `handlers` | what handles each request: `documents`, `edits`, `questions`, `steering` |
| `window`, `windows` | outgoing messages of one window; all windows, and what they follow |
| `tab`, `tabs` | the open documents of the project, as the windows see them |
| `workspace`, `news` | a project, the state that every window sees, and what is reported of it |
| `components` | components and the robot: start, follow, record, stop |
| `check_scheduler`, `code_questions` | checks in the background; help with code that is typed |
| `viewers`, `refusal` | who only looks on; the page that refuses access |
| `parts`, `limits` | the parts of the server beside the documents; what one client may use |

Its modules need the packages of the extra `web`.
"""
