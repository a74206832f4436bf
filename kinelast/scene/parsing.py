"""Parsing and validation of scene files, with messages for users."""

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from typing import Annotated, Any, TypeVar, get_args, get_origin

import msgspec

from kinelast.scene.format import RunTable, SceneTable, read_quantity
from kinelast.scene.tables import PER_LENGTH, LengthUnit
from kinelast.values.error import fault, likely
from kinelast.values.units import shown

Hook = Callable[[type, Any], Any]
Whole = TypeVar("Whole", bound=msgspec.Struct)
Value = TypeVar("Value")
NAME = re.compile(r"[A-Za-z0-9_-]+")
REPORT = re.compile(r"(?P<what>.*?)(?: - at `\$(?P<path>.*)`)?", re.DOTALL)
WORDS = {
    "object": "a table",
    "array": "a list",
    "str": "a text in quotes",
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
}
AXES = {"[1]": " x", "[2]": " y"}
EXAMPLES = {"gravity": "[0, -9.81]", "direction": '[1, 0] or "30 deg"', "points": "[0.1, 0.05]"}
NOT_MODELLED = {"backlash": "play between teeth is", "wear": "wear is", "contact": "contact is", "impact": "impact is"}
DID = "; did you mean "
ELSEWHERE = {  # keys that users give in a wrong table, with the right place
    "friction": "it belongs under [joints.NAME]",
    "viscosity": "it belongs under [joints.NAME]",
    "clearance": "it belongs under [bearings.NAME]",
    "play": "use clearance under [bearings.NAME]",
    "damping": "links are damped by damping_ratio under [run] or damping under [materials.NAME],"
    " joints by viscosity under [joints.NAME]",
    **dict.fromkeys(
        ("stress", "joint_force", "drive_effort", "transmission_angle"),
        "a limit of any other figure belongs under [limits.figures]",
    ),
}


MAX_PARTS = 32  # maximum number of parts of a dotted key; the run time of tomllib grows with its square
PART = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""
TOO_DEEP = re.compile(rf"{PART}(?:[ \t]*\.[ \t]*{PART}){{{MAX_PARTS}}}")


def read_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raise TOMLDecodeError if the text is invalid or a key has more than `MAX_PARTS` parts.
    """
    deep = TOO_DEEP.search(text) if text.count(".") >= MAX_PARTS else None
    if deep is not None:
        line = text.count("\n", 0, deep.start()) + 1
        raise tomllib.TOMLDecodeError(f"a key of more than {MAX_PARTS} parts, as in a.b.c (at line {line}, column 1)")
    return tomllib.loads(text)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raise SceneError with line and column if it is invalid, TypeError if it is no string.
    """
    if not isinstance(text, str):
        raise TypeError(f"expected the text of a scene file, got {shown(text)}")
    try:
        return read_toml(text)
    except tomllib.TOMLDecodeError as error:
        problem = re.sub(r"\('(.*?)',?\)", lambda names: f"[{names[1]}]".replace("', '", "."), str(error))
        raise fault("", "", f"not readable as TOML: {problem}{_toml_hint(text, str(error))}") from None
    except ValueError:  # Python limits the number of digits of an integer
        raise fault("", "", "not readable as TOML: a whole number of thousands of digits") from None


KEY = r"""\s*[\w."'-]+\s*=\s*"""
HINTS: tuple[
    tuple[str, Callable[[re.Match[str]], str]], ...
] = (  # patterns of invalid lines, each with a hint on the likely correction
    (
        r"[^#]*?([\u201a-\u201f\u2018\u2019\u00ab\u00bb])",
        lambda found: f'put a text in straight quotes, ", not in {found[1]}',
    ),
    (KEY + r"([-+]?\d+),(\d+)\s*(?:#|$)", lambda found: f"use a decimal point: write {found[1]}.{found[2]}"),
    (
        KEY + r"\[\s*([-+]?\d+),(\d+)\s*[,;]\s*([-+]?\d+),(\d+)\s*\]",
        lambda found: f"use decimal points: write [{found[1]}.{found[2]}, {found[3]}.{found[4]}]",
    ),
    (
        KEY + r"([-+]?[\d.][\d.eE+-]*\s*[A-Za-zµμ°][^\s#]*)",
        lambda found: f'put a number with a unit in quotes, as in "{found[1]}"',
    ),
    (
        r"\s*\[+\s*(?:[\w-]+\.)*([\w-]+(?:\s+[\w-]+)+)|\s*([\w-]+(?:\s+[\w-]+)+)\s*=",
        lambda found: f"a name has no spaces: write {'_'.join((found[1] or found[2]).split())}",
    ),
    (r'[^"]*"[^"]*(?:"[^"]*"[^"]*)*$', lambda _: "is a closing quote missing?"),
    (KEY + r"""([^\W\d][^"'\[{#]*)""", lambda found: f'put a text in quotes, as in "{found[1].strip()}"'),
)


def _toml_hint(text: str, message: str) -> str:
    """Return a hint on the likely correction of the line that a message of tomllib names."""
    at = re.search(r"at line (\d+)", message)
    lines = text.splitlines()
    line = lines[int(at[1]) - 1][:200] if at and int(at[1]) <= len(lines) else ""
    matches = ((re.match(pattern, line), words) for pattern, words in HINTS)
    return next((f"; {words(found)}" for found, words in matches if found), "")


def leaves(node: Any, kind: type[Value]) -> Iterator[Value]:
    """Yield all values of a type inside a value, which may be a table, a list or a parsed table."""
    if isinstance(node, kind):
        yield node
    elif isinstance(node, msgspec.Struct):
        yield from leaves(msgspec.structs.astuple(node), kind)
    elif isinstance(node, Mapping):
        yield from leaves([*node.values()], kind)
    elif isinstance(node, list | tuple):
        for each in node:
            yield from leaves(each, kind)


def is_chain(raw: Mapping[str, Any]) -> bool:
    """Return True if the tables describe a spatial chain of joints. Raise TypeError if they are not a mapping."""
    if not isinstance(raw, Mapping):
        raise TypeError(f"expected the tables of a scene file as a dictionary, got {shown(raw)}")
    joints = raw.get("joints")
    return isinstance(joints, dict) and any(isinstance(joint, dict) and "type" in joint for joint in joints.values())


def parse_scene(raw: Mapping[str, Any]) -> SceneTable:
    """Return the validated tables of a scene.

    Raises
    ------
    SceneError
        A table or key is wrong. The message names it.
    """
    if is_chain(raw):
        raise fault("joints", "", "for joints in space, only the structure can be analysed: use --structure")
    return parsed(raw, SceneTable)


def parse_parts(table: SceneTable, raw: Mapping[str, Any], names: Iterable[str]) -> SceneTable:
    """Return the scene `table`, with its entries `names` replaced by those parsed from the tables `raw`.

    Errors are the same as in `parse_scene`.
    """
    fields, hook = _fields(SceneTable), partial(read_quantity, per_length=PER_LENGTH[table.units])
    return msgspec.structs.replace(table, **{name: _part(name, fields[name].type, raw[name], hook) for name in names})


def parsed(raw: Mapping[str, Any], whole: type[Whole]) -> Whole:
    """Return the validated tables of a scene or a spatial chain. Errors are the same as in `parse_scene`."""
    fields = _fields(whole)
    for key in raw:
        if key not in fields:
            place = "; it belongs under [run]" if key in _keys(RunTable, "", raw) else likely(key, fields)
            raise fault("", key, f"there is no such table or key{place}")
    units = _converted(raw.get("units", "m"), LengthUnit, "", "units")
    hook = partial(read_quantity, per_length=PER_LENGTH[units])
    parts = {name: _part(name, field.type, raw[name], hook) for name, field in fields.items() if name in raw}
    for name, field in fields.items():
        if field.required and not raw.get(name):
            bracket = f"[{name}]" if name == "points" else f"[{name}.NAME]"
            raise fault(name, "", f"the table is missing; a scene needs {bracket}")
    return whole(**parts)


@cache
def _fields(whole: Any) -> dict[str, msgspec.structs.FieldInfo]:
    """Return the fields of a table by name."""
    return {field.name: field for field in msgspec.structs.fields(whole)}


def _part(name: str, kind: Any, value: Any, hook: Hook) -> Any:
    """Convert a top-level entry of the scene, one table after the other, so that messages can name the table."""
    kind = get_args(kind)[0] if get_origin(kind) is Annotated else kind
    if get_origin(kind) is dict:
        entry = get_args(kind)[1]
        leaf = name in ("points", "masses", "tolerances")
        if not isinstance(value, dict) or not (leaf or all(isinstance(item, dict) for item in value.values())):
            example = f"[{name}] with NAME = ..." if leaf else f"[{name}.NAME]"
            raise fault(name, "", f"expected separate tables, written {example}")
        for key in value if name != "tolerances" else ():  # the keys under [tolerances] are paths
            check_name(name, key)
        if leaf:
            return {key: _converted(item, entry, name, key, hook) for key, item in value.items()}
        return {key: _converted(item, entry, f"{name}.{key}", hook=hook) for key, item in value.items()}
    if get_origin(kind) is list:
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise fault(name, "", f"expected a list of tables, written [[{name}]] with two brackets")
        entry = get_args(kind)[0]
        return [_converted(item, entry, f"{name}[{number}]", hook=hook) for number, item in enumerate(value, 1)]
    place = (name, "") if _tables(kind) else ("", name)
    return _converted(value, kind, *place, hook)


def check_name(table: str, name: str) -> None:
    """Raise SceneError if a name contains characters other than letters, digits, - and _."""
    if not NAME.fullmatch(name):
        raise fault(table, f'"{name}"', "a name may have the letters A-Z and a-z, digits, - and _")


def _converted(value: Any, kind: Any, table: str, prefix: str = "", hook: Hook = read_quantity) -> Any:
    try:
        return msgspec.convert(value, kind, dec_hook=hook)
    except msgspec.ValidationError as error:
        report = REPORT.fullmatch(str(error))
        assert report is not None
        path = _path(report["path"] or "")
        key, problem = _message(report["what"], path, value, kind)
        topic = "points" if table == "points" else key
        if topic in EXAMPLES and problem.startswith(("expected a list", "the key is missing")):
            problem += f"; as in {EXAMPLES[topic]}"
        if table == "points":
            key = AXES.get(key, key)
        inside = "." if prefix and key and key[0].isalpha() else ""
        raise fault(table, prefix + inside + key, problem) from None


def _found(value: Any, path: str) -> Any:
    """Return the value at a path with indices from 1, or an empty table if there is no value."""
    for part in re.findall(r"[^.\[\]]+", path):
        try:
            value = value[int(part) - 1] if isinstance(value, list) else value[part]
        except (KeyError, IndexError, TypeError, ValueError):
            return {}
    return value


def _path(path: str) -> str:
    """Convert a path in a message of the validator, with indices from 0, to indices from 1."""
    path = re.sub(r"\[(\d+)\]", lambda found: f"[{int(found[1]) + 1}]", path)
    return path.replace("[...]", "").lstrip(".")


def _message(what: str, path: str, value: Any, kind: Any) -> tuple[str, str]:
    """Return the wrong key and a message for the user, made from the message of the validator (msgspec)."""
    inner = f"{path}." if path else ""
    if match := re.fullmatch(r"Object contains unknown field `(.*)`", what):
        if match[1] in NOT_MODELLED:
            return inner + match[1], f"{NOT_MODELLED[match[1]]} not modelled: leave the key out"
        known = _keys(kind, path, value)
        hint = f"; {ELSEWHERE[match[1]]}" if match[1] in ELSEWHERE else likely(match[1], known)
        return inner + match[1], f"there is no such key{hint}"
    if match := re.fullmatch(r"Object missing required field `(.*)`", what):
        missing = "the key is missing" + (f": one of {', '.join(_tags(kind))}" if match[1] == "shape" else "")
        near = likely(match[1], [key for key in _found(value, path) if key not in _keys(kind, path, value)])
        return inner + match[1], missing + (f"; is it {near[len(DID) : -1]}?" if near.startswith(DID) else "")
    if match := re.fullmatch(r"Invalid (?:enum )?value (.*)", what):
        word = match[1].strip("'\"")
        choices = _tags(kind) if path == "shape" else _literals(kind, path, value) if path else _words(kind)
        return path, f'expected one of {", ".join(choices)}, got "{word}"{_near(word, choices)}'
    if match := re.fullmatch(r"Expected `(.*?)`(?: of length ((?:>= )?\d+))?(.*?)(?:, got (.*))?", what):
        words = " or ".join(WORDS.get(word, word) for word in match[1].split(" | ") if word != "null")
        size = f" of {match[2].replace('>=', 'at least')} entries" if match[2] else ""
        got = f", got {WORDS.get(match[4].strip('`'), match[4])}" if match[4] else ""
        stands = _found(value, path)
        if not isinstance(stands, dict | list):
            got = f", got {shown(stands)}"
        return path, f"expected {words}{size}{match[3]}{got}"
    return path, what


def _near(word: str, choices: list[str]) -> str:
    hint = likely(word, choices)
    return hint if hint.startswith(DID) else ""


def _tags(kind: Any) -> list[str]:
    return [option.__struct_config__.tag for option in get_args(kind)]


def _keys(kind: Any, path: str, value: Any) -> list[str]:
    """Return the keys of a table."""
    return [field.encode_name for field in _entries(kind, path, value)]


def _literals(kind: Any, path: str, value: Any) -> list[str]:
    """Return the words that a key accepts."""
    inside, _, key = path.rpartition(".")
    return next(_words(field.type) for field in _entries(kind, inside, value) if field.encode_name == key)


def _entries(kind: Any, path: str, value: Any) -> list[msgspec.structs.FieldInfo]:
    """Return the fields of the table at a path.

    If tables of several types are possible, the key `shape` selects the type.
    """
    tables = _tables(kind)
    for name in re.findall(r"[^.\[\]]+", re.sub(r"\[\d+\]", "", path)):
        fields = [field for table in tables for field in msgspec.structs.fields(table) if field.encode_name == name]
        tables = [table for field in fields for table in _tables(field.type)]
    shaped = [table for table in tables if table.__struct_config__.tag == value.get("shape")] if len(tables) > 1 else []
    return list(msgspec.structs.fields((shaped or tables)[0]))


def _tables(kind: Any) -> list[Any]:
    """Return all table types in the type of an entry."""
    if hasattr(kind, "__struct_config__"):
        return [kind]
    return [table for part in get_args(kind) for table in _tables(part)]


def _words(kind: Any) -> list[str]:
    """Return the words that a key accepts, given its type. The type may also accept None."""
    return [word for each in (kind, *get_args(kind)) for word in get_args(each) if isinstance(word, str)]
