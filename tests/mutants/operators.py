"""Mutate a source with cosmic-ray's operators; a program of its own, run with the environment that has them.

Reads a source from standard input, writes a list of mutants to standard output, as JSON: operator, line
(from 1), column (from 0), source.
"""

from __future__ import annotations

import json
import sys
from copy import deepcopy

OPPOSITE_AND_NEXT = {
    "Lt": ("LtE", "GtE"),
    "LtE": ("Lt", "Gt"),
    "Gt": ("GtE", "LtE"),
    "GtE": ("Gt", "Lt"),
    "Eq": ("NotEq",),
    "NotEq": ("Eq",),
    "Is": ("IsNot",),
    "IsNot": ("Is",),
}
"""A comparison becomes the one with the other edge, and its opposite; the other five say no more."""
ANOTHER = {
    "Add": "Sub",
    "Sub": "Add",
    "Mul": "Div",
    "Div": "Mul",
    "FloorDiv": "Mul",
    "Mod": "Mul",
    "Pow": "Mul",
    "BitOr": "BitAnd",
    "BitAnd": "BitOr",
    "BitXor": "BitAnd",
    "LShift": "RShift",
    "RShift": "LShift",
}
"""An operation becomes one other; what is killed with one is killed with nearly all."""
USED = (
    *(
        f"ReplaceComparisonOperator_{one}_{other}"
        for one, others in OPPOSITE_AND_NEXT.items()
        for other in others
    ),
    *(f"ReplaceBinaryOperator_{one}_{other}" for one, other in ANOTHER.items()),
    "ReplaceUnaryOperator_Delete_Not",
    "ReplaceUnaryOperator_Delete_USub",
    "ReplaceUnaryOperator_Delete_Invert",
    "AddNot",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
    "ExceptionReplacer",
    "NumberReplacer",
    "RemoveDecorator",
    "ZeroIterationForLoop",
)


def mutants(source: str) -> list[dict[str, object]]:
    """Return every mutant that the operators make of a source."""
    import parso
    from cosmic_ray.ast import ast_nodes
    from cosmic_ray.operators.provider import OperatorProvider

    provider, found = OperatorProvider(), []
    tree = parso.parse(source)
    nodes = list(ast_nodes(tree))
    for name in USED:
        operator = provider[name]()
        for node in nodes:
            for index, ((line, column), _) in enumerate(operator.mutation_positions(node)):
                siblings = node.parent.children
                at = siblings.index(node)
                siblings[at] = copy = deepcopy(node, {id(node.parent): node.parent})
                try:
                    changed = operator.mutate(copy, index)
                except AttributeError:  # cosmic-ray does not replace the names of exceptions that have a dot
                    changed = copy
                siblings[at : at + 1] = [] if changed is None else [changed]
                found.append({"operator": name, "line": line, "column": column, "source": tree.get_code()})
                siblings[at : at + (changed is not None)] = [node]
    return found


if __name__ == "__main__":
    json.dump(mutants(sys.stdin.read()), sys.stdout)
