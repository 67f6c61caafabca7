"""Generated code: the same numbers as the virtual machine, built once, and not needed."""

import platform

import casadi as ca
import numpy as np
import pytest

from motionstyle.dynamics import codegen, lanes
from motionstyle.errors import MotionStyleError
from motionstyle.files import read_json, write_json


def functions():
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
    value = ca.vertcat(p[0] * ca.sin(x[0]) * x[1], x[2] ** 2 + p[1])
    return (ca.Function("small", [x, p], [value, ca.jacobian(value, x)]),)


def compiled(tmp_path, log):
    where = tmp_path / "run" / "library.json"
    codegen.compile_library(functions(), where, tmp_path / "cache", log.append)
    return where


needs_compiler = pytest.mark.skipif(codegen.find_compiler() is None, reason="no C compiler")


@needs_compiler
def test_compiled_code_gives_what_the_virtual_machine_gives(tmp_path):
    fast = codegen.load_functions(functions, compiled(tmp_path, []))["small"]
    slow = codegen.load_functions(functions, None)["small"]
    assert fast.loop is not None
    assert slow.loop is None
    x, p = np.random.default_rng(0).standard_normal((7, 3)), np.array([2.0, -1.0])
    for one, other in zip(fast(x, p), slow(x, p), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-14)
    np.testing.assert_allclose(fast(x, p)[0][:, 1], x[:, 2] ** 2 - 1)
    rows, columns = fast.pattern(1)
    assert list(zip(rows, columns, strict=True)) == [(0, 0), (0, 1), (1, 2)]


@needs_compiler
@pytest.mark.skipif(platform.machine() != "x86_64", reason="these options are of x86")
@pytest.mark.parametrize(("without", "at_once"), [("-mno-avx512f", (2, 4)), ("-mno-avx", (2,))])
def test_narrower_processors_get_the_same_numbers(tmp_path, monkeypatch, without, at_once):
    monkeypatch.setattr(codegen, "FLAGS", (*codegen.FLAGS, without))
    narrow = codegen.load_functions(functions, compiled(tmp_path, []))["small"]
    slow = codegen.load_functions(functions, None)["small"]
    assert narrow.lanes in at_once
    for frames in (1, 2, 5, 9):  # more and fewer than lanes
        x = np.random.default_rng(frames).standard_normal((frames, 3))
        for one, other in zip(narrow(x, np.ones(2)), slow(x, np.ones(2)), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-14)


@needs_compiler
@pytest.mark.parametrize("assignments", [1, 3])
def test_code_in_many_pieces_gives_the_same_numbers(tmp_path, monkeypatch, assignments):
    monkeypatch.setattr(lanes, "PIECE", assignments)
    cut = codegen.load_functions(functions, compiled(tmp_path, []))["small"]
    slow = codegen.load_functions(functions, None)["small"]
    for frames in (1, 8, 31, 32, 33, 70):  # more and fewer than go through a piece at once
        x = np.random.default_rng(frames).standard_normal((frames, 3))
        for one, other in zip(cut(x, np.ones(2)), slow(x, np.ones(2)), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-14)


def test_code_that_casadi_writes_otherwise_is_refused():
    with pytest.raises(ValueError, match="no small as CasADi"):
        lanes.in_lanes("static int casadi_f0(void) { return 0; }", ["small"])


@needs_compiler
def test_a_library_of_another_version_is_named(tmp_path):
    where = compiled(tmp_path, [])
    known = read_json(where)
    known["functions"]["other"] = known["functions"]["small"]
    write_json(where, known)
    with pytest.raises(MotionStyleError, match=r"library\.json names functions .* delete it"):
        codegen.load_functions(functions, where)


@needs_compiler
def test_parameters_may_differ_from_frame_to_frame(tmp_path):
    fast = codegen.load_functions(functions, compiled(tmp_path, []))["small"]
    x, p = np.ones((4, 3)), np.arange(8.0).reshape(4, 2)
    np.testing.assert_allclose(fast(x, p)[0][:, 1], 1 + p[:, 1])


@needs_compiler
def test_the_same_code_is_compiled_once(tmp_path):
    log = []
    compiled(tmp_path, log)
    compiled(tmp_path, log)
    assert [line.split()[0] for line in log] == ["compiling", "built", "compiled"]
    assert len(list((tmp_path / "cache" / "code").glob("*.so"))) == 1


def test_without_a_compiler_the_virtual_machine_serves_and_the_log_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(codegen, "find_compiler", lambda: None)
    log = []
    where = compiled(tmp_path, log)
    assert "virtual machine" in log[0]
    assert read_json(where)["library"] is None
    found = codegen.load_functions(functions, where)["small"]
    assert found.loop is None
    assert found(np.ones((2, 3)), np.ones(2))[0].shape == (2, 2)


def test_a_library_that_is_gone_is_done_without(tmp_path):
    where = tmp_path / "library.json"
    where.write_text('{"library": "/nowhere/at/all.so", "compiler": "cc"}')
    assert codegen.load_functions(functions, where)["small"].loop is None


def test_a_compiler_that_fails_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(codegen, "find_compiler", lambda: "false")
    with pytest.raises(MotionStyleError, match="the C compiler false failed"):
        compiled(tmp_path, [])


def test_arguments_of_the_wrong_shape_are_refused():
    slow = codegen.load_functions(functions, None)["small"]
    with pytest.raises(ValueError, match=r"small: argument 0 is \(2, 4\), expected \(2, 3\)"):
        slow(np.ones((2, 4)), np.ones(2))
