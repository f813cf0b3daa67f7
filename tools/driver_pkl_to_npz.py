#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Converts the driver.pkl of Habitat-GS to a driver.npz, which gsnav reads.

usage: driver_pkl_to_npz.py driver.pkl driver.npz
       driver_pkl_to_npz.py --self-test            check a conversion and that hostile pickles are refused

A pickle can make its reader call any function. This reader allows only the functions that NumPy needs
to rebuild arrays and numbers. Strings and numbers become arrays of one element. Nested values are refused.
"""
import io
import os
import pathlib
import pickle
import sys
import tempfile

try:
    import numpy
except ImportError:
    numpy = None


def latin1(text, encoding):
    """Bytes from a text and its encoding, as protocols 0 to 2 write them."""
    if encoding != "latin1" or not isinstance(text, str):
        raise pickle.UnpicklingError("an encoding other than latin1")
    return text.encode("latin1")


def allowed():
    """Functions that a pickle may call, by (module, name)."""
    arrays = numpy.empty(0)
    rebuild = arrays.__reduce__()[0]  # its module differs between versions of NumPy
    scalar = numpy.float64(0).__reduce__()[0]
    names = {("numpy", "ndarray"): numpy.ndarray, ("numpy", "dtype"): numpy.dtype, ("_codecs", "encode"): latin1,
             ("__builtin__", "bytes"): bytes}  # protocols 0 to 2 write empty bytes as a call
    for module in ("numpy.core.multiarray", "numpy._core.multiarray"):
        names[module, "_reconstruct"] = rebuild
        names[module, "scalar"] = scalar
    # Protocol 5 stores the bytes of an array separately.
    frombuffer = arrays.__reduce_ex__(5)[0]
    for module in ("numpy.core.numeric", "numpy._core.numeric"):
        names[module, "_frombuffer"] = frombuffer
    return names


class ArrayUnpickler(pickle.Unpickler):
    """Unpickler that reads arrays and plain values, and refuses everything that runs code."""

    def find_class(self, module, name):
        try:
            return allowed()[module, name]
        except KeyError:
            raise pickle.UnpicklingError(f"{module}.{name} is no array, dict, list, str or number") from None


def as_array(key, value):
    if isinstance(value, (list, tuple)):
        value = numpy.asarray(value)
    if isinstance(value, (str, bytes, bool, int, float)):
        value = numpy.asarray(value)
    if isinstance(value, numpy.generic):
        value = numpy.asarray(value)
    # Arrays of objects are refused: the objects may be anything, and an npz would store them as a pickle.
    if not isinstance(value, numpy.ndarray) or value.dtype.kind not in "biufUS":
        raise ValueError(f"'{key}' is {type(value).__name__} and no array of numbers or text")
    return value


def load(data):
    try:
        driver = ArrayUnpickler(io.BytesIO(data), encoding="latin1").load()  # Python 2 wrote bytes for text
    except (ArithmeticError, AttributeError, EOFError, LookupError, MemoryError, TypeError) as error:
        raise ValueError(f"the pickle is damaged: {error}") from error
    if not isinstance(driver, dict) or not all(isinstance(k, str) for k in driver):
        raise ValueError("the pickle holds no dictionary with names")
    return {key: as_array(key, value) for key, value in driver.items() if value is not None}


def convert(source, target):
    arrays = load(pathlib.Path(source).read_bytes())
    if "joint_mats" not in arrays:
        raise ValueError("there is no joint_mats")
    aside = pathlib.Path(f"{target}.{os.getpid()}.part")
    try:
        with open(aside, "wb") as out:
            numpy.savez_compressed(out, **arrays)
            out.flush()
            os.fsync(out.fileno())
        os.replace(aside, target)
    finally:
        aside.unlink(missing_ok=True)
    return arrays


class Hostile:
    """An object whose pickle calls `function`."""

    def __init__(self, function, *arguments):
        self.call = (function, arguments)

    def __reduce__(self):
        return self.call


def self_test():
    good = {"joint_mats": numpy.tile(numpy.eye(4, dtype=numpy.float32), (5, 24, 1, 1)), "joint_mats_fps": 40.0,
            "joint_mats_space": "smpl_with_trans", "joint_mats_version": numpy.int64(1), "gender": b"neutral",
            "nothing": b"",
            "order": numpy.asfortranarray(numpy.arange(6.0).reshape(2, 3)), "betas": [0.5, 1.0], "none": None}
    with tempfile.TemporaryDirectory() as scratch:
        mark = pathlib.Path(scratch) / "ran"
        for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
            source, target = pathlib.Path(scratch) / "d.pkl", pathlib.Path(scratch) / "d.npz"
            source.write_bytes(pickle.dumps(good, protocol))
            convert(source, target)
            with numpy.load(target, allow_pickle=False) as back:
                assert set(back.files) == set(good) - {"none"}
                for key in back.files:
                    assert numpy.array_equal(back[key], numpy.asarray(good[key])), key
            bad = [Hostile(open, str(mark), "w"), Hostile(eval, f"open({str(mark)!r}, 'w')"),
                   Hostile(pathlib.Path.touch, mark), Hostile(getattr, "text", "upper"),
                   {"joint_mats": Hostile(__import__, "os")},
                    numpy.array([Hostile(open, str(mark), "w")], dtype=object),
                   {"joint_mats": numpy.array([None])}, {"joint_mats": {"a": 1}}, {"joint_mats": 1j}, [1, 2], {1: 2},
                   {"other": 1.0}]
            for number, value in enumerate(bad):
                source.write_bytes(pickle.dumps(value, protocol))
                try:
                    convert(source, target)
                except (pickle.UnpicklingError, ValueError):
                    continue
                sys.exit(f"protocol {protocol}: the bad pickle {number} was converted")
        assert not mark.exists(), "a pickle ran code"
    print(f"{pickle.HIGHEST_PROTOCOL + 1} protocols: a driver converted, {len(bad)} bad pickles refused")


if __name__ == "__main__":
    if sys.argv[1:2] in (["--help"], ["-h"]):
        print(__doc__)
        sys.exit()
    if numpy is None:
        if sys.argv[1:] == ["--self-test"]:
            print("SKIP: NumPy is not there")
            sys.exit()
        sys.exit("driver_pkl_to_npz.py: NumPy is missing: pip install numpy")
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    elif len(sys.argv) == 3:
        try:
            for name, array in convert(sys.argv[1], sys.argv[2]).items():
                print(f"{name} {array.dtype} {list(array.shape)}")
        except (OSError, pickle.UnpicklingError, ValueError) as error:
            sys.exit(f"{sys.argv[1]}: {error}")
    else:
        sys.exit(__doc__)
