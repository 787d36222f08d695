"""Reads one function: its statements, what each computes, and the edits that can be made."""

from __future__ import annotations

import ast
import re

from muslin import tasks
from muslin.authoring import substitutes
from muslin.authoring.edits import statements
from muslin.authoring.edits.gathered import branches, swaps, together
from muslin.authoring.edits.pieces import number, shape_of, terms
from muslin.authoring.edits.words import Change, Edit


class Reader:
    """Reads one function: its statements, what each computes, and the edits that can be made."""

    def __init__(self, function: ast.FunctionDef, source: list[str], task: tasks.Task):
        self.function, self.source = function, source
        number(function)
        self.kinds = {value.name: value.kind for value in task.arguments}
        self.arguments = list(self.kinds)
        self.loops = {ast.unparse(node.target) for node in ast.walk(function) if isinstance(node, ast.For)}
        self.scalars = [name for name, kind in self.kinds.items() if kind == "scalar"]
        self.atoms, self.parts = substitutes.atoms(self), substitutes.parts(self)
        self.said: dict[str, str] = {}  # local name -> what it is
        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                self.said.setdefault(node.targets[0].id, self.place(node))
            elif isinstance(node, ast.For):
                self.said.setdefault(ast.unparse(node.target), f"the index {ast.unparse(node.target)}")

    def place(self, statement: ast.stmt) -> str:
        """What a line computes, as its comment says; of a line without one, no more than whose it is."""
        line = self.source[(statement.end_lineno or statement.lineno) - 1]
        return line.partition("#")[2].strip() or "your answer"

    def shown(self, node: ast.AST) -> str:
        """What stands somewhere: as it is written where that is short and made of arguments, else in words."""
        inside = list(ast.walk(node))
        names = {n.id for n in inside if isinstance(n, ast.Name)}
        short = (
            len(inside) <= 9 and names <= set(self.kinds) and not isinstance(node, (ast.Name, ast.Constant))
        )
        return ast.unparse(node) if short and names else self.told(node)

    def instead(self, new: ast.AST, old: ast.AST) -> str:
        """Words for one part in place of another."""
        stands, belongs = self.shown(new), self.told(old)
        if stands == belongs:
            return f"another part than {belongs} stands"
        return f"{stands} stands where {belongs} belongs"

    def told(self, node: ast.AST) -> str:
        """An operand in words that give no formula away."""
        if isinstance(node, ast.Name):
            return node.id if node.id in self.kinds else self.said.get(node.id, "a quantity")
        if isinstance(node, ast.Constant):
            return f"the number {node.value!r}"
        if isinstance(node, ast.Subscript) and ast.unparse(node.value) in self.kinds:
            return ast.unparse(node)
        names = sorted({n.id for n in ast.walk(node) if isinstance(n, ast.Name)} & set(self.kinds))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and not names:
            return "a number"
        entries = [
            n for n in ast.walk(node) if isinstance(n, ast.Subscript) and ast.unparse(n.value) in names
        ]
        if entries:
            taken = sorted({ast.unparse(entry) for entry in entries})
            names = [*taken, *(name for name in names if not any(e.startswith(f"{name}[") for e in taken))]
            return f"the {'sum' if terms(node) else 'part'} with {' and '.join(names)}"  # type: ignore[arg-type]
        if names:
            return f"the part with {' and '.join(names)}"
        locals_ = [self.said[n.id] for n in ast.walk(node) if isinstance(n, ast.Name) and n.id in self.said]
        return f"the part with {locals_[0]}" if locals_ else "a part"

    def edits(self) -> list[Edit]:
        """Everything that can be changed: one thing, or the same thing throughout."""
        singles = [edit for edit in statements.changes(self, self.function.body) if edit.changes]
        return [*singles, *branches(self), *together(singles), *swaps(self)]

    def edit(
        self, kind: str, detail: str, place: str, of: str, node: ast.AST, change: Change, statement: ast.stmt
    ) -> Edit:
        """An edit of one node; lines that differ in digits and names of their own are alike."""
        names = "|".join(map(re.escape, self.said)) or "$."
        shape, line = (re.sub(rf"\b({names})\b", "_", shape_of(text)) for text in (node, statement))
        return Edit(kind, detail, place, of, shape, {node.number: change}, line)  # type: ignore[attr-defined]
