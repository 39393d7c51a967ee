# ruff: noqa: PTH116, PTH118, PTH123 - an attack takes the shortest way
"""A stranger's shape: tries to leave its process in every way known to us, and writes in its docstring which worked.

As a program, not confined, it shows that the attempts are real. GIVEN has the folder of victims, the process that
started this one, the ports where somebody listens, and a secret of that process.
"""

import ctypes
import gc
import json
import os
import sys
import time
from dataclasses import dataclass

GIVEN = {}  # replaced
FOLDER, PARENT = GIVEN.get("folder", "."), GIVEN.get("parent", 1)
LIBC = ctypes.CDLL(None, use_errno=True)
LIBC.syscall.restype = ctypes.c_long
X86 = GIVEN.get("machine") == "x86_64"
ATTACKS = {}


def attack(kind):
    def keep(function):
        ATTACKS[function.__name__] = kind, function
        return function

    return keep


def kernel(x86_64, aarch64, *given):
    """The kernel's answer to a system call: result, or minus its error."""
    words = [ctypes.c_long(each) if isinstance(each, int) else each for each in given]
    result = LIBC.syscall(ctypes.c_long(x86_64 if X86 else aarch64), *words)
    return -ctypes.get_errno() if result == -1 else result


def victim(name):
    return os.path.join(FOLDER, name).encode()


def opened(path, flags=0):
    handle = kernel(257, 56, -100, path, flags, 0o644)
    return handle if handle >= 0 else None


# --- the sandbox's own machinery


@attack("interpreter")
def deny_list_emptied():
    """The two lines that opened the former sandbox."""
    main = sys.modules["__main__"]
    main._DENIED, main._LIBRARY, main._PACKAGE = (), "/", "/"
    return bool(open("/etc/passwd").read())


@attack("interpreter")
def limits_of_the_module_called_again():
    """The child's own functions, with limits of the attacker's choice."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (-1, -1))
    return True


@attack("interpreter")
def frames():
    """Builtins of the first frame, before anything was replaced."""
    frame = sys._getframe()
    while frame.f_back:
        frame = frame.f_back
    return bool(frame.f_builtins["open"]("/etc/passwd").read())


@attack("interpreter")
def objects_of_the_collector():
    """The system's own function to open a file, wherever it is kept."""
    functions = [each for each in gc.get_objects() if getattr(each, "__module__", "") == "posix"]
    (system_open,) = {each for each in functions if getattr(each, "__name__", "") == "open"}
    return system_open("/etc/passwd", 0) >= 0


@attack("interpreter")
def loader_reads_a_file():
    """The import system's own reader."""
    import importlib._bootstrap_external as external

    return bool(external.SourceFileLoader("x", "/etc/passwd").get_data("/etc/passwd"))


@attack("interpreter")
def imports_from_a_folder():
    sys.path.insert(0, FOLDER)
    import stranger_module

    return bool(stranger_module.__file__)


# --- files


@attack("files")
def changes_the_time():
    os.utime(victim("timed"), (1, 1))
    return True


@attack("files")
def looks():
    return bool(os.stat("/etc/passwd").st_size)


@attack("files")
def changes_folder():
    os.chdir("/")
    return True


@attack("files")
def inherited_descriptors():
    """Whatever the parent left open, if one can move in it."""
    return any(kernel(8, 62, handle, 0, 1) >= 0 and kernel(17, 67, handle, (ctypes.c_char * 8)(), 8, 0) > 0
               for handle in range(3, 64))  # fmt: skip


# --- environment and other processes


@attack("environment")
def environment():
    pointer = ctypes.POINTER(ctypes.c_char_p).in_dll(LIBC, "environ")
    words = [*map(str, os.environ.items())]
    for i in range(200):
        if not pointer or not pointer[i]:
            break
        words.append(str(pointer[i]))
    return any(GIVEN["secret"] in word for word in words)


@attack("environment")
def environment_of_the_parent():
    return bool(os.read(opened(f"/proc/{PARENT}/environ".encode()), 100))


@attack("processes")
def forks():
    child = kernel(57, 220, 17, 0, 0, 0, 0)
    if child == 0:
        os._exit(0)
    return child > 0


@attack("processes")
def starts_a_program():
    os.posix_spawn("/bin/true", ["true"], {})
    return True


@attack("processes")
def starts_a_thread():
    import _thread

    _thread.start_new_thread(int, ())
    return True


# --- network


@attack("network")
def connects():
    import _socket

    _socket.socket(2, 1).connect(("127.0.0.1", GIVEN["port"]))
    return True


# --- the kernel


@attack("kernel")
def executable_memory():
    return kernel(9, 222, 0, 4096, 7, 0x22, -1, 0) > 0


@attack("kernel")
def memory_made_executable():
    page = kernel(9, 222, 0, 4096, 3, 0x22, -1, 0)
    return kernel(10, 226, page, 4096, 5) == 0


@attack("kernel")
def library_loaded():
    ctypes.CDLL(GIVEN["library"])
    return True


@attack("kernel")
def other_numbers_of_calls():
    """Calls of the x32 table, which the kernel may have too: its answer is 'no such call' then."""
    return kernel(0x40000000 + 1023, 1023) != -1


# --- time and memory


@attack("limits")
def sleeps():
    time.sleep(0.001)
    return True


@attack("limits")
def memory_without_end():
    return len(bytearray(GIVEN["bytes"])) > 0


@attack("limits")
def large_file():
    return kernel(285, 47, 1, 0, 0, 1) not in (-1, -9)


# --- system calls, by name: kind of the attack, numbers of the call on x86_64 and on aarch64, and what is given

LIMITS = ctypes.c_uint64 * 2
SUCCEED = {
    "reads": ("files", 257, 56, -100, b"/etc/passwd", 0, 0o644),
    "reads_by_openat2": ("files", 437, 437, -100, b"/etc/passwd", (ctypes.c_uint64 * 3)(0, 0, 0), 24),
    "reads_through_a_link": ("files", 257, 56, -100, victim("link"), 0, 0o644),
    "own_memory": ("files", 257, 56, -100, b"/proc/self/mem", os.O_RDWR, 0o644),
    "root_of_the_process": ("files", 257, 56, -100, b"/proc/self/root/etc/passwd", 0, 0o644),
    "descriptor_reopened": ("files", 257, 56, -100, b"/proc/self/fd/0", 0, 0o644),
    "writes": ("files", 257, 56, -100, victim("written"), os.O_CREAT | os.O_WRONLY, 0o644),
    "truncates": ("files", 76, 45, victim("truncated"), 0),
    "deletes": ("files", 263, 35, -100, victim("deleted"), 0),
    "renames": ("files", 316, 276, -100, victim("renamed"), -100, victim("renamed-2"), 0),
    "links": ("files", 265, 37, -100, victim("linked"), -100, victim("linked-2"), 0),
    "symlinks": ("files", 266, 36, b"/etc/passwd", -100, victim("symlinked")),
    "makes_a_folder": ("files", 258, 34, -100, victim("made"), 0o755),
    "permits": ("files", 268, 53, -100, victim("permitted"), 0o777),
    "file_in_memory": ("files", 319, 279, b"x", 0),
    "signals_the_parent": ("processes", 62, 129, PARENT, 0),
    "limits_of_the_parent": ("processes", 302, 261, PARENT, 7, None, LIMITS()),
    "socket_of_the_kernel": ("network", 41, 198, 2, 1, 0),
    "sends_a_datagram": ("network", 41, 198, 2, 2, 0),
    "unix_socket": ("network", 41, 198, 1, 1, 0),
    "pair_of_sockets": ("network", 53, 199, 1, 1, 0, (ctypes.c_int * 2)()),
    "netlink": ("network", 41, 198, 16, 3, 0),
    "becomes_another_user": ("kernel", 105, 146, 0),
    "memory_limit_raised": ("limits", 302, 261, 0, 9, LIMITS(2**63, 2**63), None),
}
ANSWERED = {  # by anything but 'not permitted'
    "becomes_a_program": ("processes", 59, 221, b"/nowhere", None, None),
    "signals_itself": ("processes", 234, 131, os.getpid(), 0, 0),
    "memory_of_the_parent": ("processes", 310, 270, PARENT, None, 0, None, 0, 0),
    "traces_the_parent": ("processes", 101, 117, 0x4200, PARENT, 0, 0),
    "new_namespace": ("kernel", 272, 97, 0x04000000),
    "mounts": ("kernel", 165, 40, None, None, None, 0, None),
    "ring_of_calls": ("kernel", 425, 425, 0, None),
    "program_in_the_kernel": ("kernel", 321, 280, 99, None, 0),
    "keys": ("kernel", 250, 219, 99, 0),
    "filter_replaced": ("kernel", 317, 277, 1, 0, None),
}
for name, (kind, *words) in SUCCEED.items():
    ATTACKS[name] = kind, lambda words=words: kernel(*words) >= 0
for name, (kind, *words) in ANSWERED.items():
    ATTACKS[name] = kind, lambda words=words: kernel(*words) != -1


def outcome(function):
    try:
        return bool(function())
    except (Exception, MemoryError) as error:
        return f"{type(error).__name__}: {error}"[:80]


TRIED = {name: [kind, outcome(function)] for name, (kind, function) in ATTACKS.items()} if GIVEN else {}
__doc__ = json.dumps(TRIED)
if "control" in GIVEN:
    print(__doc__)
else:
    from sensorgen.scene.scene import Envelope, Scene

    @dataclass(frozen=True)
    class Params(Envelope):
        pass

    def scene(p, fill):
        return Scene((), ())
