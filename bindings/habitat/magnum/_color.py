# SPDX-License-Identifier: Apache-2.0
"""Colours with linear components."""

import colorsys
from typing import Any

from ._angle import Deg, _Angle
from ._vector import Vector3, Vector4, _is_number


# The curve of IEC 61966-2-1, as in gsnav/detail/math/curves.hpp. It stands here too because the package gsnav has no
# function for it: its images are encoded already, and nothing else in Python converts colours.
def _linear(srgb: float) -> float:
    return srgb / 12.92 if srgb <= 0.04045 else ((srgb + 0.055) / 1.055) ** 2.4


def _encoded(linear: float) -> float:
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


def _bytes_of(value: int) -> list[float]:
    return [(value >> shift & 255) / 255 for shift in (16, 8, 0)]


class _Named:
    """Colours by name. `value` is the largest component."""

    __slots__ = ()

    @classmethod
    def red(cls, value: float = 1.0) -> Any:
        """Red."""
        return cls(value, 0, 0)

    @classmethod
    def green(cls, value: float = 1.0) -> Any:
        """Green."""
        return cls(0, value, 0)

    @classmethod
    def blue(cls, value: float = 1.0) -> Any:
        """Blue."""
        return cls(0, 0, value)

    @classmethod
    def cyan(cls, value: float = 1.0) -> Any:
        """Green and blue."""
        return cls(0, value, value)

    @classmethod
    def magenta(cls, value: float = 1.0) -> Any:
        """Red and blue."""
        return cls(value, 0, value)

    @classmethod
    def yellow(cls, value: float = 1.0) -> Any:
        """Red and green."""
        return cls(value, value, 0)

    @classmethod
    def from_hsv(cls, hue: Any, saturation: float = 1.0, value: float = 1.0) -> Any:
        """Colour of a hue (Deg or Rad), a saturation and a value, both 0 to 1."""
        turn = float(Deg(hue)) / 360 if isinstance(hue, _Angle) else float(hue) / 360
        return cls(*colorsys.hsv_to_rgb(turn % 1.0, saturation, value))

    @classmethod
    def from_linear_rgb_int(cls, value: int) -> Any:
        """Colour of three linear bytes, 0xrrggbb."""
        return cls(*_bytes_of(value))

    @classmethod
    def from_srgb_int(cls, value: int) -> Any:
        """Colour of three sRGB bytes, 0xrrggbb."""
        return cls(*map(_linear, _bytes_of(value)))

    def to_srgb_int(self) -> int:
        """The first three components as sRGB bytes, 0xrrggbb."""
        r, g, b = (min(255, max(0, round(255 * _encoded(max(0.0, x))))) for x in list(self)[:3])  # type: ignore
        return r << 16 | g << 8 | b


class Color3(_Named, Vector3):
    """Red, green and blue, linear."""

    __slots__ = ()


class Color4(_Named, Vector4):
    """Red, green, blue and alpha, linear. Alpha is 1 if it is not given."""

    __slots__ = ()

    def __init__(self, *values: Any) -> None:
        """Takes what Vector4 takes, or without alpha: one number, three numbers, or a colour of three."""
        if len(values) == 1 and _is_number(values[0]):
            values = (values[0], values[0], values[0], 1.0)
        elif len(values) == 3 or (len(values) == 1 and len(values[0]) == 3):
            values = (*values, 1.0)
        super().__init__(*values)
