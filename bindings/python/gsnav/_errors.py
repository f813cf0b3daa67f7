# SPDX-License-Identifier: Apache-2.0
"""Exceptions. Each code of the C++ library has one, which is also the built-in exception for the case."""

import enum


class Errc(enum.Enum):
    """Category of an error, with the names of C++."""

    invalid_argument = "invalid_argument"
    invalid_file = "invalid_file"
    file_not_found = "file_not_found"
    unsupported = "unsupported"
    out_of_memory = "out_of_memory"
    nothing_navigable = "nothing_navigable"
    backend_failure = "backend_failure"
    write_failed = "write_failed"


class Error(Exception):
    """Base of the library's exceptions. The message names the file, field and value."""

    code: Errc = Errc.backend_failure


class InvalidArgument(Error, ValueError):
    """An impossible value, or a call at an impossible time."""

    code = Errc.invalid_argument


class InvalidFile(Error, ValueError):
    """A file's content is malformed or truncated."""

    code = Errc.invalid_file


class FileNotFound(Error, FileNotFoundError):
    """A path does not exist, or cannot be opened for reading or writing."""

    code = Errc.file_not_found


class Unsupported(Error, NotImplementedError):
    """Valid input that gsnav does not handle, or a device that this machine does not have."""

    code = Errc.unsupported


class OutOfMemory(Error, MemoryError):
    """An allocation failed."""

    code = Errc.out_of_memory


class NothingNavigable(Error, ValueError):
    """No walkable surface, no path, or a position off the NavMesh."""

    code = Errc.nothing_navigable


class BackendFailure(Error, RuntimeError):
    """A device or driver reported an error."""

    code = Errc.backend_failure


class WriteFailed(Error, OSError):
    """A file was started and could not be finished."""

    code = Errc.write_failed


class ClosedEnvironment(InvalidArgument):
    """A call of an environment after close()."""


BY_CODE = {
    error.code.value: error
    for error in (InvalidArgument, InvalidFile, FileNotFound, Unsupported, OutOfMemory, NothingNavigable,
                  BackendFailure, WriteFailed)
}
