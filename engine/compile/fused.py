"""Placement of fused multiply-adds in lane loops: decided here, from the source, and not by LLVM's back end.

A back end that may contract chooses according to its instructions, which differ between processors. So contraction is
disabled, and a product that is an operand of a sum or difference is fused with it; of two products, the right one. The
newest term of a sum comes last, and the terms before it are known by then. All other products are rounded.
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
    """The statements of ``text`` with ``fma(a, b, c)``, which is ``a*b + c`` rounded once, according to the rule."""
    tree = _Fuse().visit(ast.parse(text))
    assert isinstance(tree, ast.Module)
    return tree
