"""The classes of drafts, of each model one, as the text of modules: typed, with docstrings, by the schema of specs."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from keyword import iskeyword
from typing import Any, Final

from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker import models

#: Fields of every spec that a class has as parameters beside those of its machine.
FIRST: Final = ("name", "run", "derive")
#: Fields of a spec that other methods write.
PACKAGE: Final = "sprag_study.service.client.machines"
ELSEWHERE: Final = ("sprag", "model", "base", "axes")

#: What is said of a table.
TABLE: Final = (
    'a frame, a mapping of columns or a sequence of mappings, as `cases` of `sprag.run`, or {"csv": text}; '
    "a cell without a value was not measured"
)

HEAD: Final = '''"""Specs written in Python.

Made of the descriptions of the spec by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, Self, TypedDict

from sprag_study.service.client.case_tables import measured_of
from sprag_study.service.client.drafts import Draft, Entries, Quantity, Results, known, refined_results, \
results_of, sensors_of
'''

Schema = Mapping[str, Any]


def modules() -> dict[str, str]:
    """The text of each module by its name, which ruff lays out."""
    schema = spec_schema()
    texts = {"studies": HEAD + "\n" + _studies(schema["properties"])}
    names = {}
    for model in models.model_names():
        branch = next(part for part in schema["allOf"] if part["if"]["properties"]["model"]["const"] == model)
        module = model.replace("-", "_")
        names[_class_name(model)] = f"{PACKAGE}.{module}"
        machine = _machine(model, schema["properties"], branch["then"]["properties"])
        texts[module] = f"{HEAD}from {PACKAGE}.studies import Studies\n\n{machine}"
    imports = "".join(f"from {module} import {name}\n" for name, module in names.items())
    about = '"""Specs of each model, written in Python; made of the descriptions of the models."""'
    return {**texts, "__init__": f"{about}\n\n{imports}\n__all__ = {sorted(names)!r}\n"}


#: Kinds of studies that choose their own cases and take no axes.
CHOOSING = ("goal", "calibrate")


def _class_name(model: str) -> str:
    return model.rpartition("-")[2].capitalize()


def _studies(fields: Schema) -> str:
    """The class of what every model has: a method for each kind of study, and one for the other fields."""
    kinds = {name: part for name, part in fields.items() if part.get("properties") and name not in ELSEWHERE}
    others = {name: part for name, part in fields.items() if name not in (*ELSEWHERE, *kinds)}
    text = 'class Studies(Draft):\n    """A draft of any model, with a method for each kind of study."""\n\n'
    for name, part in kinds.items():
        required = part.get("required", ())
        asked = dict(sorted(part["properties"].items(), key=lambda item: item[0] not in required))
        change = "_choosing" if name in CHOOSING else "_with"
        text += _method(name, part["description"], asked, required, f"self.{change}({name}=known({{fields}}))")
    return text + _method("set", "other fields of the spec", others, (), "self._with({fields})")


def _method(name: str, meaning: str, fields: Schema, required: Any, result: str) -> str:
    head = f"    def {name}(self, *, {', '.join(_parameters(fields, required))}) -> Self:\n"
    given = ", ".join(f"{key}={_value(key, part)}" for key, part in fields.items())
    return f"{head}{_docstring(meaning, fields, required)}        return {result.format(fields=given)}\n\n"


def _machine(model: str, fields: Schema, parts: Schema) -> str:
    """The class of a model, and those of the objects of its machine."""
    name = _class_name(model)
    base, made = parts["base"], dict[str, str]()
    kinds = {key: _object(name, key, part, made) for key, part in base["properties"].items()}
    first = {key: parts.get(key, fields[key]) for key in FIRST}
    kinds |= {key: _object(name, key, part, made) for key, part in first.items()}
    required = base["required"]
    asked = sorted({**base["properties"], **first}.items(), key=lambda item: item[0] not in required)
    signature = ", ".join(f"{key}: {kinds[key]}" + ("" if key in required else " | None = None") for key, _ in asked)
    own = ", ".join(f"{key}={key}" for key in base["properties"])
    paths = ", ".join(map(repr, dict.fromkeys(_leaves(base))))
    return (
        "".join(made.values())
        + f'class {name}(Studies):\n    """A study of the model {model}, to be varied and run."""\n\n'
        + f"    _model = {model!r}\n    _parameters = ({paths},)\n\n"
        + f"    def __init__(self, *, {signature}) -> None:\n"
        + _docstring(f"a study of the model {model!r}: the machine that every case begins from", dict(asked), required)
        + f"        super().__init__(base=known({own}), {', '.join(f'{key}={key}' for key in FIRST)})\n\n\n"
    )


def _object(model: str, name: str, schema: Schema, made: dict[str, str]) -> str:
    """The type of a field; the class of an object with fields, or of the items of a list, is put into ``made``."""
    if schema.get("type") == "array" and isinstance(schema.get("items"), Mapping):
        inner = _object(model, name.removesuffix("s"), schema["items"], made)
        return f"Sequence[{inner}]"
    keys = schema.get("properties", {})
    if not keys or any(map(iskeyword, keys)):
        return _kind(schema)
    title = model + "".join(word.capitalize() for word in name.split("_"))
    lines = "".join(f"    {key}: {_object(title, key, part, made)}\n" for key, part in keys.items())
    about = _sentence(schema.get("description", f"fields of {name}"))
    meanings = [line for key, part in keys.items() for line in _about(f"{key} : ", part, " " * 4)]
    told = "".join(f"{line}\n" for line in ["", "", *meanings]) + "    " if meanings else ""
    body = f'(TypedDict, total=False):\n    """{about}{told}"""\n\n{lines}\n\n'
    same = next((known for known, text in made.items() if text.endswith(body)), title)
    made.setdefault(same, f"class {same}{body}")
    return same


def _kind(schema: Schema) -> str:
    """The type of a value."""
    match schema:
        case {"enum": [*names]} if all(isinstance(name, str) for name in names):
            return f"Literal[{', '.join(map(repr, names))}]"
        case {"type": "boolean" | "integer" | "string" as kind}:
            return {"boolean": "bool", "integer": "int", "string": "str"}[kind]
        case {"type": ["number", "string"]} | {"x-unit": _}:
            return "Quantity"
        case {"type": "array", "items": {"type": "string"}}:
            return "str | Sequence[str]"
        case {"type": "array", "items": Mapping() as items}:
            return "Entries" if _has(items, "path") else "Results" if _has(items, "result") else "Sequence[Any]"
        case {"type": "object"}:
            return "Any" if _is_table(schema) else "Mapping[str, Any]"
    return "Any"


def _has(items: Schema, field: str) -> bool:
    """Whether the objects of a list, or some of them, have a field."""
    return field in items.get("properties", {}) or any(_has(part, field) for part in items.get("anyOf", ()))


def _has_names(items: Schema) -> bool:
    """Whether some items of a list are plain names."""
    return any(part.get("type") == "string" for part in items.get("anyOf", ()))


def _is_table(schema: Schema) -> bool:
    """Whether a value is a table, which a spec has as the text of a CSV file, and nothing else."""
    return [*schema.get("properties", ())] == ["csv"]


def _value(name: str, schema: Schema) -> str:
    """How a value of Python becomes one of the spec."""
    if _is_table(schema):
        return f"measured_of({name})"
    match _kind(schema):
        case "Entries":
            alone = "plus_minus" if _has(schema["items"], "plus_minus") else "values"
            return f"self._entries({name}, {alone!r})"
        case "Results":
            if _has_names(schema["items"]):
                return f"refined_results({name})"
            return f"sensors_of({name})" if _has(schema["items"], "gain") else f"results_of({name})"
        case "str | Sequence[str]":
            return f"[{name}] if isinstance({name}, str) else {name}"
    return name


def _parameters(fields: Schema, required: Any) -> Iterator[str]:
    for name, part in fields.items():
        yield f"{name}: {_kind(part)}" + ("" if name in required else " | None = None")


def _leaves(schema: Schema, before: str = "") -> Iterator[str]:
    """The paths of the quantities of a machine; `*` stands for the numbers of a list."""
    for name, part in schema.get("properties", {}).items():
        if "x-unit" in part:
            yield before + name
        yield from _leaves(part, f"{before}{name}.")
    if isinstance(schema.get("items"), Mapping):
        yield from _leaves(schema["items"], f"{before}*.")
    for kind in ("oneOf", "anyOf"):
        for part in schema.get(kind, ()):
            yield from _leaves(part, before)


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}" + ("" if text.endswith(".") else ".")


def _about(before: str, part: Schema, indent: str) -> list[str]:
    """Lines with the meaning of a field, its range, and the fields that it has itself."""
    of_items = part["items"] if isinstance(part.get("items"), Mapping) else part
    names = list(of_items.get("properties", {}))
    needed = [name for name in names if name in of_items.get("required", ())]
    about = [part.get("description", ""), part.get("x-range", ""), f"fields {', '.join(names)}" if names else ""]
    about += [f"needed: {', '.join(needed)}"] if needed and needed != names else []
    said = "; ".join(filter(None, about))
    text = before + _sentence(said) if said else ""
    return textwrap.wrap(text, 120, initial_indent=indent, subsequent_indent=indent if not before else indent + "    ")


def _docstring(meaning: str, fields: Schema, required: Any) -> str:
    lines = [f'        """{_sentence(meaning)}', "", "        Parameters", "        ----------"]
    for name, part in fields.items():
        kinds = "" if name in required else ", optional"
        kind = {"bool": "bool", "int": "int", "str": "str", "Quantity": "number or text with a unit"}
        shown = "table" if _is_table(part) else kind.get(_kind(part), "values")
        lines.append(f"        {name} : {shown}{kinds}")
        lines += _about("", {"description": TABLE} if _is_table(part) else part, " " * 12)
    return "\n".join(lines) + '\n        """\n'
