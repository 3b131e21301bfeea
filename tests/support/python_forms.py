"""Forms of Python from which `random_python` composes programs.

The last line of a form is its expression, unless the form is a statement; lines before it come first. Holes:

- a letter, as `$x`: a new name; `$t`: the target of an assignment, a name or an attribute;
- `$text`: the name of the event that is to be sent, or a text; `$part`: its second half, which may be a number,
  a truth value or None; `$word`, `$tail`, `$whole`: its first half, second half and all of it, within a literal;
- `$value`: an expression of the kind that is wanted; `$other`: another such value; `$true`, `$false`: truth values;
- `$send`: what sends the text that it is called with; `$thunk`: what sends the event when it is called; `$do`: an
  expression, and `$act` a statement, that sends it; `$me`: the component; `$owner`, `$op`: the object and the
  name of the operation that sends; `$base`: that operation as it is usually written;
- `$read`: what a guard reads; `$flaky`: a truth value that is False the first time and True the second.
"""

from __future__ import annotations

from typing import Final, NamedTuple

__all__ = [
    "FORMS",
    "Form",
]


class Form(NamedTuple):
    """A form, with what it needs among the functions of the document and the variables of its automaton."""

    code: str
    functions: str = ""
    variables: str = ""


_Forms = list[Form | str]

_SAY: Final = "def $f(self, word='decoy'):\n    $send(word)"


def _class(method: str, use: str) -> str:
    """Return a class whose special method acts, and a use of it."""
    return f"class $C:\n    def {method}:\n        $act\n{use}"


VALUES: _Forms = [
    "[$other, $value][1]", "($other, $value)[-1]", "{'k': $value}['k']", "dict(k=$value)['k']",
    "{1: $other, 2: $value}.get(2)", "{'a': $value}.setdefault('a', $other)", "{'a': $value}.popitem()[1]",
    "[$value].pop()", "next(iter([$value]))", "($value if $true else $other)",
    "($other if $false else $value)", "($false and $other or $value)", "(lambda: $value)()",
    "(lambda v=$value: v)()", "(lambda v=$other: v)($value)", "(lambda v=$other: v)(*[$value])",
    "(lambda v=$other: v)(**{'v': $value})", "(lambda *a: a[-1])($other, $value)",
    "(lambda **k: k['v'])(v=$value)", "(lambda v, /, w=$other: w)(1, $value)", "[v for v in [$value]][0]",
    "[v for i, v in enumerate([$other, $value]) if i][0]", "{0: v for v in [$value]}[0]",
    "next(v for w in [[$value]] for v in w)", "[*[$value]][0]", "{**{'v': $value}}['v']",
    "list(zip([1], [$value]))[0][1]", "next(map(lambda v: v, [$value]))",
    "next(filter(lambda v: True, [$value]))", "functools.reduce(lambda a, b: b, [$other, $value])",
    "functools.partial(lambda v: v, $value)()", "operator.itemgetter(1)([$other, $value])",
    "operator.attrgetter('v')(types.SimpleNamespace(v=$value))", "types.SimpleNamespace(v=$value).v",
    "getattr(types.SimpleNamespace(v=$value), 'v', $other)", "getattr(1, 'v', $value)",
    "collections.deque([$other, $value]).pop()", "collections.namedtuple('N', 'v')($value).v",
    "collections.ChainMap({}, {'v': $value})['v']", "collections.defaultdict(lambda: $value)['v']",
    "copy.copy([$value])[0]", "next(itertools.chain([$value]))", "next(itertools.repeat($value))",
    "list(itertools.islice([$other, $value], 1, None))[0]", "max([$value], key=lambda _: 0)",
    "sorted([$other, $value], key=lambda v, c=itertools.count(): next(c))[1]",
    "min([(0, $value)], key=operator.itemgetter(0))[1]",
    "contextvars.ContextVar('v', default=$value).get()", "($x := $value)",
    "(($x := $other), ($x := $value), $x)[2]", "vars(types.SimpleNamespace(v=$value))['v']",
    "eval('v', {'v': $value})", "[$value, $other][-2:][0]", "([$value] + [$other])[0]", "([$value] * 2)[1]",
    "dict([('v', $value)])['v']", "dict(zip('v', [$value]))['v']", "list({'v': $value}.values())[0]",
    "(lambda f: f())(lambda: $value)", "(lambda v: (lambda: v))($value)()",
    "[[$other, $value][i] for i in (1,)][0]",
    Form("self.$f($value)", "def $f(self, value='decoy'):\n    return value"),
    Form("self.$f($other, $value)", "def $f(self, *values, last=None):\n    return values[-1]"),
    Form("self.$f(value=$value)", "def $f(self, value='decoy', **others):\n    return value"),
    Form("self.$f(*[$value])", "def $f(self, value='decoy'):\n    return value"),
    Form("self.$f($value)", "@staticmethod\ndef $f(value='decoy'):\n    return value"),
    Form("self.$f($value)", "@classmethod\ndef $f(cls, value='decoy'):\n    return value"),
    Form("self.$f($value)", "@functools.lru_cache\ndef $f(self, value='decoy'):\n    return value"),
    Form("self.$f()($value)", "def $f(self):\n    return lambda value='decoy': value"),
    Form(
        "self.$f($other, $value)",
        "def $f(self, first, second='decoy'):\n    first, second = second, first\n    return first",
    ),
    Form("self.$f($value)\nself.$a", "def $f(self, value='decoy'):\n    self.$a = value"),
    Form("self.$f([$value])", "def $f(self, values=()):\n    for value in values:\n        return value"),
    Form("self.$C($value).v", "class $C:\n    def __init__(self, v='decoy'):\n        self.v = v"),
    Form(
        "self.$f($value)\nself.$f()",
        "def $f(self, value=None, kept=[]):\n    kept.append(value)\n    return kept[0]",
    ),
    "def $f(v=$value):\n    return v\n$f()", "def $f(v=$other):\n    return v\n$f(v=$value)",
    "def $f():\n    yield $other\n    yield $value\n[*$f()][1]",
    "def $f():\n    yield from [$value]\nnext($f())",
    "def $f():\n    return (yield)\n$g = $f()\nnext($g)\ntry:\n    $g.send($value)\nexcept StopIteration as $e:\n    $x = $e.value\n$x",
    "class $C:\n    v = $other\n$C.v = $value\n$C.v",
    "class $C:\n    def __init__(me, v):\n        me.v = v\n    @property\n    def w(me):\n        return me.v\n$C($value).w",
    "@dataclasses.dataclass\nclass $C:\n    v: object = None\n$C($value).v",
    "$x = $value\nclass $C(enum.Enum):\n    V = [$x]\n$C.V.value[0]",
    "$x = $value\nclass $C:\n    def __getattr__(me, name):\n        return $x\n$C().anything",
    "@contextlib.contextmanager\ndef $f():\n    yield $value\nwith $f() as $x:\n    pass\n$x",
    "$q = queue.SimpleQueue()\n$q.put($value)\n$q.get()",
    "$x = $other\ndef $f():\n    nonlocal $x\n    $x = $value\n$f()\n$x",
    "def $f():\n    global $x\n    $x = $value\n$f()\n$x",
    "try:\n    raise ValueError($value)\nexcept ValueError as $e:\n    $x = $e.args[0]\n$x",
    "$x = $value\n$y = $x\n$x = $other\n$y", "$x = [$other]\n$x[0] = $value\n$x[0]",
    "$x = {}\n$x['v'] = $value\n$x['v']", "$x = []\n$x.append($value)\n$x[-1]",
    "$x = []\n$x += [$value]\n$x[0]", "$x = $other\n$y = $value\n$x, $y = $y, $x\n$x",
    "$x = [1, $other]\n$x[1:] = [$value]\n$x[1]", "$x = $value\n@lambda f: $x\ndef $f():\n    pass\n$f",
    "async def $f():\n    return $value\n$c = $f()\ntry:\n    $c.send(None)\nexcept StopIteration as $e:\n    $x = $e.value\n$x",
    "$x = ($value,)\n$y, = $x\n$y", "$x = {'v': $other}\n$x |= {'v': $value}\n$x['v']",
    "$x = $value\n(lambda: $x)()",
    "def $f(*a, **k):\n    return [*a, *k.values()][-1]\n$f($other, v=$value)",
    "$x = [$other, $value]\ndel $x[0]\n$x[0]",
]  # fmt: skip
"""Expressions of the same value as `$value`, of any kind."""

ASSIGNMENTS: _Forms = [
    "$t = $value", "$x = $t = $value", "$t, $x = $value, $other", "$x, $t = $other, $value",
    "[$x, $t] = [$other, $value]", "*$x, $t = $other, $value", "$t, *$x = $value,",
    "$x, ($t, $y) = 1, ($value, 2)", "for $t in [$value]:\n    pass",
    "for $x, $t in enumerate([$value]):\n    pass", "for $t in iter([$other, $value]):\n    pass",
    "with contextlib.nullcontext($value) as $t:\n    pass", "while True:\n    $t = $value\n    break",
    "if $true:\n    $t = $value\nelse:\n    $t = $other",
    "try:\n    1 / 0\nexcept ZeroDivisionError:\n    $t = $value",
    "try:\n    $t = $value\nfinally:\n    pass", "del $t\n$t = $value",
    "match [$value]:\n    case [$x]:\n        $t = $x", "$x = lambda: $value\n$t = $x()",
    "$x = $value\n$t = $x", "if $false:\n    $t = $other\nelse:\n    $t = $value",
    "$x = [$value]\n$t = $x.pop()", "$t = $t, $value\n$t = $t[1]",
]  # fmt: skip
"""Statements that give `$value` to `$t`."""
NAME_ASSIGNMENTS: _Forms = [
    *ASSIGNMENTS, "($t := $value)", "match $value:\n    case $t:\n        pass",
    "[$t := w for w in [$value]]", "def $f():\n    nonlocal $t\n    $t = $value\n$f()",
    "match {'v': $value}:\n    case {'v': $t}:\n        pass",
]  # fmt: skip
ATTRIBUTE_ASSIGNMENTS: _Forms = [
    *ASSIGNMENTS, "setattr(self, '$a', $value)", "vars(self)['$a'] = $value",
    "vars(self).update($a=$value)", "self.__dict__['$a'] = $value",
    "object.__setattr__(self, '$a', $value)", "$m = $me\n$m.$a = $value", "$me.$a = $value",
    "operator.setitem(vars(self), '$a', $value)", "for $c in [self]:\n    $c.$a = $value",
    "self.__init__.__self__.$a = $value", "[setattr(c, '$a', $value) for c in [self]]",
    "(lambda c, v: setattr(c, '$a', v))(self, $value)", "def $f(self):\n    self.$a = $value\n$f(self)",
    Form("self.$f($value)", "def $f(self, v='decoy'):\n    self.$a = v"),
    Form("self.$f()", "def $f(self):\n    self.$a = $value"),
    "class $C:\n    def put(me, c):\n        c.$a = $value\n$C().put(self)",
]  # fmt: skip
"""The same for a name, and for the attribute `$a` of the component."""

TEXTS: _Forms = [
    "'$whole'", "'$word' + str($part)", "'$word{}'.format($part)", "'$word{0!s}'.format($part)",
    "'$word%s' % $part", "'%s%s' % ('$word', $part)", "''.join(['$word', str($part)])",
    "''.join(map(str, ('$word', $part)))", "$x = $part\nf'$word{$x}'", "$x = $part\nf'$word{$x!s}'",
    "$x = '$word'\n$y = $part\nf'{$x}{$y}'", "$x = $part\nf'{\"$word\"}{$x}'",
    "$x = $true\nf'$word{\"$tail\" if $x else 1}'", "$x = $true\nf'$word{($x and \"$tail\") or 5}'",
    "$x = str($part)\nf'$word{$x:>1}'", "'$whole|decoy'.split('|')[0]", "'xx$whole'[2:]",
    "'$whole '.strip()", "'$word#'.replace('#', str($part))", "operator.add('$word', str($part))",
    "'$word'.__add__(str($part))", "b'$whole'.decode()", "''.join(reversed('$whole'[::-1]))",
    "str.format('{w}{p}', w='$word', p=$part)", "''.join(c for c in '$whole')", "max('', '$whole')",
    "re.sub('z', '', 'z$whole')", "json.loads('\"$whole\"')", "('decoy', '$whole')[bool($true)]",
    "'$whole'.partition('|')[0]", "format('$whole', '')", "$x = '$word'\n$x += str($part)\n$x",
    "$x = ''\nfor $y in '$whole':\n    $x += $y\n$x", "'$word{p}'.format_map({'p': $part})",
    "functools.reduce(operator.add, '$whole')", "$x = 'decoy'\n$x = $x.replace('decoy', '$whole')\n$x",
    "min(['$whole'])", "sorted(['$whole'])[0]",
    "next(w for w in dir(types.SimpleNamespace(**{'$whole': 1})) if w[0] != '_')", "[*{'$whole': 1}][0]",
    "$x = $part\n''.join(f'$word{p}' for p in [$x])", "str(collections.UserString('$whole'))",
    "'decoy$whole'.removeprefix('decoy')",
    Form("self.$f($part)", "def $f(self, part=5):\n    return f'$word{part}'"),
    Form("self.$f()", "def $f(self):\n    return '$whole'"), Form("self.$f", "$f = '$whole'"),
    Form("self.$f", "@property\ndef $f(self):\n    return '$whole'"),
    Form("$x + str($part)", "", "$x = '$word'"), Form("f'$word{$x}'", "", "$x = 5\n$x = $part"),
    Form("$x[1]", "", "$x = ['decoy', '$whole']"), Form("$x['b']", "", "$x = {'a': 'decoy', 'b': '$whole'}"),
    Form("$x.get('b', 'decoy')", "", "$x = {'b': '$whole'}"), Form("$x.get('c', '$whole')", "", "$x = {'a': 'decoy'}"),
    Form("$x[0]", "", "$x = ['decoy']\n$x[0] = '$whole'"), Form("$x[0]", "", "$x = ['decoy']\n$y = $x\n$y[0] = '$whole'"),
    Form("$x[-1]", "", "$x = ['decoy']\n$x.append('$whole')"), Form("$x[1]", "", "$x = ['decoy']\n$x += ['$whole']"),
    Form("$x[0]", "", "$x = ['decoy']\ndef $f(a):\n    a[0] = '$whole'\n$f($x)"),
    Form("$x[0]", "", "$x = ['decoy']\nfor $y in [$x]:\n    $y[0] = '$whole'"),
    Form("$x[0]", "", "$x = ['decoy']\n$f = $x.insert\n$f(0, '$whole')"),
    Form("$x['k']", "", "$x = {'k': 'decoy'}\n$x |= {'k': '$whole'}"),
    Form("$x['k'][0]", "", "$x = {'k': ['decoy']}\n$x['k'][0] = '$whole'"),
    Form("self.$a[0]", "$a = ['$whole']"), Form("self.$a[0]", "$a = ['decoy']\n$b = $a\n$b[0] = '$whole'"),
    Form("self.$a[0]", "$a = ['decoy']\ndef $f(self, b=$a):\n    b[0] = '$whole'", "self.$f()"),
    Form("self.$a['x']", "", "self.$a = {'x': 'decoy'}\ngetattr(self, '$a')['x'] = '$whole'"),
    Form("self.$a[0]", "", "self.$a = ['decoy']\nvars(self)['$a'][0] = '$whole'"),
    Form("self.$a[0]", "", "self.$a = ['decoy']\n$x = 'a'\ngetattr(self, $x + '$a'[1:], self.$a)[0] = '$whole'"),
    "$x = ['decoy', '$whole']\nfor $i, $y in enumerate($x):\n    pass\n$y",
    "$x = {'k': '$whole'}\nfor $i, $y in $x.items():\n    pass\n$y", "$x = {'$whole': 1}\nfor $y in $x:\n    pass\n$y",
    "$x = ['$whole']\nrandom.choice($x)", "$x = ['$whole']\n[$y for $y in $x][0]",
    Form("self.$f(1)", "def $f(self, n):\n    if n:\n        return '$whole'\n    return 'decoy'"),
    Form("self.$f(1) or 'decoy'", "def $f(self, n):\n    if n:\n        return '$whole'"),
    Form("self.$f(2)", "def $f(self, n, w=''):\n    return self.$f(n - 1, '$whole') if n else w"),
    Form("self.$f()[0]", "def $f(self):\n    return ['$whole', 'decoy']"),
    Form("self.$f()", "def $f(self):\n    try:\n        return 'decoy'\n    finally:\n        return '$whole'"),
    Form("self.$f()", "def $f(self):\n    for w in ('$whole', 'decoy'):\n        return w"),
    "'$word%s' % ($part,)", "$x = $part\n'$word%d' % $x if isinstance($x, int) else '$whole'", "$x = '$word'\n$x += f'{$part}'\n$x",
    "$x = 3\nf'$word{$x}'[:-1] + str($part)",
]  # fmt: skip
PARTS: _Forms = [
    "$literal",
]

TRUE: _Forms = [
    "True", "1", "'x'", "not $false", "($true and $true)", "($false or $true)", "1 < 2 <= 2", "len([1])",
    "not []", "isinstance(1, int)", "any([$false, $true])", "1 in [1]", "self is not None",
    "not ($false and $true)", "(1, 2) == (1, 2)", "0.1 + 0.2 != 0.3", "float('nan') != float('nan')",
    "'' in 'x'", "bool($true)", "callable(len)", "not not $true", "1 == True", "...", "b'x'", "~0", "-1",
]  # fmt: skip
FALSE: _Forms = [
    "False", "0", "''", "not $true", "($true and $false)", "($false or $false)", "1 < 2 < 2", "len([])",
    "None", "[] is None", "all([$true, $false])", "1 not in [1]", "math.nan == math.nan", "bool($false)",
    "'a' == b'a'", "0.0", "(1 if $false else 0)",
]  # fmt: skip

ME: _Forms = [
    "self", "self.send.__self__", Form("self.$f()", "def $f(self):\n    return self"), "$x = self\n$x",
    "self.$a = self\nself.$a", "self.__init__.__self__", "$x = [self]\n$x[0]",
    Form("self.$f", "@property\ndef $f(self):\n    return self"), "weakref.ref(self)()",
    "try:\n    self.nothing\nexcept AttributeError as $e:\n    $x = $e.obj\n$x",
    "(lambda self: self)(self)", "(self, inspect.currentframe())[1].f_locals['self']",
]  # fmt: skip

SENDS: _Forms = [
    "$base", "(lambda w: $send(w))", "(lambda w=$other, *_: $send(w))", "functools.partial($send)",
    "getattr($owner, '$op')", "operator.attrgetter('$op')($owner)", "$owner.__getattribute__('$op')",
    "$owner.$op", "functools.partial(type($owner).$op, $owner)", "(lambda w: type($owner).$op($owner, w))",
    "(lambda w, o=$owner: operator.methodcaller('$op', w)(o))", "(lambda f: lambda w: f(w))($send)",
    "getattr($owner, '$op'[:2] + '$op'[2:])", "types.MethodType(lambda me, w: $send(w), 1)",
    "(lambda w: [f(w) for f in [$send]])", "(lambda w: next(map($send, [w])))", "functools.cache($send)",
    "operator.methodcaller('__getattribute__', '$op')($owner)", Form("self.$f", _SAY),
    Form("self.$f", "def $f(self, *words):\n    $send(*words)"),
    Form("self.$f", "def $f(self, word='decoy', *rest, **more):\n    $send(word)"),
    Form(
        "functools.partial(self.$f, $owner)",
        "@staticmethod\ndef $f(who, word='decoy'):\n    who.$op(word)",
    ),
    Form(
        "self.$f",
        "def $d(f):\n    @functools.wraps(f)\n    def call(*a, **k):\n        return f(*a, **k)\n    return call\n\n@$d\n" + _SAY,
    ),
    Form("self.$g", _SAY + "\n$g = $f"), Form("self.$f", "$f = lambda self, word='decoy': $base(word)"),
    Form("self.$f()", "def $f(self):\n    def say(word='decoy'):\n        $send(word)\n    return say"),
    Form(
        "self.$f",
        "def $f(self, word='decoy', depth=2):\n    if depth:\n        self.$f(word, depth - 1)\n    else:\n        $send(word)",
    ),
    Form("self.$f", "@functools.singledispatchmethod\ndef $f(self, word='decoy'):\n    $send(word)"),
    Form("self.$f", "class $D:\n    def __get__(me, self, kind):\n        return $owner.$op\n\n$f = $D()"),
    Form("self.$f", "@property\ndef $f(self):\n    return $send"),
    Form("self.$f", "@functools.cached_property\ndef $f(self):\n    return $send"),
    Form("self.$f", "def $f(self, word='decoy'):\n    word = word or 'decoy'\n    $send(word)"),
    Form("self.$g", _SAY + "\n\ndef $g(self, word='decoy'):\n    self.$f(word)"),
    Form("self.$g", _SAY + "\n\ndef $g(self, *a, **k):\n    self.$f(*a, **k)"),
    Form("self.$g", _SAY + "\n$g = functools.partialmethod($f)"), "$x = $send\n$x",
    Form("$x", "", "def $x(word='decoy'):\n    $send(word)"), Form("$x", "", "$x = $send"),
    Form("self.$a", "", "self.$a = $send"), "def $f(w=$other):\n    $send(w)\n$f",
    "def $f(*a, **k):\n    $send(*a, **k)\n$f",
    "class $C:\n    def __call__(me, w='decoy'):\n        $send(w)\n$C()",
    "class $C:\n    def say(me, w='decoy'):\n        $send(w)\n$C().say",
    "def $g():\n    while True:\n        $send((yield))\n$h = $g()\nnext($h)\n$h.send",
    "def $f(w, n=2):\n    return $f(w, n - 1) if n else $send(w)\n$f",
    "$x = $send\ndef $f(w='decoy'):\n    $x(w)\n$f",
    "$x = str\ndef $f(w='decoy'):\n    $x(w)\n$x = $send\n$f",
    Form(
        "self.$C($owner).say",
        "class $C:\n    def __init__(me, kept):\n        me.kept = kept\n\n    def say(me, word='decoy'):\n        me.kept.$op(word)",
    ),
    Form("self.$f", "def $f(self, word='decoy', *, more='decoy'):\n    more = word\n    $send(more)"),
    Form("self.$f", "def $f(self, word='decoy'):\n    self.$a = word\n    $send(self.$a)\n$a = 'decoy'"),
    Form("self.$f", "def $f(self, word='decoy'):\n    for each in ('decoy', word):\n        kept = each\n    $send(kept)"),
    Form("self.$f", "def $f(self, word='decoy'):\n    word = word if word else 'decoy'\n    $send(f'{word}')"),
    Form(
        "self.$f",
        "def $f(self, word='decoy', more=''):\n    self.$f(word, more + 'x') if len(more) < 3 else $send(word)",
    ),
]  # fmt: skip
THUNKS: _Forms = [
    "(lambda: $send($text))", "functools.partial($send, $text)", "(lambda f=$send, w=$text: f(w))",
    "(lambda: $do)", Form("self.$f", "def $f(self):\n    $act"),
    Form("self.$f", "def $f(self, *_, **__):\n    $act"), "def $f():\n    $act\n$f",
    "def $f(w=$text):\n    $send(w)\n$f", "functools.partial(operator.methodcaller('$op', $text), $owner)",
    "map($send, [$text]).__next__", "types.MethodType($send, $text)",
    Form("functools.partial(self.$f, word=$text)", _SAY), Form("functools.partial(self.$f, $text)", _SAY),
    "functools.partial(map($send, [$text]).__next__)",
    Form("self.$f($text)", "def $f(self, word='decoy'):\n    return lambda: $send(word)"),
    "(lambda w: (lambda: $send(w)))($text)", "[lambda w=w: $send(w) for w in [$text]][0]",
    "$x = $text\n(lambda: $send($x))", "functools.partial((lambda f, w: f(w)), $send, $text)",
]  # fmt: skip
DOES: _Forms = [
    "$send($text)", "$thunk()", "$send(*[$text])", "$send(*($text,))", "$owner.$op($text)",
    "getattr($owner, '$op')($text)", Form("self.$f(**{'word': $text})", _SAY),
    Form("self.$f(word=$text)", _SAY), Form("self.$f(*[$text])", _SAY),
    Form("type(self).$f(self, $text)", _SAY),
    Form("self.$f(1, *[$text])", "def $f(self, n, word='decoy'):\n    $send(word)"),
    Form("type(self).$f(self, 'z', $text)", "def $f(self, a, word='decoy'):\n    $send(word)"),
    Form("self.$f(word=$text)", "def $f(self, *, word='decoy'):\n    $send(word)"),
    Form("self.$f(other=$text)", "def $f(self, word='decoy', **more):\n    $send(more['other'])"),
    Form("self.$f('x', $text)", "def $f(self, word='decoy', *more):\n    $send(more[0])"),
    Form("self.$f.__func__(self, $text)", _SAY),
    Form("self.$f($owner, $text)", "def $f(self, who, word='decoy'):\n    who.$op(word)"),
    Form("self.$f($send, $text)", "def $f(self, say, word='decoy'):\n    say(word)"),
    Form("self.$f($thunk)", "def $f(self, call=dict):\n    call()"),
    Form("self.$f(say=$send)($text)", "def $f(self, say=str):\n    return say"),
    "list(map($send, [$text]))", "[$send(w) for w in [$text]]", "[f() for f in [$thunk]]",
    "{w: $send(w) for w in [$text]}", "any($send(w) for w in [$text])", "[0 for w in [$text] if $send(w)]",
    "list(filter($send, [$text]))", "sorted([$text], key=$send)", "max([$text], key=$send)",
    "functools.reduce(lambda a, w: $send(w), [$text], 0)", "[*itertools.starmap($send, [[$text]])]",
    "[*itertools.takewhile($send, [$text])]", "[*itertools.accumulate([0, $text], lambda a, w: $send(w))]",
    "next(itertools.dropwhile($send, [$text]), 0)", "[*itertools.groupby([$text], $send)]",
    "operator.call($send, $text)", "operator.methodcaller('$op', $text)($owner)",
    "($true and $send($text))", "($false or $thunk())", "($thunk() if $true else 0)",
    "{'a': $thunk}['a']()", "{'a': $send, 'b': str}['a']($text)", "next(iter($thunk, 1))",
    "$x = $thunk\nf'{$x()}'", "re.sub('.+', lambda m: $send(m[0]) or '', $text)",
    "json.loads('{}', object_hook=lambda _: $thunk())", "collections.defaultdict($thunk)['x']",
    "eval('f()', {'f': $thunk})", "exec('f()', {'f': $thunk})",
    "print($thunk(), end='', file=io.StringIO())", "isinstance($thunk(), int)", "$thunk.__call__()",
    "[$thunk()][0]", "(not $thunk())", "('%s' % $thunk())", "(-($thunk() or 0))", "($thunk() is None)",
    "(1 < ($thunk() or 2) < 3)", "[1, 2][$thunk() or 0]", "(lambda f, w: f(w))($send, $text)",
    "(lambda f, *a, **k: f(*a, **k))($send, $text)", "(lambda self: self.$op($text))($owner)",
    "[*(lambda: (yield $thunk()))()]", "sum(1 for _ in map($send, [$text]))", "{*map($send, [$text])}",
    "[*zip(map($send, [$text]))]", "str($thunk())", "slice($thunk())",
    "(lambda: [f for f in [$thunk]])()[0]()", "($x := $send)($text)", "bool($thunk())",
    "[f(w) for f, w in [($send, $text)]]", "[f(*a) for f, a in {$send: ($text,)}.items()]",
    "dict(a=$send)['a']($text)", "super(type(self), self).send($text)",
]  # fmt: skip
ACTS: _Forms = [
    "$do", "if $true:\n    $act\nelse:\n    pass", "if $false:\n    pass\nelse:\n    $act",
    "for $x in range(3):\n    $act", "for $x in [$text]:\n    $send($x)",
    "for $x in ('decoy', $text):\n    $send($x)",
    "for $f, $x in [(len, 'decoy'), ($send, $text)]:\n    $f($x)", "while True:\n    $act\n    break",
    "try:\n    $act\nfinally:\n    pass", "try:\n    raise KeyError\nexcept KeyError:\n    $act",
    "try:\n    pass\nfinally:\n    $act",
    "try:\n    raise ValueError($text)\nexcept ValueError as $e:\n    $send($e.args[0])",
    "try:\n    raise ValueError($send)\nexcept ValueError as $e:\n    $e.args[0]($text)",
    "try:\n    raise ExceptionGroup('x', [ValueError($thunk)])\nexcept* ValueError as $e:\n    $e.exceptions[0].args[0]()",
    "with contextlib.ExitStack() as $s:\n    $s.callback($send, $text)",
    "with contextlib.suppress(KeyError):\n    $act",
    "with contextlib.closing(types.SimpleNamespace(close=$thunk)):\n    pass",
    "with contextlib.nullcontext($send) as $f:\n    $f($text)",
    "@contextlib.contextmanager\ndef $f():\n    yield\n    $act\nwith $f():\n    pass",
    "class $C:\n    def __enter__(me):\n        $act\n    def __exit__(me, *_):\n        pass\nwith $C():\n    pass",
    "class $C:\n    def __enter__(me):\n        return $send\n    def __exit__(me, *_):\n        pass\nwith $C() as $f:\n    $f($text)",
    _class("__init__(me)", "$C()"), _class("__del__(me)", "$C()"),
    _class("__getattr__(me, name)", "$C().go"), _class("__eq__(me, other)", "$C() == 1"),
    _class("__iter__(me)", "try:\n    [*$C()]\nexcept TypeError:\n    pass"),
    _class("__getitem__(me, key)", "$C()[0]"), _class("__add__(me, other)", "$C() + 1"),
    _class("__contains__(me, x)", "1 in $C()"), _class("__setattr__(me, name, value)", "$C().x = 1"),
    _class("__init_subclass__(cls)", "class $D($C):\n    pass"),
    _class("__set_name__(me, owner, name)", "class $D:\n    x = $C()"),
    _class("__iadd__(me, other)", "$x = $C()\n$x += 1"),
    "class $C:\n    @property\n    def go(me):\n        $act\n$C().go",
    "class $C:\n    def __bool__(me):\n        $act\n        return True\nif $C():\n    pass",
    "class $C:\n    def __str__(me):\n        $act\n        return ''\nf'{$C()}'",
    "$f = $thunk\nclass $C:\n    x = $f()",
    "class $C(type):\n    def __call__(me):\n        $act\nclass $D(metaclass=$C):\n    pass\n$D()",
    "@lambda f: f()\ndef $f():\n    $act", "def $f(x=$thunk()):\n    pass",
    "$x = $thunk\ndef $f(v: $x() = 1):\n    pass\n$x()",
    "@lambda f: f($text)\ndef $f(w='decoy'):\n    $send(w)", "def $g():\n    yield $thunk()\n[*$g()]",
    "def $g():\n    $act\n    yield\nnext($g())",
    "def $g():\n    try:\n        yield\n    finally:\n        $act\n$h = $g()\nnext($h)\n$h.close()",
    "def $g():\n    yield $send\nfor $f in $g():\n    $f($text)",
    "async def $f():\n    $act\ntry:\n    $f().send(None)\nexcept StopIteration:\n    pass",
    "threading.Timer(0.0, $send, [$text]).start()", "threading.Timer(0.01, $thunk).start()",
    "threading.Thread(target=$send, args=($text,)).start()", "threading.Thread(target=$thunk).start()",
    "class $T(threading.Thread):\n    def run(me):\n        $act\n$T().start()",
    "with concurrent.futures.ThreadPoolExecutor() as $p:\n    $p.submit($send, $text)",
    "weakref.finalize(type('T', (), {})(), $send, $text)", "assert not $send($text)", "$x = $do",
    "self.$a: object = $do", "match $text:\n    case $x:\n        $send($x)",
    "$f = $thunk\nmatch 1:\n    case 1 if $f():\n        pass",
    "match [$send, $text]:\n    case [$f, $x]:\n        $f($x)", "def $f():\n    $act\n$f()",
    "def $f(n):\n    if n:\n        $f(n - 1)\n    else:\n        $act\n$f(2)", "$x = $send\n$x($text)",
    "$x = []\n$x.append($thunk)\nfor $f in $x:\n    $f()",
    "$q = queue.SimpleQueue()\n$q.put($thunk)\n$q.get()()", Form("self.$f()", "def $f(self):\n    $act"),
    Form("self.$f = $send\nself.$f($text)", "def $f(self, word='decoy'):\n    pass"),
    Form(
        "setattr(type(self), '$f', lambda me, w: $send(w))\nself.$f($text)",
        "def $f(self, word='decoy'):\n    pass",
    ),
    "def $f(send, w='decoy'):\n    send(w)\n$f($send, $text)",
    "def $f(w='decoy', *, say):\n    say(w)\n$f($text, say=$send)",
    "$x = {}\n$x['f'] = $send\n$x['f']($text)",
    "def $f():\n    def $g():\n        $act\n    return $g\n$f()()", "del [$do, 1][0]",
    "raise_ = $thunk\nraise_()", "lambda: 1\n$act", "$x = $thunk\n$x() if $x else 0",
    "$y = $thunk\n$x = [1]\n$x[$y() or 0] = 2", "$x, $y = $send, $text\n$x($y)",
    "$s = [$send]\n$s[0]($text)", "$y = str\n$x = lambda: $y($text)\n$y = $send\n$x()",
    "$x = types.SimpleNamespace(say=$send)\n$x.say($text)", "self.$a = $send\nself.$a($text)",
    "self.$a = $text\n$send(self.$a)", "self.$a = [$thunk]\nself.$a[0]()",
    "for self.$a in [$send]:\n    self.$a($text)",
]  # fmt: skip

FLAGS: _Forms = [
    "$read", "bool($read)", "($read and $true)", "($read or $false)", "($read is True)", "($read == True)",
    "[$read][0]", "(1 if $read else 0)", "($read in (True,))", "str($read) == 'True'", "int($read) > 0",
    "max($read, False)", "(not not $read)", "len('x' * $read) == 1", "('', 'x')[$read]",
    "f'{$read:d}' == '1'", "all(($read, 1))", "(lambda: $read)()", "(lambda v: v)($read)",
    "isinstance($read, bool) and $read", "round($read) > 0.5", "'x'.startswith('x' if $read else 'y')",
    "{True: 1}.get($read)", "0 < $read <= 1", "abs($read)", "-$read",
]  # fmt: skip
OWN_FLAGS: _Forms = [
    Form("self.$f()", "def $f(self):\n    return $read"),
    Form("self.$f($read)", "def $f(self, value):\n    return value"),
    Form("self.$f", "@property\ndef $f(self):\n    return $read"), "getattr(self, 'flag')",
    "vars(self)['flag']", "self.__dict__['flag']", "$me.flag",
    Form("self.$f()", "def $f(self, most=0):\n    return int($read) > most"),
    Form("self.$f().flag", "def $f(self):\n    return self"),
    Form("self.$f()", "def $f(self):\n    if $read:\n        return True\n    return False"),
    "operator.attrgetter('flag')(self)", "hasattr(self, 'flag') and self.flag",
]  # fmt: skip
"""The same if it is an attribute of the component."""

FLAKY: _Forms = [
    Form("next($x)", "", "$x = itertools.cycle([0, 1])"), Form("$x.pop()", "", "$x = [1, 0] * 99"),
    Form("($x := $x + 1) % 2 == 0", "", "$x = 0"), Form("$x.append(1) or len($x) % 2 == 0", "", "$x = []"),
    Form("self.$f()", "def $f(self):\n    self.$a += 1\n    return self.$a % 2 == 0\n$a = 0"),
    Form("self.$f()", "def $f(self, count=[0]):\n    count[0] += 1\n    return count[0] % 2 == 0"),
    Form("self.$a", "$b = 0\n\n@property\ndef $a(self):\n    self.$b += 1\n    return self.$b % 2 == 0"),
    Form(
        "$x",
        "class $C:\n    count = 0\n    def __bool__(me):\n        me.count += 1\n        return me.count % 2 == 0",
        "$x = self.$C()",
    ),
    Form(
        "$x == 1",
        "class $C:\n    count = 0\n    def __eq__(me, other):\n        me.count += 1\n        return me.count % 2 == 0",
        "$x = self.$C()",
    ),
    Form("$f()", "", "$x = 0\ndef $f():\n    nonlocal $x\n    $x += 1\n    return $x % 2 == 0"),
    "random.random() < 0.5", "random.choice([0, 1])", "random.randint(0, 1) == 1",
    Form("[*itertools.islice($x, 1)] == [1]", "", "$x = itertools.cycle([0, 1])"),
    Form("$x(0)", "", "$x = functools.partial(lambda c, _: c.append(1) or len(c) % 2 == 0, [])"),
    Form("next($x) % 2 == 1", "", "$x = itertools.count()"),
    Form("$x.__next__()", "", "$x = itertools.cycle([0, 1])"),
    Form("$x.rotate() or $x[0]", "", "$x = collections.deque([1, 0])"),
    Form("$x.reverse() or $x[0]", "", "$x = [1, 0]"),
    Form("$x.send(None)", "", "def $g():\n    while True:\n        yield 0\n        yield 1\n$x = $g()"),
    Form("self.$f() > 0", "def $f(self):\n    return next(self.$a)\n$a = itertools.cycle([0, 1])"),
    Form("self.$f(3)", "$c = iter([0, 1] * 999)\n\ndef $f(self, n):\n    return next(self.$c, 0)"),
    Form(
        "bool($x)",
        "",
        "$y = itertools.cycle([0, 1])\n$x = type('T', (), {'__bool__': lambda me: bool(next($y))})()",
    ),
    Form("$x.get()", "", "$x = queue.SimpleQueue()\nfor $y in range(99):\n    $x.put($y % 2)"),
    Form("$x.read(1) == '1'", "", "$x = io.StringIO('01' * 99)"),
    Form(
        "self.$a.v",
        "",
        "$y = itertools.cycle([0, 1])\nself.$a = type('T', (), {'v': property(lambda me: next($y))})()",
    ),
    Form(
        "self.$f()",
        "@staticmethod\ndef $f(count=[]):\n    count.append(1)\n    return len(count) % 2 == 0",
    ),
    Form(
        "self.$f()",
        "def $f(self):\n    global $z\n    $z = not globals().get('$z', True)\n    return $z",
    ),
    Form(
        "self.$f()",
        "def $f(self):\n    self.flips = not getattr(self, 'flips', True)\n    return self.flips",
    ),
    Form("exec('x[0] += 1', {'x': $x}) or $x[0] % 2 == 0", "", "$x = [0]"),
    Form("$x.update(n=1 - $x['n']) or $x['n']", "", "$x = {'n': 1}"),
    Form("self.__setattr__('$a', not self.$a) or self.$a", "$a = True"), "(lambda: $flaky)()",
    "($flaky or 0)", "($flaky and 1)", "bool($flaky)", "[$flaky][0]", "any([$flaky])", "(not not $flaky)",
    "($flaky if 1 else 0)", "f'{int($flaky)}' == '1'", "max($flaky, 0)", "all($flaky for _ in [1])",
    "int($flaky) > 0.5", "math.floor($flaky) > 0", "{0: 0, 1: 1}[int($flaky)]",
    Form("self.$f($flaky)", "def $f(self, v):\n    return v"),
    Form("self.$f(lambda: $flaky)", "def $f(self, v):\n    return v()"), "str(int($flaky)).startswith('1')",
    "1 == int($flaky)", "-int($flaky) < 0",
]  # fmt: skip

FORMS: Final[dict[str, _Forms]] = {
    "value": VALUES, "text": TEXTS, "part": PARTS, "true": TRUE, "false": FALSE, "me": ME, "send": SENDS, "thunk": THUNKS, "do": DOES,
    "act": ACTS, "flag": FLAGS, "own flag": [*FLAGS, *OWN_FLAGS], "flaky": FLAKY,
    "name assignment": NAME_ASSIGNMENTS, "attribute assignment": ATTRIBUTE_ASSIGNMENTS,
}  # fmt: skip
"""The forms by what they are; the first of each is the plainest."""
