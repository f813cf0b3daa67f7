# SPDX-License-Identifier: Apache-2.0
"""magnum against numpy and closed forms, and the properties of Vector3 that habitat-lab relies on."""

import copy
import math
import pickle

import magnum as mn
import numpy as np
import pytest

RNG = np.random.default_rng(1)


def vectors(count=20, size=3):
    return RNG.normal(size=(count, size)).astype(np.float32).astype(float)


def rotations(count=20):
    """Random rotations as (angle, axis)."""
    for axis in vectors(count):
        yield RNG.uniform(-3, 3), axis / np.linalg.norm(axis)


def rodrigues(angle, axis):
    """Rotation matrix of an angle and an axis."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def test_a_vector_gives_python_floats_one_bool_and_float32_arrays():
    v = mn.Vector3(1, 2, 3)
    assert [type(x) for x in v] == [float] * 3 and type(v[1]) is float and type(v.z) is float
    assert (v == mn.Vector3(1, 2, 3)) is True and (v == [1, 2, 4]) is False and (v != (1, 2, 4)) is True
    assert isinstance(v - np.array([1.0, 1, 1]), mn.Vector3)
    array = np.array(v)
    assert array.dtype == np.float32 and array.shape == (3,) and array.tolist() == [1, 2, 3]
    assert np.allclose([v, v], [[1, 2, 3]] * 2) and np.isclose(np.linalg.norm(v), math.sqrt(14))
    assert list(mn.Vector3(0.1, 0, 0))[0] == float(np.float32(0.1))
    with pytest.raises(TypeError):
        hash(v)


@pytest.mark.parametrize("kind, size", [(mn.Vector2, 2), (mn.Vector3, 3), (mn.Vector4, 4)])
def test_vector_arithmetic_is_that_of_numpy(kind, size):
    for a, b in zip(vectors(20, size), vectors(20, size)):
        v, w = kind(*a), kind(b)
        for got, want in (
            (v + w, a + b), (v - b, a - b), (list(b) - v, b - a), (v * w, a * b), (2 * v, 2 * a),
            (v * np.float32(3), 3 * a), (v / 2, a / 2), (v / w, a / b), (-v, -a),
            (v.normalized(), a / np.linalg.norm(a)),
            (v.projected(w), b * (a @ b) / (b @ b)), (v.flipped(), a[::-1]), (mn.math.min(v, w), np.minimum(a, b)),
            (mn.math.clamp(v, -0.5, 0.5), np.clip(a, -0.5, 0.5)), (mn.math.lerp(v, w, 0.25), 0.75 * a + 0.25 * b),
        ):  # fmt: skip
            assert isinstance(got, kind) and np.allclose(got, want, rtol=1e-5, atol=1e-6)
        for got, want in ((v.dot(), a @ a), (mn.math.dot(v, w), a @ b), (v.length(), np.linalg.norm(a)),
                          (v.sum(), a.sum()), (v.product(), a.prod()), (v.min(), a.min()),
                          (v.max(), a.max())):  # fmt: skip
            assert math.isclose(got, want, rel_tol=1e-5, abs_tol=1e-6)


def test_vector_constructors_parts_and_copies():
    assert mn.Vector3() == [0, 0, 0] and mn.Vector3.zero_init() == [0, 0, 0] and mn.Vector3(2) == [2, 2, 2]
    assert mn.Vector3(mn.Vector2(1, 2), 3) == [1, 2, 3] and mn.Vector4(mn.Vector3(1, 2, 3), 4).xyz == [1, 2, 3]
    assert mn.Vector3.y_axis() == [0, 1, 0] and mn.Vector3.z_axis(-2) == [0, 0, -2]
    v = mn.Vector3(1, 2, 3)
    v.y, v[2] = 5, 6
    v.xy = v.xy * 2
    assert v == [2, 10, 6]
    for twin in (copy.copy(v), copy.deepcopy(v), pickle.loads(pickle.dumps(v)), mn.Vector3(v)):
        assert twin == v and twin is not v
    for bad in ("abc", [1, 2], [[1, 2, 3]], None, {1: 2, 3: 4, 5: 6}):
        with pytest.raises(TypeError):
            mn.Vector3(bad)
    with pytest.raises(TypeError):
        mn.Vector3(1, 2)
    assert math.isnan(mn.Vector3(0).normalized().x) and (mn.Vector3(1) / 0).x == math.inf


def test_cross_product_and_angle():
    for a, b in zip(vectors(), vectors()):
        assert np.allclose(mn.math.cross(mn.Vector3(a), mn.Vector3(b)), np.cross(a, b), atol=1e-5)
        got = float(mn.math.angle(mn.Vector3(a).normalized(), mn.Vector3(b).normalized()))
        assert math.isclose(got, math.acos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)), abs_tol=1e-3)
    with pytest.raises(ValueError, match="length 1"):
        mn.math.angle(mn.Vector3(2, 0, 0), mn.Vector3(1, 0, 0))


def test_angles_convert_between_units():
    assert float(mn.Rad(mn.Deg(180))) == math.pi and mn.Deg(mn.Rad(math.pi)) == mn.Deg(180)
    assert mn.Deg(90) + mn.Rad(math.pi / 2) == mn.Deg(180) and mn.Deg(90) * 2 == mn.Deg(180)
    assert mn.Deg(90) / mn.Deg(45) == 2 and -mn.Deg(3) == mn.Rad(mn.Deg(-3)) and mn.Deg(10) < mn.Rad(1)
    with pytest.raises(TypeError):
        mn.Quaternion.rotation(1.0, mn.Vector3.x_axis())


def test_quaternions_turn_like_rodrigues_formula():
    for angle, axis in rotations():
        q = mn.Quaternion.rotation(mn.Rad(angle), mn.Vector3(axis))
        matrix = rodrigues(angle, axis)
        for v in vectors(4):
            assert np.allclose(q.transform_vector(v), matrix @ v, atol=1e-5)
            assert np.allclose((q * 3).transform_vector(v), matrix @ v, atol=1e-5)
        assert np.allclose(np.array(q.to_matrix()), matrix, atol=1e-5)
        back = mn.Quaternion.from_matrix(q.to_matrix())
        assert back == q or back == -q
        assert np.allclose((q * q.inverted()).xyzw, [0, 0, 0, 1], atol=1e-5)
        assert q.inverted_normalized() == q.conjugated()
        other_angle, other_axis = next(rotations(1))
        product = q * mn.Quaternion.rotation(mn.Rad(other_angle), mn.Vector3(other_axis))
        assert np.allclose(np.array(product.to_matrix()), matrix @ rodrigues(other_angle, other_axis), atol=1e-5)


def test_quaternion_parts_constructors_and_errors():
    q = mn.Quaternion(mn.Vector3(1, 2, 3), 4)
    assert q == mn.Quaternion(((1, 2, 3), 4)) and q.vector == [1, 2, 3] and q.scalar == 4.0
    assert q.xyzw == [1, 2, 3, 4] and q.wxyz == [4, 1, 2, 3] and q.dot() == 30
    assert mn.Quaternion() == mn.Quaternion.identity_init() == mn.Quaternion(mn.Vector3(), 1)
    assert pickle.loads(pickle.dumps(q)) == q and copy.deepcopy(q) == q
    long = mn.Quaternion(mn.Vector3(2, 0, 0), 2)
    for call in (long.inverted_normalized, long.angle, long.axis, lambda: long.transform_vector_normalized([0, 1, 0]),
                 lambda: mn.math.slerp(long, mn.Quaternion(), 0.5), lambda: mn.math.slerp(mn.Quaternion(), long, 0.5),
                 lambda: mn.Vector3(1, 2, 3).projected_onto_normalized([0, 2, 0])):  # fmt: skip
        with pytest.raises(ValueError, match="does not have length 1"):
            call()
    assert mn.Vector3(1, 2, 3).projected_onto_normalized([0, 1, 0]) == mn.Vector3(0, 2, 0)
    half = mn.math.slerp(mn.Quaternion(), mn.Quaternion.rotation(mn.Deg(80), mn.Vector3.z_axis()), 0.5)
    assert half == mn.Quaternion.rotation(mn.Deg(40), mn.Vector3.z_axis())
    assert half.angle() == mn.Deg(40) and half.axis() == [0, 0, 1]
    with pytest.raises(ValueError, match="length 1"):
        mn.Quaternion.rotation(mn.Deg(1), mn.Vector3(1, 1, 0))
    with pytest.raises(ValueError, match="no rotation"):
        mn.Quaternion.from_matrix(mn.Matrix3() * 2)


def test_matrices_multiply_transform_and_invert_like_numpy():
    for a, b in zip(RNG.normal(size=(10, 4, 4)), RNG.normal(size=(10, 4, 4))):
        m, n = mn.Matrix4(a), mn.Matrix4(b)
        assert np.allclose(np.array(m), a, atol=1e-6) and np.array(m).dtype == np.float32
        assert np.allclose(np.array(m @ n), a @ b, atol=1e-4) and np.allclose(np.array(m.transposed()), a.T, atol=1e-6)
        assert np.allclose(m @ mn.Vector4(1, 2, 3, 4), a @ [1, 2, 3, 4], atol=1e-4)
        assert (
            np.allclose(m[2], a[:, 2]) and math.isclose(m[2, 1], a[1, 2], rel_tol=1e-6) and np.allclose(m.row(1), a[1])
        )
        assert np.allclose(np.array(m.inverted()) @ a, np.eye(4), atol=1e-2)
        assert math.isclose(m.determinant(), np.linalg.det(a), rel_tol=1e-3, abs_tol=1e-4)
        p = a @ [0.1, 0.2, 0.3, 1]
        assert np.allclose(m.transform_point([0.1, 0.2, 0.3]), p[:3] / p[3], rtol=1e-3, atol=1e-4)
        assert np.allclose(m.transform_vector([0.1, 0.2, 0.3]), a[:3, :3] @ [0.1, 0.2, 0.3], atol=1e-5)
    assert mn.Matrix4((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1)).translation == [5, 6, 7]
    assert pickle.loads(pickle.dumps(m)) == m and mn.Matrix4.identity_init() == mn.Matrix4() and mn.Matrix3() != m


def test_rigid_transformations_of_matrix4():
    for angle, axis in rotations():
        r, t = rodrigues(angle, axis), vectors(1)[0]
        m = mn.Matrix4.translation(t) @ mn.Matrix4.rotation(mn.Rad(angle), mn.Vector3(axis))
        assert np.allclose(np.array(m.rotation()), r, atol=1e-5) and np.allclose(m.translation, t, atol=1e-6)
        assert m == mn.Matrix4.from_(m.rotation(), m.translation)
        assert np.allclose(np.array(m.inverted_rigid() @ m), np.eye(4), atol=1e-5)
        scaled = m @ mn.Matrix4.scaling(mn.Vector3(1, 2, 3))
        assert np.allclose(scaled.scaling(), [1, 2, 3], atol=1e-5) and np.allclose(
            np.array(scaled.rotation()), r, atol=1e-5
        )
        with pytest.raises(ValueError):
            scaled.inverted_rigid()
    m = mn.Matrix4()
    m.translation = [1, 2, 3]
    assert m.transform_point([1, 1, 1]) == [2, 3, 4]
    look = mn.Matrix4.look_at(mn.Vector3(1, 2, 3), mn.Vector3(1, 2, -9), mn.Vector3.y_axis())
    assert look == mn.Matrix4.translation((1, 2, 3))


def test_ranges():
    r = mn.Range3D(mn.Vector3(-1, -2, -3), mn.Vector3(3, 4, 5))
    assert r == mn.Range3D.from_size((-1, -2, -3), (4, 6, 8)) == mn.Range3D.from_center((1, 1, 1), (2, 3, 4))
    assert r.size() == [4, 6, 8] and r.center() == [1, 1, 1] and r.size_y() == 6 and r.center_z() == 1
    assert r.left == -1 and r.top == 4 and r.back == -3 and r.front_bottom_right == [3, -2, 5]
    assert r.contains((0, 0, 0)) and not r.contains((3, 0, 0)) and r.contains(mn.Range3D((0, 0, 0), (1, 1, 1)))
    assert r.translated((1, 0, 0)).min == [0, -2, -3] and r.padded((1, 1, 1)).max == [4, 5, 6]
    assert mn.math.join(mn.Range2D((0, 0), (1, 1)), mn.Range2D((2, -1), (3, 0))) == mn.Range2D((0, -1), (3, 1))
    assert mn.math.intersects(mn.Range1D(0, 2), mn.Range1D(1, 3)) and not mn.math.intersects(
        mn.Range1D(0, 1), mn.Range1D(1, 2)
    )
    assert mn.Range3D() == mn.Range3D((0, 0, 0), (0, 0, 0)) and pickle.loads(pickle.dumps(r)) == r


def test_colours():
    assert mn.Color4(1, 0.5, 0.25) == [1, 0.5, 0.25, 1] and mn.Color4(0.5) == [0.5, 0.5, 0.5, 1]
    assert mn.Color4(mn.Color3.green(), 0.5) == [0, 1, 0, 0.5] and mn.Color4.magenta() == [1, 0, 1, 1]
    assert all(mn.Color3.from_srgb_int(v * 0x10101).to_srgb_int() == v * 0x10101 for v in range(256))
    assert mn.Color3.from_srgb_int(0x336699).to_srgb_int() == 0x336699
    # Both parts of the curve of IEC 61966-2-1.
    assert np.allclose(list(mn.Color3.from_srgb_int(0x800AFF)), [0.21586050011, 10 / 255 / 12.92, 1], rtol=1e-10)
    assert mn.Color3.from_linear_rgb_int(0xFF0080) == [1, 0, 128 / 255]
    assert mn.Color3.from_hsv(mn.Deg(240), 1, 0.5) == [0, 0, 0.5]


def test_names_that_are_not_served_say_so():
    mn.trade.ImporterManager()
    for call in (
        mn.trade.MeshData,
        mn.MutableImageView2D,
        lambda: mn.trade.ImporterManager().load_and_instantiate("x"),
    ):
        with pytest.raises(NotImplementedError, match="gsnav.*magnum"):
            call()
    assert not hasattr(mn, "NoSuchName")
