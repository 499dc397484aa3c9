"""Small dense linear algebra in fixed order: elimination, eigenvalues.

LAPACK would make the bits depend on the library and the processor. Matrices have at most some 25 rows.
"""

import math
from collections.abc import Sequence

Matrix = list[list[float]]
Vector = list[float]

#: Iterations for one eigenvalue, and after how many an exceptional shift is used.
_MOST, _EXCEPTIONAL = 60, 10
_EPSILON = 2.0**-52


def solve(matrix: Sequence[Sequence[float]], right: Sequence[float]) -> Vector | None:
    """Solve ``matrix x = right`` by elimination with partial pivoting; None where the matrix is singular.

    Parameters
    ----------
    matrix : shape (n, n)
    right : shape (n,)
    """
    a = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    n = len(a)
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(a[i][k]))
        if a[pivot][k] == 0.0 or not math.isfinite(a[pivot][k]):
            return None
        a[k], a[pivot] = a[pivot], a[k]
        for i in range(k + 1, n):
            factor = a[i][k] / a[k][k]
            if factor != 0.0:
                for j in range(k, n + 1):
                    a[i][j] -= factor * a[k][j]
    x = [0.0] * n
    for k in range(n - 1, -1, -1):
        value = a[k][n]
        for j in range(k + 1, n):
            value -= a[k][j] * x[j]
        x[k] = value / a[k][k]
    return x if all(map(math.isfinite, x)) else None


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """The scalar product, its terms added in order."""
    total = 0.0
    for x, y in zip(a, b, strict=True):
        total += x * y
    return total


def norm(a: Sequence[float]) -> float:
    """The Euclidean norm."""
    return math.sqrt(dot(a, a))


def eigenvalues(matrix: Sequence[Sequence[float]]) -> tuple[complex, ...]:
    """All eigenvalues, those of largest modulus first, by Francis' QR algorithm with double shifts.

    Parameters
    ----------
    matrix : shape (n, n), finite

    Raises
    ------
    ArithmeticError
        If an eigenvalue does not converge.
    """
    h = _hessenberg([list(row) for row in matrix])
    found: list[complex] = []
    last, shift, tries = len(h) - 1, 0.0, 0
    scale = sum(abs(value) for row in h for value in row)
    while last >= 0:
        low = _small_subdiagonal(h, last, scale)
        corner = h[last][last]
        if low == last:
            found.append(complex(corner + shift))
            last, tries = last - 1, 0
            continue
        above = h[last - 1][last - 1]
        product = h[last][last - 1] * h[last - 1][last]
        if low == last - 1:
            found += _pair(above, corner, product, shift)
            last, tries = last - 2, 0
            continue
        if tries == _MOST:
            raise ArithmeticError("an eigenvalue did not converge")
        if tries and tries % _EXCEPTIONAL == 0:
            shift += corner
            for i in range(last + 1):
                h[i][i] -= corner
            size = abs(h[last][last - 1]) + abs(h[last - 1][last - 2])
            corner = above = 0.75 * size
            product = -0.4375 * size * size
        tries += 1
        _sweep(h, low, last, corner, above, product)
    # Conjugate pairs stay together, the one above the real axis first.
    return tuple(sorted(found, key=lambda value: (-abs(value), -value.real, -value.imag)))


def _hessenberg(a: Matrix) -> Matrix:
    """The matrix reduced to Hessenberg form by elimination, in place."""
    n = len(a)
    for m in range(1, n - 1):
        pivot = max(range(m, n), key=lambda i: abs(a[i][m - 1]))
        x = a[pivot][m - 1]
        if pivot != m:
            a[m], a[pivot] = a[pivot], a[m]
            for row in a:
                row[m], row[pivot] = row[pivot], row[m]
        if x == 0.0:
            continue
        for i in range(m + 1, n):
            y = a[i][m - 1] / x
            if y != 0.0:
                for j in range(m - 1, n):
                    a[i][j] -= y * a[m][j]
                for row in a:
                    row[m] += y * row[i]
        for i in range(m + 1, n):
            a[i][m - 1] = 0.0
    return a


def _small_subdiagonal(h: Matrix, last: int, scale: float) -> int:
    """The row at which the active block that ends with row ``last`` begins."""
    for low in range(last, 0, -1):
        size = abs(h[low - 1][low - 1]) + abs(h[low][low])
        if abs(h[low][low - 1]) <= _EPSILON * (size if size > 0.0 else scale):
            h[low][low - 1] = 0.0
            return low
    return 0


def _pair(above: float, corner: float, product: float, shift: float) -> list[complex]:
    """The eigenvalues of a block of two rows."""
    p = 0.5 * (above - corner)
    q = p * p + product
    z = math.sqrt(abs(q))
    corner += shift
    if q < 0.0:
        return [complex(corner + p, z), complex(corner + p, -z)]
    z = p + math.copysign(z, p)
    return [complex(corner + z), complex(corner - product / z if z != 0.0 else corner + z)]


def _sweep(h: Matrix, low: int, last: int, corner: float, above: float, product: float) -> None:
    """One double QR step on the rows ``low`` .. ``last``, in place."""
    begin = last - 2
    while True:
        z = h[begin][begin]
        r, s = corner - z, above - z
        p = (r * s - product) / h[begin + 1][begin] + h[begin][begin + 1]
        q = h[begin + 1][begin + 1] - z - r - s
        r = h[begin + 2][begin + 1]
        size = abs(p) + abs(q) + abs(r)
        p, q, r = p / size, q / size, r / size
        if begin == low:
            break
        left = abs(h[begin][begin - 1]) * (abs(q) + abs(r))
        right = abs(p) * (abs(h[begin - 1][begin - 1]) + abs(z) + abs(h[begin + 1][begin + 1]))
        if left <= _EPSILON * right:
            break
        begin -= 1
    for i in range(begin + 2, last + 1):
        h[i][i - 2] = 0.0
        if i > begin + 2:
            h[i][i - 3] = 0.0
    for k in range(begin, last):
        three = k + 1 < last
        size = 1.0
        if k > begin:
            p, q, r = h[k][k - 1], h[k + 1][k - 1], h[k + 2][k - 1] if three else 0.0
            size = abs(p) + abs(q) + abs(r)
            if size == 0.0:
                continue
            p, q, r = p / size, q / size, r / size
        s = math.copysign(math.sqrt(p * p + q * q + r * r), p)
        if k > begin:
            h[k][k - 1] = -s * size
        elif low < begin:
            h[k][k - 1] = -h[k][k - 1]
        _reflect(h, low, last, k, (p + s, q, r, s), three=three)


def _reflect(h: Matrix, low: int, last: int, k: int, vector: tuple[float, float, float, float], *, three: bool) -> None:
    """Apply one Householder reflection to rows and columns ``k`` .. ``k + 2``."""
    p, q, r, s = vector
    x, y, z = p / s, q / s, r / s
    q, r = q / p, r / p
    for j in range(k, last + 1):
        value = h[k][j] + q * h[k + 1][j]
        if three:
            value += r * h[k + 2][j]
            h[k + 2][j] -= value * z
        h[k + 1][j] -= value * y
        h[k][j] -= value * x
    for i in range(low, min(last, k + 3) + 1):
        value = x * h[i][k] + y * h[i][k + 1]
        if three:
            value += z * h[i][k + 2]
            h[i][k + 2] -= value * r
        h[i][k + 1] -= value * q
        h[i][k] -= value
