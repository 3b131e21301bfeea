#!/bin/sh
# Two of four engines leave a state and enter it again on its own transition to a child; two stay in it.
#
# Setting: the state `move` contains `walk`, where it begins, and `run`; all have entry and exit code, that of `move`
# takes the arms in and lets them go. Two events are of `move` itself: `hurry` leads to `run`, and `again` to `move`.
# Guess: as in SCXML, whose transitions are external unless type="internal" is written: `hurry` leaves `move` and enters
# it again, and so does `again`, which begins at `walk`.
# Seen, with the versions below, from the Python Package Index:
#                                hurry                               again
#   sismic 1.6.14                leaves and enters move              leaves and enters move, is in walk
#   python-statemachine 3.2.2    the same                            the same
#   transitions 0.9.3            stays in move, only walk is left    leaves and enters move, is in walk
#   xstate-statemachine 0.11.0   stays in move, only walk is left    nothing: no exit, no entry, and it still runs
#   the same, reenter=True       stays in move, only walk is left    leaves and enters move, is in walk
# Fails if one of these changes. Needs Python 3.11 and some 30 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile transitions==0.9.3 sismic==1.6.14 python-statemachine==3.2.2 \
    xstate-statemachine==0.11.0
cat >"$folder/tried.py" <<'PYTHON'
import logging
import sys

from sismic.interpreter import Interpreter
from sismic.io import import_from_yaml
from statemachine import State, StateChart
from transitions.extensions import HierarchicalMachine
from xstate_statemachine import MachineLogic, SyncInterpreter, create_machine

NAMES = ("move", "walk", "run")
EVENTS = ("hurry", "again")
logging.disable(logging.CRITICAL)
done = []


def noted(word):
    """Return code of an action that takes what it is given and notes its word."""
    return lambda *_, **__: done.append(word)


def by_transitions():
    states = {name: {"name": name, "on_enter": noted(f"+{name}"), "on_exit": noted(f"-{name}")} for name in NAMES}
    states["move"] |= {"initial": "walk", "children": [states["walk"], states["run"]]}
    machine = HierarchicalMachine(states=[states["move"]], initial="move", auto_transitions=False)
    machine.add_transition("hurry", "move", "move_run")
    machine.add_transition("again", "move", "move")
    return machine.trigger, lambda: machine.state.removeprefix("move_")


def by_sismic():
    code = {name: f"{{name: {name}, on entry: done('+{name}'), on exit: done('-{name}')" for name in NAMES}
    chart = f"""
statechart:
  name: one
  root state:
    name: root
    initial: move
    states:
      - {code["move"]}, initial: walk, states: [{code["walk"]}}}, {code["run"]}}}],
         transitions: [{{event: hurry, target: run}}, {{event: again, target: move}}]}}
"""
    interpreter = Interpreter(import_from_yaml(chart), initial_context={"done": done.append})
    interpreter.execute()
    return lambda event: interpreter.queue(event).execute(), lambda: interpreter.configuration[-1]


def by_statemachine():
    class Chart(StateChart):
        class move(State.Compound):
            walk = State(initial=True, enter=noted("+walk"), exit=noted("-walk"))
            run = State(enter=noted("+run"), exit=noted("-run"))

        hurry = move.to(move.run)
        again = move.to(move)
        on_enter_move = noted("+move")
        on_exit_move = noted("-move")

    chart = Chart()
    return chart.send, lambda: list(chart.configuration)[-1].id


def by_xstate(**more):
    states = {name: {"entry": [f"+{name}"], "exit": [f"-{name}"]} for name in NAMES}
    children = {name: states[name] for name in ("walk", "run")}
    on = {"hurry": {"target": ".run", **more}, "again": {"target": "move", **more}}
    move = states["move"] | {"initial": "walk", "states": children, "on": on}
    logic = MachineLogic(actions={word: noted(word) for name in NAMES for word in (f"+{name}", f"-{name}")})
    chart = create_machine({"id": "one", "initial": "move", "states": {"move": move}}, logic=logic)
    interpreter = SyncInterpreter(chart).start()
    return interpreter.send, lambda: min(interpreter.current_state_ids).rpartition(".")[2]


def by_xstate_with_reenter():
    return by_xstate(reenter=True)


with open(sys.argv[1] + "/seen", "w") as seen:
    for engine in (by_sismic, by_statemachine, by_transitions, by_xstate, by_xstate_with_reenter):
        send, where = engine()
        for event in EVENTS:
            done.clear()
            send(event)
            print(f"{engine.__name__[3:]}, {event}: {' '.join(done) or 'nothing'}; is in {where()}", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
sismic, hurry: -walk -move +move +run; is in run
sismic, again: -run -move +move +walk; is in walk
statemachine, hurry: -walk -move +move +run; is in run
statemachine, again: -run -move +move +walk; is in walk
transitions, hurry: -walk +run; is in run
transitions, again: -run -move +move +walk; is in walk
xstate, hurry: -walk +run; is in run
xstate, again: nothing; is in run
xstate_with_reenter, hurry: -walk +run; is in run
xstate_with_reenter, again: -run -move +move +walk; is in walk
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
