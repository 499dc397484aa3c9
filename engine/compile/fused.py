"""Where lane loops use fused multiply-adds: decided here, by what is written, and not by LLVM's back end.

A back end that is allowed to contract fuses as suits its instructions, and each processor's differs. So nothing may be
contracted, and a product that stands as an operand of a sum or a difference is fused with it, the right one of two:
the newest term of a sum comes last, and what is before it is known by then. All other products are rounded.
"""

import ast
from typing import TypeGuard


class _Fuse(ast.NodeTransformer):
    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        if not isinstance(node.op, (ast.Add, ast.Sub)):
            return node
        minus = isinstance(node.op, ast.Sub)
        product, other = node.right, node.left
        if _is_product(product):
            return _fma(_negative(product.left) if minus else product.left, product.right, other)
        product, other = node.left, node.right
        if _is_product(product):
            return _fma(product.left, product.right, _negative(other) if minus else other)
        return node


def _is_product(node: ast.expr) -> TypeGuard[ast.BinOp]:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult)


def _negative(node: ast.expr) -> ast.expr:
    return ast.UnaryOp(ast.USub(), node)


def _fma(a: ast.expr, b: ast.expr, c: ast.expr) -> ast.expr:
    return ast.Call(ast.Name("fma", ast.Load()), [a, b, c], [])


def fused(text: str) -> ast.Module:
    """The statements of ``text`` with ``fma(a, b, c)``, which is ``a*b + c`` rounded once, wherever the rule has it."""
    tree = _Fuse().visit(ast.parse(text))
    assert isinstance(tree, ast.Module)
    return tree
