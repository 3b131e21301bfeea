"""Documents in the dialects of the original editors."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.document import Document, Transition

__all__ = ["SPANISH", "VISUALSTATES", "in_spanish", "in_states", "read", "shape"]

SPANISH: Final = """<?xml version="1.0"?>
<VisualHFSM>
<SubAutomata><idSub>1</idSub><idPadre>0</idPadre>
<Estado estado_inicial="true"><id>1</id><origenX>10</origenX><origenY>20.5</origenY><destinoX>50</destinoX>
<destinoY>60</destinoY><nombre>buscar pelota</nombre><hijo>4</hijo><codigo>a = 1
  b = 2 </codigo><transiciones>
<transicion><box x1="1" y1="2" x2="7" y2="8"/><nombre>vista</nombre><destino>2</destino><codigo>a &lt; b</codigo></transicion>
<transicion><box x1="3" y1="4" x2="9" y2="10"/><nombre></nombre><destino>1</destino><tiempo>500</tiempo></transicion>
</transiciones></Estado>
<Estado estado_inicial="false"><id>2</id><origenX>1</origenX><origenY>2</origenY><destinoX>3</destinoX><destinoY>4</destinoY>
<nombre></nombre><hijo>0</hijo><codigo></codigo><transiciones/></Estado>
<tiempoIteracion>175</tiempoIteracion><Librerias><lib>laser</lib><lib>motor</lib></Librerias>
<variables_aux>a = 0</variables_aux><funciones_aux>def f(self): pass</funciones_aux></SubAutomata>
<SubAutomata><idSub>4</idSub><idPadre>1</idPadre>
<Estado estado_inicial="false"><id>1</id><nombre>x</nombre><hijo>9</hijo><codigo/><transiciones>
<transicion><nombre/><destino>1</destino></transicion></transiciones></Estado>
<Librerias><lib>motor</lib><lib>radar</lib></Librerias></SubAutomata>
<nombreEsquema>/home/someone/esquema</nombreEsquema>
</VisualHFSM>
"""
"""A document of 2013."""

VISUALSTATES: Final = """<?xml version="1.0" ?>
<VisualStates>
  <config type="1">
    <buildDependencies><dependency>rospy</dependency></buildDependencies>
    <topics><topic id="0"><name>/scan</name><type>sensor_msgs/LaserScan</type><opType>Subscribe</opType></topic></topics>
  </config>
  <global_namespace><functions></functions><variables></variables></global_namespace>
  <libraries><library>math</library></libraries>
  <state id="0" initial="True">
    <posx>0.0</posx><posy>0.0</posy><name>root</name><code></code><timestep>50</timestep>
    <namespace>
      <functions>def near(self):
\treturn self.distance &lt; 1</functions>
      <variables>self.distance = 2</variables>
      <parameters>
        <param type="Float" name="speed"><value>0.5</value><description>how fast</description></param>
        <param type="String" name="greeting"><value>it's me</value><description></description></param>
        <param type="Boolean" name="loud"><value>true</value><description></description></param>
        <param type="Quaternion" name="pose"><value>1</value><description></description></param>
      </parameters>
    </namespace>
    <state id="3" initial="true">
      <posx>845.5</posx><posy>970.0</posy><name>search</name><code>self.look()</code><timestep>200</timestep>
      <namespace><functions></functions><variables>self.seen = False</variables></namespace>
      <transition id="9">
        <type>1</type><condition>self.turn()
return self.near()</condition><posx>1.0</posx><posy>2.0</posy><name>found</name>
        <originid>3</originid><destinationid>7</destinationid><code>x = 1</code>
      </transition>
      <state id="5" initial="TRUE"><posx>1</posx><posy>2</posy><name>left</name><code></code><timestep>30</timestep>
        <transition id="2"><type>0</type><time>1500</time><posx>0</posx><posy>0</posy><name></name>
          <originid>5</originid><destinationid>5</destinationid><code></code></transition>
      </state>
    </state>
    <state id="7" initial="False">
      <posx>1</posx><posy>2</posy><name>follow</name><code></code><timestep>50</timestep>
    </state>
  </state>
</VisualStates>
"""
"""A document of VisualStates."""


def read(text: str) -> tuple[Document, list[str]]:
    """Return the document and what was found and remarked, each as code and message."""
    diagnostics = Diagnostics()
    document = parse_document(text, Path("old.xml"), diagnostics, remarks=diagnostics)
    assert document is not None, diagnostics.render()
    return document, [f"{found.code}: {found.message}" for found in diagnostics]


def in_spanish(inside: str) -> Document:
    """Return a document of 2013 with this in its automaton."""
    head = "<VisualHFSM><SubAutomata><idSub>1</idSub>"
    return read(f"{head}{inside}</SubAutomata></VisualHFSM>")[0]


def in_states(inside: str, before: str = "") -> Document:
    """Return a document of VisualStates with these states in its outermost."""
    return read(
        f'<VisualStates>{before}<state id="0" initial="True"><name>root</name>{inside}</state></VisualStates>'
    )[0]


def shape(transition: Transition) -> tuple[object, ...]:
    """Return what a transition is made of."""
    ends = (transition.origin, transition.destination)
    place = (transition.x, transition.y)
    return (transition.id, transition.name, *ends, transition.type, transition.trigger.text, *place)
