"""C from Structured Text: a function block is a struct and a function; numbers are held to their types."""

from __future__ import annotations

from dataclasses import replace

from tests.peers.structured_text.syntax import Expression, Source, Statement, SyntaxFault, Unit, Variable

C_TYPES = {
    "BOOL": "uint8_t",
    "INT": "int16_t",
    "UINT": "uint16_t",
    "DINT": "int32_t",
    "UDINT": "uint32_t",
    "WORD": "uint16_t",
    "DWORD": "uint32_t",
    "LREAL": "double",
}
RANGES = {
    "INT": (-(1 << 15), (1 << 15) - 1),
    "UINT": (0, (1 << 16) - 1),
    "DINT": (-(1 << 31), (1 << 31) - 1),
    "UDINT": (0, (1 << 32) - 1),
    "WORD": (0, (1 << 16) - 1),
    "DWORD": (0, (1 << 32) - 1),
}
NUMBERS = ("INT", "UINT", "DINT", "UDINT", "LREAL")
BITS = ("BOOL", "WORD", "DWORD")
ANY = "a number"
"""The type of a literal that has none of its own."""
SIGNS = {"=": "==", "<>": "!=", "MOD": "%", "AND": "&", "OR": "|", "XOR": "^"}

PRELUDE = """/* Made from Structured Text by tests/peers/structured_text. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int64_t within(int64_t number, int64_t low, int64_t high, int line)
{
    if (number < low || number > high) {
        fprintf(stderr, "line %d: %lld lies outside %lld ... %lld\\n", line, (long long)number,
                (long long)low, (long long)high);
        abort();
    }
    return number;
}
"""


def translate(source: Source) -> str:
    """Get the C text of a program: globals are ``plc_NAME``, its face is ``plc_init`` and ``plc_run``.

    Raises
    ------
    SyntaxFault
        If types do not fit each other, or a name is not declared.
    """
    return _Writer(source).text()


class _Writer:
    def __init__(self, source: Source) -> None:
        self._source = source
        self._units = {unit.name: unit for unit in source.units}
        self._names: dict[str, tuple[str, Variable]] = {}

    def text(self) -> str:
        """Get everything."""
        units = self._source.units
        configuration = next(unit for unit in units if unit.kind == "CONFIGURATION")
        program = next(unit for unit in units if unit.kind == "PROGRAM")
        parts = [PRELUDE, *map(self._type, self._source.types.items())]
        parts += [self._declared(variable, "plc_") + ";\n" for variable in configuration.variables]
        for unit in units:
            if unit.kind == "FUNCTION":
                parts.append(self._function(unit))
            elif unit.kind != "CONFIGURATION":
                parts.append(self._function_block(unit))
        parts.append(f"static {program.name} the_program;\n\nvoid plc_init(void)\n{{\n")
        parts.append(f"    init_{program.name}(&the_program);\n}}\n\n")
        parts.append(f"void plc_run(void)\n{{\n    run_{program.name}(&the_program);\n}}\n")
        return "".join(parts)

    # --- declarations -------------------------------------------------------------------------------

    def _type(self, declared: tuple[str, list[Variable]]) -> str:
        name, members = declared
        if members[0].name == name:
            return f"typedef {self._declared(members[0], '')};\n"
        inside = "".join(f"    {self._declared(member, '')};\n" for member in members)
        return f"typedef struct {{\n{inside}}} {name};\n"

    def _c_type(self, name: str) -> str:
        if name in C_TYPES:
            return C_TYPES[name]
        if name in self._source.types or (name in self._units and self._units[name].kind == "FUNCTION_BLOCK"):
            return name
        raise SyntaxFault(f"there is no type {name}")

    def _declared(self, variable: Variable, prefix: str) -> str:
        low, high = variable.bounds or (0, 0)
        size = f"[{high - low + 1}]" if variable.bounds else ""
        return f"{self._c_type(variable.type)} {prefix}{variable.name}{size}"

    def _function_block(self, unit: Unit) -> str:
        own = [variable for variable in unit.variables if variable.section != "VAR_EXTERNAL"]
        inside = "".join(f"    {self._declared(variable, '')};\n" for variable in own)
        self._names = {v.name: (f"self->{v.name}", v) for v in own}
        self._names |= self._external(unit)
        first = "    memset(self, 0, sizeof *self);\n"
        for variable in own:
            if variable.type in self._units:
                first += f"    init_{variable.type}(&self->{variable.name});\n"
            elif variable.initial is not None:
                first += f"    self->{variable.name} = {self._as(variable.initial, variable.type)};\n"
        name, body = unit.name, self._block(unit.body)
        return (
            f"\ntypedef struct {{\n{inside}}} {name};\n"
            f"\nstatic void init_{name}({name} *self)\n{{\n{first}}}\n"
            f"\nstatic void run_{name}({name} *self)\n{{\n{body}}}\n"
        )

    def _external(self, unit: Unit) -> dict[str, tuple[str, Variable]]:
        configuration = next(one for one in self._source.units if one.kind == "CONFIGURATION")
        offered = {variable.name: variable for variable in configuration.variables}
        found = {}
        for variable in unit.variables:
            if variable.section == "VAR_EXTERNAL":
                there = offered.get(variable.name)
                if there is None or there.type != variable.type:
                    raise SyntaxFault(f"{unit.name}: no global {variable.name} of type {variable.type}")
                found[variable.name] = f"plc_{variable.name}", there
        return found

    def _function(self, unit: Unit) -> str:
        inputs = [variable for variable in unit.variables if variable.section == "VAR_INPUT"]
        inner = [variable for variable in unit.variables if variable.section == "VAR"]
        result = Variable(unit.name, unit.result, "VAR")
        self._names = {v.name: (f"v_{v.name}", v) for v in [*unit.variables, result]}
        head = ", ".join(self._declared(variable, "v_") for variable in inputs)
        first = "".join(f"    {self._declared(variable, 'v_')} = 0;\n" for variable in [*inner, result])
        kind, body = self._c_type(unit.result), self._block(unit.body)
        return f"\nstatic {kind} call_{unit.name}({head})\n{{\n{first}{body}    return v_{unit.name};\n}}\n"

    # --- statements ---------------------------------------------------------------------------------

    def _block(self, statements: tuple[Statement, ...]) -> str:
        return "".join(map(self._statement, statements))

    def _statement(self, statement: Statement) -> str:
        match statement.kind:
            case "assign":
                place, value = statement.expressions
                there, its_type = self._value(place)
                if self._is_constant(place):
                    raise SyntaxFault(f"line {statement.line}: {place.text} is constant")
                return f"{there} = {self._as(value, its_type)};\n"
            case "call":
                return self._run(statement.expressions[0])
            case "if":
                return self._if(statement)
            case "case":
                return self._case(statement)
            case "for":
                return self._for(statement)
        condition = self._as(statement.expressions[0], "BOOL")
        return f"while ({condition}) {{\n{self._block(statement.blocks[0])}}}\n"

    def _is_constant(self, place: Expression) -> bool:
        while place.parts:
            place = place.parts[0]
        _, variable = self._found(place)
        return variable.section in ("CONSTANT", "VAR_INPUT")

    def _if(self, statement: Statement) -> str:
        text = ""
        for condition, block in zip(statement.expressions, statement.blocks, strict=False):
            text += f"if ({self._as(condition, 'BOOL')}) {{\n{self._block(block)}}} else "
        otherwise = statement.blocks[len(statement.expressions) :]
        return text + "{\n" + (self._block(otherwise[0]) if otherwise else "") + "}\n"

    def _case(self, statement: Statement) -> str:
        chosen, _ = self._value(statement.expressions[0])
        text = f"switch ({chosen}) {{\n"
        for labels, block in zip(statement.labels, statement.blocks, strict=True):
            text += "".join(f"case {label}:\n" for label in labels) + self._block(block) + "break;\n"
        return text + "default:\nbreak;\n}\n"

    def _for(self, statement: Statement) -> str:
        counter, first, last = statement.expressions
        there, its_type = self._value(counter)
        begin, end = self._as(first, its_type), self._as(last, its_type)
        # The end is reckoned once, and the counter does not run beyond its type.
        count = f"for (int64_t i_ = {begin}, end_ = {end}; i_ <= end_; i_++)"
        return f"{count} {{\n{there} = ({C_TYPES[its_type]})i_;\n{self._block(statement.blocks[0])}}}\n"

    def _run(self, call: Expression) -> str:
        there, variable = self._found(replace(call, kind="name"))
        inputs = {v.name: v for v in self._units[variable.type].variables if v.section == "VAR_INPUT"}
        text = ""
        for name, value in zip(call.names, call.parts, strict=True):
            if name not in inputs:
                raise SyntaxFault(f"line {call.line}: {variable.type} has no input {name}")
            text += f"{there}.{name} = {self._as(value, inputs[name].type)};\n"
        return text + f"run_{variable.type}(&{there});\n"

    # --- expressions: each as its C text and its type --------------------------------------------------

    def _as(self, expression: Expression, wanted: str) -> str:
        text, its_type = self._value(expression)
        if its_type == ANY and wanted in RANGES and wanted not in BITS:
            low, high = RANGES[wanted]
            if not low <= int(text) <= high:
                raise SyntaxFault(f"line {expression.line}: {text} is no {wanted}")
            return f"({C_TYPES[wanted]})INT64_C({text})"
        if its_type != wanted:
            raise SyntaxFault(f"line {expression.line}: {its_type} stands where {wanted} should")
        return text

    def _found(self, place: Expression) -> tuple[str, Variable]:
        if place.text not in self._names:
            raise SyntaxFault(f"line {place.line}: {place.text} is not declared")
        return self._names[place.text]

    def _value(self, e: Expression) -> tuple[str, str]:  # noqa: PLR0911 - one for each kind
        match e.kind:
            case "int":
                return e.text, ANY
            case "real":
                return e.text, "LREAL"
            case "bool":
                return ("1" if e.text == "TRUE" else "0"), "BOOL"
            case "typed":
                its_type, _, number = e.text.partition("#")
                value = int(number[3:], 16) if number.startswith("16#") else int(number)
                return f"({C_TYPES[its_type]}){value}u", its_type
            case "name":
                there, variable = self._found(e)
                return there, variable.type
            case "member":
                return self._member(e)
            case "index":
                return self._element(e)
            case "call":
                return self._called(e)
            case "unary":
                return self._unary(e)
        return self._binary(e)

    def _member(self, e: Expression) -> tuple[str, str]:
        there, its_type = self._value(e.parts[0])
        offered = self._source.types.get(its_type) or [
            variable for variable in self._units[its_type].variables if variable.section == "VAR_OUTPUT"
        ]
        for variable in offered:
            if variable.name == e.text:
                return f"{there}.{e.text}", variable.type
        raise SyntaxFault(f"line {e.line}: {its_type} shows no {e.text}")

    def _element(self, e: Expression) -> tuple[str, str]:
        place, index = e.parts
        there, variable = self._found(place)
        shape = self._source.types[variable.type][0] if variable.bounds is None else variable
        if shape.bounds is None:
            raise SyntaxFault(f"line {e.line}: {place.text} is no array")
        low, high = shape.bounds
        text, its_type = self._value(index)
        if its_type not in (ANY, "INT", "DINT"):  # what every PLC takes as an index
            raise SyntaxFault(f"line {e.line}: {its_type} is no index")
        return f"{there}[within({text}, {low}, {high}, {e.line}) - {low}]", shape.type

    def _called(self, e: Expression) -> tuple[str, str]:
        unit = self._units.get(e.text)
        if unit is not None:
            inputs = [variable for variable in unit.variables if variable.section == "VAR_INPUT"]
            given = dict(zip(e.names or [v.name for v in inputs], e.parts, strict=True))
            if set(given) != {variable.name for variable in inputs}:
                raise SyntaxFault(f"line {e.line}: {e.text} wants {[v.name for v in inputs]}")
            return f"call_{e.text}({', '.join(self._as(given[v.name], v.type) for v in inputs)})", unit.result
        before, _, after = e.text.partition("_TO_")
        if after in C_TYPES and before in C_TYPES:
            return self._converted(self._as(e.parts[0], before), before, after, e.line), after
        if e.text == "SHR":
            value, its_type = self._value(e.parts[0])
            return f"({C_TYPES[its_type]})({value} >> {self._as(e.parts[1], 'INT')})", its_type
        if e.text in ("ABS", "SIN", "COS"):
            name = {"ABS": "fabs", "SIN": "sin", "COS": "cos"}[e.text]
            return f"{name}({self._as(e.parts[0], 'LREAL')})", "LREAL"
        if e.text in ("MIN", "MAX"):
            left, right, its_type = self._alike(e)
            sign = "<" if e.text == "MIN" else ">"
            return f"({left} {sign} {right} ? {left} : {right})", its_type
        raise SyntaxFault(f"line {e.line}: there is no function {e.text}")

    def _converted(self, value: str, before: str, after: str, line: int) -> str:
        if after == "LREAL":
            return f"(double){value}"
        low, high = RANGES[after]
        whole = f"llrint({value})" if before == "LREAL" else value  # to the nearest, ties to the even one
        return f"({C_TYPES[after]})within({whole}, INT64_C({low}), INT64_C({high}), {line})"

    def _unary(self, e: Expression) -> tuple[str, str]:
        value, its_type = self._value(e.parts[0])
        if e.text == "NOT" and its_type in BITS:
            return (f"(!{value})" if its_type == "BOOL" else f"({C_TYPES[its_type]})~{value}"), its_type
        if e.text == "-" and its_type == ANY:
            return f"-{value}", ANY
        if e.text == "-" and its_type == "LREAL":
            return f"(-{value})", its_type
        raise SyntaxFault(f"line {e.line}: {e.text} does not go with {its_type}")

    def _alike(self, e: Expression) -> tuple[str, str, str]:
        """Return both operands and the type that they have in common; a literal takes the other's."""
        left, right = e.parts
        its_type = next((t for _, t in map(self._value, (left, right)) if t != ANY), "DINT")
        return self._as(left, its_type), self._as(right, its_type), its_type

    def _binary(self, e: Expression) -> tuple[str, str]:
        left, right, its_type = self._alike(e)
        sign = e.text
        if sign in ("=", "<>", "<", ">", "<=", ">="):
            if sign not in ("=", "<>") and its_type in BITS:
                raise SyntaxFault(f"line {e.line}: {its_type} has no order")
            return f"({left} {SIGNS.get(sign, sign)} {right})", "BOOL"
        if sign in ("AND", "OR", "XOR"):
            if its_type not in BITS:
                raise SyntaxFault(f"line {e.line}: {sign} does not go with {its_type}")
            return f"({C_TYPES[its_type]})({left} {SIGNS[sign]} {right})", its_type
        if its_type not in NUMBERS:
            raise SyntaxFault(f"line {e.line}: {sign} does not go with {its_type}")
        if its_type == "LREAL":
            return f"({left} {sign} {right})", its_type
        low, high = RANGES[its_type]
        whole = f"(int64_t){left} {SIGNS.get(sign, sign)} (int64_t){right}"
        return f"({C_TYPES[its_type]})within({whole}, INT64_C({low}), INT64_C({high}), {e.line})", its_type
