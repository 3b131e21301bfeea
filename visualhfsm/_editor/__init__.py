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
| `answers` | what requests are answered with |
| `views` | the seam of what plug-ins show of a document |
| `jupyter` | how jupyter-server-proxy runs the editor of each user of a JupyterHub |
| `static/` | the page |

Its modules need the packages of the extra `web`.

The page is native ES modules, Lit elements and SVG, without a build step. `data/store.js` holds the data from
the server, by types that are generated from `protocol` (`data/protocol.d.ts`); `shell/actions.js` defines
every user action once, for buttons, menus, palette, keys and help. A change is a command that is sent to the
server; nothing is drawn before the server answers with the automata that changed, since documents are
immutable and shared parts are recognized by identity. User code runs only in child processes. The page's
texts are English in the code (`kit/texts.js`), and gettext catalogs in `visualhfsm/_base/languages/`
(decision 41).

The page's folders stand on one another: `kit/` (buttons, dialogs, keys, texts), `measures/` (the geometry of
a drawing), `data/` (what the server has said), `code/`, `canvas/`, `run/`, `robot3d/`, then `dialogs/`,
`panels/` and `shelf/` side by side, `shell/` around all of them, and `onefile/`, the pages that are a single
file. Only what is imported when it is first needed may stand above.

A click on *State* becomes a change of the document this way:

1. The button performs `newState` (`canvas/actions.js`), the click on the drawing reaches `HfsmCanvas.add`
   (`canvas/canvas.js`), and `data/store.js` sends `{"op": "do", "command": {"command": "addState", ...}}`.
2. `connection` decodes and validates it by its type, and the table in `handlers` leads to `Tab.edit`, which
   executes it in a thread, after earlier requests, by `OpenDocument.apply`: `AddState.apply` makes a new
   document, `UndoStack.do` keeps the step, and the journal gets the command.
3. Every window gets the document (`window`), keeps what has the same text (`data/updates.js`), and
   `Drawing.update` draws the rest before the answer arrives.
4. Once nothing has changed for a moment, `CheckScheduler` has the process of `CheckProcess` check the
   document, of which that reads only the parts again that have changed (`visualhfsm/_document/parts.py`): one
   push `problems` marks code, draws signs and fills the list. What is wrong in a piece of code waits neither
   for what all code does together nor for the model checker, which are given up as soon as something newer is
   to be checked.
"""
