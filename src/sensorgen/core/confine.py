"""Confine this process for good: from then on it computes, and reads and writes the pipes that it has.

Linux on x86_64 and aarch64: a seccomp filter that allows 27 system calls and refuses all others (files, network,
processes, threads, signals, executable memory), and Landlock where the kernel has it. Other systems have neither.
"""

import ctypes
import os
import struct
import sys
from pathlib import Path

_MACHINES = {"x86_64": (0xC000003E, 0), "aarch64": (0xC00000B7, 1)}  # AUDIT_ARCH_*, column of the numbers below
_ALLOWED = (  # x86_64, aarch64
    (0, 63), (1, 64), (3, 57), (8, 62),  # read, write, close, lseek
    (12, 214), (11, 215), (25, 216), (28, 233),  # brk, munmap, mremap, madvise
    (13, 134), (14, 135), (15, 139), (131, 132), (219, 128),  # rt_sigaction, -procmask, -return, sigaltstack, restart
    (39, 172), (186, 178), (98, 165), (202, 98), (24, 124),  # getpid, gettid, getrusage, futex, sched_yield
    (96, 169), (228, 113), (229, 114), (318, 278), (60, 93), (231, 94),  # times, getrandom, exit, exit_group
)  # fmt: skip
_ALLOWED_UNLESS = (  # numbers; arguments none of whose bits may be set
    ((9, 222), ((2, 4),)), ((10, 226), ((2, 4),)),  # mmap, mprotect: PROT_EXEC
    ((302, 261), ((0, 0xFFFFFFFF), (1, 0xFFFFFFFF))),  # prlimit64: of this process, RLIMIT_CPU
)  # fmt: skip
_LOAD, _EQUAL, _ANY_BIT, _RETURN = 0x20, 0x15, 0x45, 0x06
_ALLOW, _REFUSE, _KILL = 0x7FFF0000, 0x00050001, 0x80000000  # refused: EPERM
_NO_NEW_PRIVILEGES, _SET_SECCOMP, _FILTER = 38, 22, 2
_LANDLOCK_CREATE, _LANDLOCK_RESTRICT = 444, 446


class Unconfined(OSError):
    """The kernel does not confine this process."""

    def __str__(self) -> str:
        return f"did not run, since this kernel does not confine it ({super().__str__()}); expected one with seccomp"


def available() -> bool:
    """True where :func:`confine` can do its work: Linux of 64 bit on x86_64 or aarch64."""
    return sys.platform == "linux" and os.uname().machine in _MACHINES and struct.calcsize("P") == 8


def confine() -> None:
    """Confine this process, which has one thread.

    Raises
    ------
    Unconfined
        The kernel refuses, or there are threads, which would stay free.
    """
    if len([*Path("/proc/self/task").iterdir()]) > 1:
        raise Unconfined("other threads run")
    libc = ctypes.CDLL(None, use_errno=True)
    libc.syscall.restype = ctypes.c_long
    program = _program(*_MACHINES[os.uname().machine])
    code = ctypes.create_string_buffer(program, len(program))
    filters = ctypes.create_string_buffer(struct.pack("HxxxxxxQ", len(program) // 8, ctypes.addressof(code)))
    if libc.prctl(_NO_NEW_PRIVILEGES, *map(ctypes.c_ulong, (1, 0, 0, 0))) != 0:
        raise Unconfined(ctypes.get_errno(), "no_new_privs")
    _landlock(libc)
    if libc.prctl(_SET_SECCOMP, ctypes.c_ulong(_FILTER), filters, ctypes.c_ulong(0), ctypes.c_ulong(0)) != 0:
        raise Unconfined(ctypes.get_errno(), "seccomp")


def _landlock(libc: ctypes.CDLL) -> None:
    """Refuse every file, TCP port and abstract socket; a kernel without Landlock leaves that to the filter."""
    number, zero = ctypes.c_long, ctypes.c_long(0)
    version = libc.syscall(number(_LANDLOCK_CREATE), None, zero, number(1))
    if version < 1:
        return
    files = (1 << 13 + (version >= 2) + (version >= 3) + (version >= 5)) - 1
    rules = struct.pack("QQQ", files, 3, 3)[: 8 * (1 + (version >= 4) + (version >= 6))]
    handle = libc.syscall(number(_LANDLOCK_CREATE), rules, number(len(rules)), zero)
    if handle < 0 or libc.syscall(number(_LANDLOCK_RESTRICT), number(handle), zero) != 0:
        raise Unconfined(ctypes.get_errno(), "Landlock")
    os.close(handle)


def _program(machine: int, column: int) -> bytes:
    """Filter in the kernel's BPF: instructions of code, jumps if true and false, value."""
    code = [(_LOAD, 0, 0, 4), (_EQUAL, 1, 0, machine), (_RETURN, 0, 0, _KILL), (_LOAD, 0, 0, 0)]
    for numbers in _ALLOWED:
        code += [(_EQUAL, 0, 1, numbers[column]), (_RETURN, 0, 0, _ALLOW)]
    for numbers, unless in _ALLOWED_UNLESS:
        length = 2 * len(unless)
        code.append((_EQUAL, 0, length + 2, numbers[column]))
        for i, (argument, bits) in enumerate(unless):
            code += [(_LOAD, 0, 0, 16 + 8 * argument), (_ANY_BIT, length - 2 * i - 1, 0, bits)]
        code += [(_RETURN, 0, 0, _ALLOW), (_RETURN, 0, 0, _REFUSE)]
    code.append((_RETURN, 0, 0, _REFUSE))
    return b"".join(struct.pack("HBBI", *each) for each in code)
