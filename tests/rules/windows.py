"""What Windows lacks or does otherwise, and how a source says that it knows."""

from __future__ import annotations

import ast
from collections.abc import Iterator

MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty", "uvloop"}
NAMES = {
    "os": {
        *("O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "O_SYNC"),
        *("chown", "fchmod", "fchown", "fork", "forkpty", "getegid", "geteuid", "getgid", "getuid"),
        *("getloadavg", "kill", "killpg", "memfd_create", "mkfifo", "nice", "openpty", "pread"),
        *("pwrite", "register_at_fork", "sched_getaffinity", "sched_setaffinity", "sendfile", "setsid"),
        *("statvfs", "sysconf", "uname", "wait", "waitid", "wait3", "wait4"),
    },
    "signal": {
        *("SIGALRM", "SIGCHLD", "SIGCONT", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT", "SIGSTOP"),
        *("SIGTSTP", "SIGUSR1", "SIGUSR2", "alarm", "pause", "pthread_kill", "pthread_sigmask"),
        *("setitimer", "siginterrupt", "sigwait"),
    },
    "socket": {"AF_UNIX", "SO_REUSEPORT"},
    "select": {"epoll", "kqueue", "poll"},
    "time": {"clock_gettime", "clock_gettime_ns", "tzset"},
}
"""`os.kill` is there, and ends the process at once whatever the signal is."""

METHODS = {
    "add_signal_handler": "event loops of Windows have none",
    "fchmod": "use the path",
    "send_signal": "Windows refuses all but SIGTERM, which ends a process at once",
    "set_event_loop_policy": "the loops of Windows are others",
}
KEYWORDS = {"preexec_fn", "pass_fds"}
TEXT_FILES = {"open": 1, "fdopen": 1, "read_text": 0, "write_text": 1}
"""What opens text, and how many arguments may stand before the encoding."""

GUARDS = ("os.name", "sys.platform", "hasattr(", "fcntl is None", "IS_POSIX")
TIME_OF_DAY = ("%H:%M", "%T", "%X", "%c")


class WindowsCheck:
    """Collects ``file:line: reason``; what stands behind a test of the system is not looked at."""

    def __init__(self, source: str, name: str) -> None:
        self.name = name
        self.found: list[str] = []
        self._statements(ast.parse(source, filename=name).body)

    def _statements(self, body: list[ast.stmt]) -> None:
        """Check statements in order; after a guard that leaves the function nothing is checked."""
        for one in body:
            if isinstance(one, ast.If) and is_guard(one.test):
                if isinstance(one.body[-1], ast.Return | ast.Raise):
                    return
                continue
            if isinstance(one, ast.Try) and any(map(catches_absence, one.handlers)):
                continue
            self._children(one)

    def _children(self, node: ast.AST) -> None:
        self._look(node)
        for _, value in ast.iter_fields(node):
            if isinstance(value, list) and value and isinstance(value[0], ast.stmt):
                self._statements(value)
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and not self._is_guarded(child):
                    self._children(child)

    @staticmethod
    def _is_guarded(node: ast.AST) -> bool:
        if isinstance(node, ast.IfExp):
            return is_guard(node.test)
        return isinstance(node, ast.BoolOp) and is_guard(node.values[0])

    def _look(self, node: ast.AST) -> None:
        for what, reason in findings_at(node):
            line = getattr(node, "lineno", 0)
            self.found.append(f"{self.name}:{line}: {what}: {reason}")


def is_guard(test: ast.expr) -> bool:
    text = ast.unparse(test)
    return any(guard in text for guard in GUARDS)


def catches_absence(handler: ast.ExceptHandler) -> bool:
    text = ast.unparse(handler.type) if handler.type else ""
    return "ImportError" in text or "AttributeError" in text


def findings_at(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield (what, reason) of one node, without those below it."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            if alias.name.split(".")[0] in MODULES:
                yield f"import of {alias.name}", "Windows lacks it"
    elif isinstance(node, ast.ImportFrom) and node.level == 0:
        if (node.module or "") in MODULES:
            yield f"import of {node.module}", "Windows lacks it"
        for alias in node.names:
            if alias.name in NAMES.get(node.module or "", ()):
                yield f"{node.module}.{alias.name}", "Windows lacks it"
    elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        if node.attr in NAMES.get(node.value.id, ()):
            yield f"{node.value.id}.{node.attr}", "Windows lacks it"
    elif isinstance(node, ast.Call):
        yield from findings_in_call(node)
    elif isinstance(node, ast.Constant) and any(form in str(node.value) for form in TIME_OF_DAY):
        yield repr(node.value), "no colon may be in the name of a file"


def findings_in_call(node: ast.Call) -> Iterator[tuple[str, str]]:
    """Yield what a call does that Windows does not, and texts of unknown encoding."""
    called = ast.unparse(node.func).split(".")[-1]
    keywords = {one.arg: one.value for one in node.keywords}
    if called in METHODS and isinstance(node.func, ast.Attribute):
        yield called, METHODS[called]
    for one in KEYWORDS & keywords.keys():
        yield f"{one}=", "Windows lacks it"
    if "encoding" in keywords:
        return
    if is_true(keywords.get("text")) or is_true(keywords.get("universal_newlines")):
        yield "text=True", "say encoding=, which is another one on Windows"
    elif called in TEXT_FILES and opens_text(node, called, keywords):
        yield f"{called}()", "say encoding=, which is another one on Windows"


def is_true(value: ast.expr | None) -> bool:
    return isinstance(value, ast.Constant) and value.value is True


def opens_text(node: ast.Call, called: str, keywords: dict[str | None, ast.expr]) -> bool:
    """Return whether a call opens a text without its encoding, as far as can be seen."""
    if called in ("read_text", "write_text"):
        return isinstance(node.func, ast.Attribute) and len(node.args) == TEXT_FILES[called]
    is_method = isinstance(node.func, ast.Attribute) and called == "open"
    owner = ast.unparse(node.func.value) if isinstance(node.func, ast.Attribute) else ""
    if is_method and not looks_like_a_path(owner):
        return False
    given = [*node.args[(0 if is_method else 1) :], *[v for k, v in keywords.items() if k == "mode"]]
    modes = [one.value for one in given if isinstance(one, ast.Constant) and isinstance(one.value, str)]
    return not any("b" in mode for mode in modes)


def looks_like_a_path(owner: str) -> bool:
    return "path" in owner.lower() or owner.split(".")[-1] in ("file", "lock", "part", "target", "log")


def findings_in(source: str, name: str) -> list[str]:
    """Return one line for each thing that Windows lacks and that is used without a branch."""
    return WindowsCheck(source, name).found
