"""Runs a program without memory that is both written and executed, as systemd's MemoryDenyWriteExecute=yes does.

    python no_write_execute.py PROGRAM ARGUMENT...

A seccomp filter refuses mmap() of memory that may be written and executed, and mprotect() that makes memory executable.
(Numbers: Linux's uapi headers seccomp.h, filter.h, audit.h and unistd.h.)
"""

import ctypes
import mmap
import os
import platform
import struct
import sys

_MMAP, _MPROTECT, _PKEY_MPROTECT = {"x86_64": (9, 10, 329), "aarch64": (222, 226, 288)}[platform.machine()]
_LOAD, _AND, _EQUAL, _RETURN = 0x20, 0x54, 0x15, 0x06
_NUMBER_AT, _PROTECTION_AT = 0, 32  # in struct seccomp_data: the system call, and its third argument
_WRITE_EXECUTE, _EXECUTE = 6, 4
_ALLOW, _REFUSE = 0x7FFF0000, 0x00050001  # the latter with EPERM
_NO_NEW_PRIVS, _SET_SECCOMP, _FILTER = 38, 22, 2  # of prctl

_PROGRAM = (
    (_LOAD, 0, 0, _NUMBER_AT),
    (_EQUAL, 3, 0, _MMAP),
    (_EQUAL, 5, 0, _MPROTECT),
    (_EQUAL, 4, 0, _PKEY_MPROTECT),
    (_RETURN, 0, 0, _ALLOW),
    (_LOAD, 0, 0, _PROTECTION_AT),
    (_AND, 0, 0, _WRITE_EXECUTE),
    (_EQUAL, 4, 3, _WRITE_EXECUTE),
    (_LOAD, 0, 0, _PROTECTION_AT),
    (_AND, 0, 0, _EXECUTE),
    (_EQUAL, 1, 0, _EXECUTE),
    (_RETURN, 0, 0, _ALLOW),
    (_RETURN, 0, 0, _REFUSE),
)


def forbid() -> None:
    code = b"".join(struct.pack("HBBI", *instruction) for instruction in _PROGRAM)
    room = ctypes.create_string_buffer(code)
    program = ctypes.create_string_buffer(struct.pack("HP", len(_PROGRAM), ctypes.addressof(room)))
    prctl = ctypes.CDLL(None, use_errno=True).prctl
    for words in ((_NO_NEW_PRIVS, 1, 0, 0, 0), (_SET_SECCOMP, _FILTER, ctypes.addressof(program), 0, 0)):
        if prctl(*(ctypes.c_ulong(word) for word in words)) != 0:
            raise OSError(ctypes.get_errno(), f"prctl{words}")


def main() -> None:
    forbid()
    try:
        mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
    except PermissionError:
        os.execvp(sys.argv[1], sys.argv[1:])
    sys.exit("memory can still be written and executed")


if __name__ == "__main__":
    main()
