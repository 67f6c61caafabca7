"""Sparse nonlinear programs made of many small blocks with exact first derivatives.

A block kind is a small function of some variables z and parameters: residuals r, of which ½‖r‖² is
minimised, and constraints c. An instance says which variables of the program its z are. Gradient
and Jacobian are exact. The Hessian of the Lagrangian is put together block by block: exact where
a kind gives it, else that of Gauss and Newton, JᵀJ. Symbols: x (n) variables,
f = Σ ½‖r‖² + priceᵀx, g = (c of all instances, A x).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csc_matrix

from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Instances of one kind of block.

    Attributes
    ----------
    name : of the term, for diagnosis.
    function : (z, p) → (r, J_r, c, J_c); dense.
    index : which variables each instance has, (N, len z).
    parameters : (N, len p).
    lower, upper : bounds of c, (N, len c).
    hessian : (z, p, multipliers of c, factor) → the Hessian of factor · ½‖r‖² + λᵀc, dense; or
        None for Gauss–Newton's.
    """

    name: str
    function: ca.Function
    index: NDArray[np.int64]
    parameters: Array
    lower: Array
    upper: Array
    hessian: ca.Function | None = None


def block_function(
    name: str,
    z: ca.SX | ca.MX,
    p: ca.SX | ca.MX,
    residuals: ca.SX | ca.MX,
    constraints: ca.SX | ca.MX,
) -> ca.Function:
    """Return the function of a block kind with its Jacobians."""
    outputs = [residuals, ca.jacobian(residuals, z), constraints, ca.jacobian(constraints, z)]
    return ca.Function(name, [z, p], [ca.densify(x) for x in outputs])


@dataclass(frozen=True)
class Program:
    """A program ready for `nlpsol`, with the order of its constraints.

    `constraint_names` gives for each row of g its block; `terms` evaluates each block's cost.
    """

    nlp: dict[str, ca.MX]
    options: dict[str, ca.Function]
    lower: Array
    upper: Array
    constraint_names: tuple[str, ...]
    terms: ca.Function
    term_names: tuple[str, ...]


def assemble(
    count: int,
    blocks: Sequence[Block],
    linear: csc_matrix,
    linear_value: Array,
    price: Array,
    caution: float = 1.0,
) -> Program:
    """Return the program of all blocks, of A x = b, and of a linear price on variables.

    caution : factor on all of Gauss and Newton's Hessians; above 1 steps are shorter and surer.

    Raises
    ------
    MotionStyleError
        If an index lies outside the variables.
    """
    x, p = ca.MX.sym("x", count), ca.MX.sym("p", 0)
    total = sum(len(b.index) * b.lower.shape[1] for b in blocks) + len(linear_value)
    x, p = ca.MX.sym("x", count), ca.MX.sym("p", 0)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", total)
    costs, constraints, names = [], [], []
    gradient = [ca.MX(ca.DM(price))]
    hessians, jacobians = _Entries(), _Entries()
    lower, upper, start = [], [], 0
    for block in blocks:
        number, size = block.index.shape
        if block.index.size and (block.index.min() < 0 or block.index.max() >= count):
            raise MotionStyleError(f"block {block.name}: a variable index outside 0…{count - 1}")
        z = ca.reshape(x[block.index.ravel().tolist()], size, number)
        parameters = ca.DM(block.parameters.T)
        r, jr, c, jc = block.function.map(number)(z, parameters)
        residuals, rows = r.shape[0], c.shape[0]
        costs.append(ca.sumsqr(r) / 2 if residuals else ca.MX(0))
        grad, hess = _products(residuals, size).map(number)(r, jr)
        gradient.append(_scatter(ca.vec(grad), block.index.ravel(), count))
        hessian = lam_f * caution * ca.vec(hess)
        if block.hessian is not None:
            multipliers = ca.reshape(lam_g[start : start + number * rows], rows, number)
            factor = ca.repmat(caution * lam_f, 1, number)
            hessian = ca.vec(block.hessian.map(number)(z, parameters, multipliers, factor))
        # CasADi stores by columns: rows run fastest
        hessians.add(hessian, np.tile(block.index, (1, size)), np.repeat(block.index, size, axis=1))
        own = start + np.arange(number * rows).reshape(number, rows)
        constraints.append(ca.vec(c))
        jacobians.add(ca.vec(jc), np.tile(own, (1, size)), np.repeat(block.index, rows, axis=1))
        lower.append(block.lower.ravel())
        upper.append(block.upper.ravel())
        names += [block.name] * (number * rows)
        start += number * rows
    a = linear.tocoo()
    jacobians.add(ca.MX(ca.DM(a.data)), start + a.row, a.col)
    every = np.arange(count)
    hessians.add(ca.MX(ca.DM.zeros(count)), every, every)  # a diagonal entry for each variable
    g = ca.vertcat(*constraints, ca.MX(_dm(linear)) @ x)
    f = sum(costs) + ca.dot(ca.DM(price), x)
    lower.append(linear_value)
    upper.append(linear_value)
    names += ["leg subspace"] * len(linear_value)
    jacobian = jacobians.matrix((total, count))
    hessian = hessians.matrix((count, count), upper=True)
    options = _functions(x, p, (lam_f, lam_g), (f, g), (sum(gradient), jacobian, hessian))
    return Program(
        {"x": x, "f": f, "g": g},
        options,
        np.concatenate(lower),
        np.concatenate(upper),
        tuple(names),
        ca.Function("terms", [x], [ca.vertcat(*costs)]),
        tuple(block.name for block in blocks),
    )


def _functions(
    x: ca.MX,
    p: ca.MX,
    multipliers: tuple[ca.MX, ca.MX],
    values: tuple[ca.MX, ca.MX],
    derivatives: tuple[ca.MX, ca.MX, ca.MX],
) -> dict[str, ca.Function]:
    """Return the derivatives in the form in which `nlpsol` takes them."""
    (f, g), (gradient, jacobian, hessian) = values, derivatives
    return {
        "grad_f": ca.Function("nlp_grad_f", [x, p], [f, gradient], ["x", "p"], ["f", "grad:f:x"]),
        "jac_g": ca.Function("nlp_jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac:g:x"]),
        "hess_lag": ca.Function(
            "nlp_hess_l",
            [x, p, *multipliers],
            [hessian],
            ["x", "p", "lam:f", "lam:g"],
            ["triu:hess:gamma:x:x"],
        ),
    }


def _products(residuals: int, size: int) -> ca.Function:
    """Return (r, J) → (Jᵀr, JᵀJ)."""
    r, j = ca.MX.sym("r", residuals), ca.MX.sym("j", residuals, size)
    return ca.Function("products", [r, j], [j.T @ r, j.T @ j])


def _dm(matrix: csc_matrix) -> ca.DM:
    """Return a SciPy matrix as CasADi's."""
    m = csc_matrix(matrix)
    m.sort_indices()
    pattern = ca.Sparsity(*m.shape, m.indptr.tolist(), m.indices.tolist())
    return ca.DM(pattern, m.data)


def _scatter(values: ca.MX, index: NDArray[np.int64], count: int) -> ca.MX:
    """Return the vector (count) in which values are added up at their indices."""
    matrix = coo_matrix((np.ones(len(index)), (index, np.arange(len(index)))), (count, len(index)))
    return ca.MX(_dm(matrix.tocsc())) @ values


@dataclass
class _Entries:
    """Entries (value, row, column) of a sparse matrix; equal places add up."""

    values: list[ca.MX] = field(default_factory=list)
    rows: list[NDArray[np.int64]] = field(default_factory=list)
    columns: list[NDArray[np.int64]] = field(default_factory=list)

    def add(self, values: ca.MX, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> None:
        """Add entries in the order of the raveled index arrays."""
        self.values.append(values)
        self.rows.append(np.asarray(rows).ravel())
        self.columns.append(np.asarray(columns).ravel())

    def matrix(self, shape: tuple[int, int], *, upper: bool = False) -> ca.MX:
        """Return the matrix, or its upper triangle."""
        row, column = np.concatenate(self.rows), np.concatenate(self.columns)
        kept = np.flatnonzero(row <= column) if upper else np.arange(len(row))
        keys = column[kept] * shape[0] + row[kept]
        unique, place = np.unique(keys, return_inverse=True)
        ones = np.ones(len(kept))
        gather = coo_matrix((ones, (place, kept)), (len(unique), len(row))).tocsc()
        pattern = ca.Sparsity.triplet(
            *shape, (unique % shape[0]).tolist(), (unique // shape[0]).tolist()
        )
        return ca.sparsity_cast(ca.MX(_dm(gather)) @ ca.vertcat(*self.values), pattern)
