# SPDX-License-Identifier: Apache-2.0
"""Parts that the packages of the distribution gsnav-habitat share: the notice on import, the check that no other
distribution owns their names, and placeholders for names that are not served."""

import abc
import functools
import os
import sys
import warnings
from importlib.machinery import PathFinder
from typing import Any, Callable, Iterator, NoReturn

# Distributions that own the names of this one. "magnum" on PyPI is a service of OpenStack.
_RIVALS = ("habitat_sim", "magnum", "magnum_bindings")


@functools.lru_cache(maxsize=None)
def _distributions() -> dict[str, str]:
    """Versions of this distribution and its rivals, where they are installed, by their names in lower case."""
    # importlib.metadata knows them too, but its import alone takes as long as this package may take.
    found: dict[str, str] = {}
    for folder in sys.path:
        try:
            entries = os.listdir(folder or ".")
        except OSError:
            continue
        for entry in entries:
            stem, dot, kind = entry.rpartition(".")
            name, _, version = (stem, "", "") if kind == "egg-link" else stem.partition("-")
            name = name.lower().replace("-", "_").replace(".", "_")
            if dot and kind in ("dist-info", "egg-info", "egg-link", "egg") and name in (*_RIVALS, "gsnav_habitat"):
                found.setdefault(name, version.split("-")[0])
    return found


def _strangers() -> Iterator[str]:
    """Descriptions of packages of other distributions on the path, with or without metadata."""
    here = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    for package in ("habitat_sim", "magnum", "corrade"):
        loaded = sys.modules.get(package)
        spec = PathFinder.find_spec(package) if loaded is None else loaded.__spec__
        found = [] if spec is None or not spec.origin else [os.path.dirname(spec.origin)]
        for folder in sys.path:  # Those that Python would find later.
            if isinstance(folder, str) and os.path.isfile(os.path.join(folder, package, "__init__.py")):
                found.append(os.path.join(folder, package))
        for folder in found:
            beside = os.path.dirname(os.path.realpath(folder))
            # Another copy of this distribution, such as a checkout, is none.
            if beside != here and not os.path.isdir(os.path.join(beside, "gsnav_habitat")):
                yield f"{package.replace('_', '-')} of unknown version, in {folder},"


def version() -> str:
    """Version of the distribution, or "unknown" where it runs from its sources."""
    return _distributions().get("gsnav_habitat", "unknown")


@functools.lru_cache(maxsize=None)
def claim() -> None:
    """Checks that no other distribution owns habitat_sim or magnum, and says once what this one is.

    A child process says nothing. Raises ImportError naming both distributions if there is another.
    """
    rivals = [f"{name.replace('_', '-')} {_distributions()[name]}" for name in _RIVALS if name in _distributions()]
    for rival in [*rivals, *_strangers()]:
        raise ImportError(
            f"The distributions gsnav-habitat {version()} and {rival.strip()} both provide habitat_sim or magnum. "
            "Uninstall one of them."
        )
    sys.meta_path.append(_UnservedModules)
    if os.environ.setdefault("GSNAV_HABITAT_NOTICE", str(os.getpid())) == str(os.getpid()):
        warnings.warn(
            f"habitat_sim is provided by gsnav (gsnav-habitat {version()}): its navigation part. Not affiliated with "
            "Meta.",
            stacklevel=3,
        )


def config_path(name: str) -> str:
    """Path of one of the distribution's configurations for habitat-lab."""
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), "config", name)


def message(name: str) -> str:
    """Text of the error for a name that is not served."""
    return f"gsnav serves navigation only: {name}"


def _full_name(kind: type, name: str) -> str:
    """Name of an attribute, by the public module of its class."""
    return f"{kind.__module__.partition('._')[0]}.{kind.__qualname__}.{name}"


class NotServed(NotImplementedError, AttributeError):
    """A name that gsnav does not serve. `hasattr` is False for it, as for names that do not exist."""


class NotServedImport(NotImplementedError, ImportError):
    """A module, or a name that is imported from one, that gsnav does not serve."""


class _UnservedModules:
    """The last finder of modules. It raises NotServedImport for those of Habitat-Sim that no finder found, and so for
    `from habitat_sim import name` too, which looks for a module of that name."""

    @staticmethod
    def find_spec(name: str, path: Any = None, target: Any = None) -> None:
        """Finds nothing."""
        root, _, rest = name.partition(".")
        if root in ("habitat_sim", "magnum", "corrade") and rest and rest.rpartition(".")[2][0] != "_":
            raise NotServedImport(message(name))


class _UnservedMember:
    """An attribute of a class that gsnav does not serve. Reading and writing it raise NotServed."""

    def __init__(self, name: str) -> None:
        self._message = message(name)

    def __get__(self, of: Any, kind: Any = None) -> NoReturn:
        raise NotServed(self._message)

    def __set__(self, of: Any, value: Any) -> NoReturn:
        raise NotServed(self._message)


def unserved_members(owner: type, *names: str) -> None:
    """Lets reading and writing these attributes of a class and of its objects raise NotServed."""
    for name in names:
        setattr(owner, name, _UnservedMember(_full_name(owner, name)))


class _Sealing(abc.ABCMeta):  # Subclasses may be abstract.
    def __call__(cls, *args: Any, **kwargs: Any) -> Any:
        made = super().__call__(*args, **kwargs)
        made.__dict__["_complete"] = True
        return made

    def __getattr__(cls, name: str) -> NoReturn:
        """Called for names that a class does not have."""
        if name[0] == "_":
            raise AttributeError(f"type object {cls.__name__!r} has no attribute {name!r}")
        raise NotServed(message(_full_name(cls, name)))


class Sealed(metaclass=_Sealing):
    """Base of objects that have the names of their constructor only: writing another one raises NotServed. Objects of
    subclasses in other packages can be written freely."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self.__dict__ and "_complete" in self.__dict__:
            kind = type(self)
            if name[0] != "_" and not hasattr(kind, name) and kind.__module__.partition(".")[0] == "habitat_sim":
                raise NotServed(message(_full_name(kind, name)))
        object.__setattr__(self, name, value)


class FullySealed(Sealed):
    """Sealed objects of which reading another name raises NotServed too. All reads of them are slower, so SceneNode,
    which is read most, is not one."""

    def __getattr__(self, name: str) -> Any:
        """Called for names that do not exist, and after a property raised AttributeError."""
        kind = type(self)
        if name[0] == "_" or hasattr(kind, name):
            return object.__getattribute__(self, name)  # Raises the usual error.
        raise NotServed(message(_full_name(kind, name)))


def missing(module: str) -> Callable[[str], NoReturn]:
    """The function __getattr__ of a module. It raises NotServed with the name."""

    def look_up(name: str) -> NoReturn:
        if name.startswith("__"):  # Python asks for these.
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        raise NotServed(message(f"{module}.{name}"))

    return look_up


def complete(package: str) -> None:
    """Lets unknown names of a package and of its public modules that are loaded raise NotServed."""
    for name, module in list(sys.modules.items()):
        if f"{name}.".startswith(f"{package}.") and "._" not in name:
            vars(module).setdefault("__getattr__", missing(name))
            vars(module).setdefault("__path__", [])  # So that _UnservedModules is asked for names that are imported.


class _Unserved(type):
    """Type of placeholders. Their attributes and calls raise NotImplementedError."""

    def __call__(cls, *args: Any, **kwargs: Any) -> NoReturn:
        raise NotImplementedError(message(f"{cls.__module__}.{cls.__qualname__}"))

    def __getattr__(cls, name: str) -> NoReturn:
        raise NotServed(message(f"{cls.__module__}.{cls.__qualname__}.{name}"))


def unserved(module: str, name: str, **members: Any) -> type:
    """A class for annotations and imports. It raises NotImplementedError when it or an attribute of it is used.

    `members` become attributes of the class.
    """
    members.setdefault("__doc__", "Not served by gsnav: construction raises NotImplementedError.")
    return _Unserved(name, (), {"__module__": module, **members})
