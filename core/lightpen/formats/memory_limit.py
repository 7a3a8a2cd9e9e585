"""A limit to the memory of this process, by the operating system.

Linux limits its data (``RLIMIT_DATA``), Windows what it has committed, by a job object
[1]_. Whatever asks for more is told that there is none.

References
----------
.. [1] learn.microsoft.com, Win32 API, "Job Objects" and
   "JOBOBJECT_EXTENDED_LIMIT_INFORMATION structure".
"""

import ctypes
import sys
from pathlib import Path


def limit_memory(more: int) -> None:
    """Let this process have no more memory than it has, and so many bytes.

    It stays as it is where the system knows no such limit.

    Raises
    ------
    OSError
        The system refuses.
    """
    if sys.platform == "linux":
        import resource

        status = Path("/proc/self/status").read_text("ascii")
        (data,) = (line for line in status.splitlines() if line.startswith("VmData:"))
        most = int(data.split()[1]) * 1024 + more
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        if hard == resource.RLIM_INFINITY or most < hard:
            resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
    elif sys.platform == "win32":
        _limit_committed(more)


if sys.platform == "win32":
    from ctypes import wintypes

    EXTENDED_LIMITS = 9  # JobObjectExtendedLimitInformation
    LIMIT_PROCESS_MEMORY = 0x100  # JOB_OBJECT_LIMIT_PROCESS_MEMORY

    class _MemoryCounters(ctypes.Structure):
        """PROCESS_MEMORY_COUNTERS_EX."""

        _fields_ = (
            ("cb", wintypes.DWORD),
            ("PageFaultCount", wintypes.DWORD),
            ("Sizes", ctypes.c_size_t * 8),
            ("PrivateUsage", ctypes.c_size_t),
        )

    class _ExtendedLimits(ctypes.Structure):
        """JOBOBJECT_EXTENDED_LIMIT_INFORMATION."""

        _fields_ = (
            ("Times", wintypes.LARGE_INTEGER * 2),
            ("LimitFlags", wintypes.DWORD),
            ("WorkingSetSizes", ctypes.c_size_t * 2),
            ("ActiveProcessLimit", wintypes.DWORD),
            ("Affinity", ctypes.c_size_t),
            ("PriorityClass", wintypes.DWORD),
            ("SchedulingClass", wintypes.DWORD),
            ("IoInfo", ctypes.c_ulonglong * 6),
            ("ProcessMemoryLimit", ctypes.c_size_t),
            ("JobMemoryLimit", ctypes.c_size_t),
            ("PeakProcessMemoryUsed", ctypes.c_size_t),
            ("PeakJobMemoryUsed", ctypes.c_size_t),
        )

    def _limit_committed(more: int) -> None:
        windows = ctypes.WinDLL("kernel32", use_last_error=True)
        windows.GetCurrentProcess.restype = wintypes.HANDLE
        windows.CreateJobObjectW.restype = wintypes.HANDLE
        this = wintypes.HANDLE(windows.GetCurrentProcess())
        has = _MemoryCounters(cb=ctypes.sizeof(_MemoryCounters))
        _require(windows.K32GetProcessMemoryInfo(this, ctypes.byref(has), has.cb))
        limits = _ExtendedLimits(
            LimitFlags=LIMIT_PROCESS_MEMORY,
            ProcessMemoryLimit=has.PrivateUsage + more,
        )
        # Its handle stays open: the job lasts as long as this process.
        job = wintypes.HANDLE(_require(windows.CreateJobObjectW(None, None)))
        size = ctypes.sizeof(limits)
        _require(
            windows.SetInformationJobObject(
                job, EXTENDED_LIMITS, ctypes.byref(limits), size
            )
        )
        _require(windows.AssignProcessToJobObject(job, this))

    def _require(answer: int | None) -> int:
        if not answer:
            raise ctypes.WinError(ctypes.get_last_error())
        return answer
